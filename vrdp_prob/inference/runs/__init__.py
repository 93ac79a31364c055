"""Long work: kept in a folder, gone on with, spread over processes."""

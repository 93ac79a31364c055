"""One physical cause, one file."""

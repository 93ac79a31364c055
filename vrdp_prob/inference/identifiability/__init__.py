"""What the data say about single masses and restitutions, and what only about combinations."""

"""A learned parser for wordings that the grammar does not know; loaded only when one is met."""

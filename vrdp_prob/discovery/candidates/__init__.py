"""Causes that what is left speaks for, and first guesses of them."""

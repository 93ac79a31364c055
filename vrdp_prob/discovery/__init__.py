"""What the simulation gets wrong."""

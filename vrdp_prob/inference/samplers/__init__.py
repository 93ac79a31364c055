"""What samplers are made of: the clouds that they set out from, their moves, their chains."""

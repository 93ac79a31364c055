"""What samplers make: draws with their density, whether they can be trusted, what they say in a few numbers."""

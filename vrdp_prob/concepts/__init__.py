"""Concepts: what words mean, learned."""

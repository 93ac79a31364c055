"""Concepts: what words mean, learned from questions and answers."""

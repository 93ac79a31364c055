"""Concepts that a video shows: colours, materials, shapes, motion and events, learned from questions and answers."""

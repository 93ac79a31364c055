"""Which causes a model is extended by: refits, how well they predict videos left out, and doubts."""

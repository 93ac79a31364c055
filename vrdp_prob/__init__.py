"""vrdp-prob: a differentiable rigid-body simulator as a likelihood, questions answered with probabilities."""

__version__ = "0.1.0"

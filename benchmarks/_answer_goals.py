"""How many of the answers about the practice scenes should be right."""

from vrdp_prob.evaluation.judgement import Kind

GOALS = {
    Kind.DESCRIPTIVE: (None, 0.97),
    Kind.EXPLANATORY: (None, 0.95),
    Kind.PREDICTIVE: (0.92, 0.90),
    Kind.REMOVAL: (0.92, 0.84),
    Kind.MASS: (0.88, 0.76),
}
"""Wanted accuracy per option and per question."""


def title(kind: Kind) -> str:
    """A kind of question in words."""
    return kind.value.replace("_", ", ")

"""Learned words made by hand."""

from vrdp_prob.concepts.physical import LearnedWord
from vrdp_prob.concepts.physical.belief import Belief
from vrdp_prob.concepts.physical.learned_word import Evidence, Interval
from vrdp_prob.reasoning.changes import PhysicalParameter, Rule

MASS = Belief(PhysicalParameter.MASS, Rule.FACTOR, 0.6, 0.01, 3.0, (0.5, 1.0, 2.0), (0.0, 0.25, 0.75))
SPEED = Belief(PhysicalParameter.SPEED, Rule.OFFSET, 0.15, 0.01, 1.0, (-1.0, 0.0, 1.0), (0.0, 0.5, 0.5))
NOTHING = Belief(None, None, 0.25, 0.02, 2.0)


def word(*beliefs: Belief, name: str = "floppier", log_gain: float = 4.0) -> LearnedWord:
    errors = {"nothing": 0.02, "mass": 0.01, "speed": 0.01}
    return LearnedWord(
        name, beliefs, errors, Interval(0.1, 0.01, 0.3), log_gain, 0.1, Evidence(2, 3, 9, 200, 0, ("v9 was left out.",))
    )


UNSURE = word(NOTHING, MASS, SPEED)

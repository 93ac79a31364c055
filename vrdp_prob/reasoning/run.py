"""The state of one program while it runs: the facts, and the draws in which the question still makes sense."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.facts import Facts
from vrdp_prob.reasoning.values import Change

SMALLEST_VALID_SHARE = 0.01
"""A question that makes sense in fewer draws than this share is refused instead of answered from a handful."""

World = str | tuple[Change, int]


@dataclass
class Run:
    """One program at work.

    Parameters
    ----------
    facts
        What is known about the video.
    """

    facts: Facts
    valid: Bool[np.ndarray, "draw"] = field(init=False)
    looked_at: set[World] = field(default_factory=set, init=False)
    reasons: list[str] = field(default_factory=list, init=False)

    def __post_init__(self) -> None:
        self.valid = np.ones(self.facts.draws, dtype=bool)

    def require(self, makes_sense: Bool[np.ndarray, "draw"], otherwise: str) -> None:
        """Keep only draws in which a step of the program makes sense.

        Parameters
        ----------
        makes_sense
            Draws in which it does.
        otherwise
            What is wrong in the others, as a sentence for the person who asked.

        Raises
        ------
        InputError
            If (nearly) no draw is left.
        """
        kept = self.valid & makes_sense
        if kept.mean() < SMALLEST_VALID_SHARE:
            raise InputError(otherwise)
        if kept.sum() < self.valid.sum():
            self.reasons.append(otherwise.rstrip("."))
        self.valid = kept

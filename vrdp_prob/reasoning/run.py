"""The state of one program while it runs: the facts, and the draws in which the question still makes sense."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.changes import Change
from vrdp_prob.reasoning.facts import Facts

SMALLEST_VALID_SHARE = 0.01
"""A question that makes sense in fewer draws than this share is refused instead of answered from a handful."""

World = str | tuple[Change, int]


@dataclass(frozen=True)
class Gap:
    """Draws that a step of a program could not answer, for a note.

    Parameters
    ----------
    share
        Their share of all draws.
    clause
        What is the matter in them, as a clause after 'in 3 % of the draws': 'there is no red cube'.
    causes
        Why the draws differ, in sentences.
    """

    share: float
    clause: str
    causes: tuple[str, ...] = ()


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
    gaps: list[Gap] = field(default_factory=list, init=False)

    def __post_init__(self) -> None:
        self.valid = np.ones(self.facts.draws, dtype=bool)

    def require(
        self,
        makes_sense: Bool[np.ndarray, "draw"],
        refusal: str,
        clauses: Sequence[tuple[Bool[np.ndarray, "draw"], str]] = (),
        causes: tuple[str, ...] = (),
    ) -> None:
        """Keep only draws in which a step of the program makes sense.

        Parameters
        ----------
        makes_sense
            Draws in which it does.
        refusal
            What is wrong and how to mend it, as a sentence for the person who asked, where hardly a draw is left.
        clauses
            What is the matter in which of the others, for a note where enough draws are left; the refusal's words where
            nothing else is said. Draws that left the question before do not count.
        causes
            Why the draws differ, in sentences.

        Raises
        ------
        InputError
            If (nearly) no draw is left.
        """
        kept = self.valid & makes_sense
        if kept.mean() < SMALLEST_VALID_SHARE:
            raise InputError(refusal)
        for draws, clause in clauses or [(~makes_sense, refusal.rstrip("."))]:
            lost = float(np.mean(self.valid & ~makes_sense & draws))
            if lost > 0:
                self.gaps.append(Gap(lost, clause, causes))
        self.valid = kept

"""What a question comes to in each draw, before the draws are summarised."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int

from vrdp_prob.reasoning.facts import Facts
from vrdp_prob.reasoning.prepared import PreparedQuestion
from vrdp_prob.reasoning.program import ANSWERS, Program
from vrdp_prob.reasoning.run import Run
from vrdp_prob.reasoning.values import Count, Label, Truth, Value

YES = 1
"""Code of yes in a verdict of yes or no."""


@dataclass(frozen=True)
class Verdict:
    """One open question, or one choice, in each draw.

    Parameters
    ----------
    run
        How its program ran.
    codes
        The answer of each draw as a place in `names`.
    names
        The possible answers; `no` and `yes` for a choice.
    counts
        Whether the answers are numbers.
    """

    run: Run
    codes: Int[np.ndarray, "draw"]
    names: tuple[str, ...]
    counts: bool = False

    @property
    def valid(self) -> Bool[np.ndarray, "draw"]:
        """Draws in which the question makes sense."""
        return self.run.valid


def verdicts(facts: Facts, asked: PreparedQuestion) -> tuple[Verdict, ...]:
    """What the question, or each of its choices, comes to in each draw.

    Parameters
    ----------
    facts
        What is known about the video.
    asked
        The question.

    Raises
    ------
    InputError
        If it makes sense in (nearly) no draw.
    """
    programs = [program for _, program in asked.options] if asked.program is None else [asked.program]
    return tuple(_verdict(facts, program) for program in programs)


def _verdict(facts: Facts, program: Program) -> Verdict:
    run = Run(facts)
    value = program.run(run)
    return Verdict(run, *_codes(value), counts=isinstance(value, Count))


def _codes(value: Value) -> tuple[Int[np.ndarray, "draw"], tuple[str, ...]]:
    """The answer of each draw as a place in a list of names."""
    if isinstance(value, Truth):
        return value.value.astype(int), ("no", "yes")
    if isinstance(value, Count):
        return value.value, tuple(str(number) for number in range(int(value.value.max()) + 1))
    if isinstance(value, Label):
        return value.index, value.names
    raise TypeError(f"a question cannot end with {type(value).__name__}, one of {ANSWERS} is needed")

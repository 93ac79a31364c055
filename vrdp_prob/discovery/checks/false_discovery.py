"""False discovery rate control over many checks."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from vrdp_prob.discovery.finding import Check

RATE = 0.05
"""Largest share of false ones among the checks that count (and probability of any where nothing is wrong)."""
SEEN = 0.01
"""Probability by chance below which something was seen, however many other checks count."""
LEFT_LEVEL = 0.005
"""Probability, over all checks, with which a model is taken to leave something."""


def significant(p_values: Float[np.ndarray, "check"], rate: float = RATE) -> Bool[np.ndarray, "check"]:
    """Which of many p-values count.

    Source: Y. Benjamini and Y. Hochberg, Controlling the false discovery rate, J. R. Statist. Soc. B 57 (1995). It
    holds for positively dependent tests (Benjamini and Yekutieli, Ann. Statist. 29, 2001); tests of the same residuals
    are dependent in other ways too, so the rate where nothing is wrong is measured, in the tests.
    """
    count = len(p_values)
    order = np.argsort(p_values, kind="stable")
    below = p_values[order] <= rate * np.arange(1, count + 1) / max(count, 1)
    last = int(np.flatnonzero(below).max(initial=-1))
    result = np.zeros(count, dtype=bool)
    result[order[: last + 1]] = True
    return result


def controlled(checks: Sequence[Check]) -> tuple[Check, ...]:
    """The same checks, those marked that count, the most significant first.

    Where most checks fail by far, the control of false discoveries lets p-values near its rate count as well; what such
    a check asks for was not seen.
    """
    p_values = np.array([check.p_value for check in checks], dtype=float)
    marks = significant(p_values) & (p_values < SEEN)
    marked = [replace(check, significant=bool(mark)) for check, mark in zip(checks, marks, strict=True)]
    return tuple(sorted(marked, key=lambda check: check.p_value))


def something_left(checks: Sequence[Check]) -> bool:
    """Whether the worst of all checks of a model is too improbable by chance, among so many, for nothing to be left."""
    return min((check.p_value for check in checks), default=1.0) * len(checks) < LEFT_LEVEL

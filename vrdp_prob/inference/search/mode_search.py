"""What was done to find all modes of a posterior."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

AGREED = 1.0
"""Nats by which the two best fits differ at most that have found the same explanation."""


@dataclass(frozen=True)
class ModeSearch:
    """How far other modes than the best one were looked for.

    Parameters
    ----------
    done
        Whether alternatives were looked for at all.
    attempts
        Fits that were grown from scratch.
    agreed
        Whether there was no reason to doubt the best explanation, or two of the fits found it.
    all_orders
        Whether all orders of close contacts were tried that the tracks leave open.
    """

    done: bool
    attempts: int
    agreed: bool
    all_orders: bool = True

    @property
    def sentence(self) -> str:
        """What the search does not cover, in plain words; empty where there is nothing to add."""
        if not self.done:
            return "Other explanations of the motion were not looked for."
        if self.agreed and not self.all_orders:
            return (
                "Contacts follow one another so closely that not all orders in which they may have come were tried: "
                "there may be other explanations as good."
            )
        if not self.agreed and self.attempts == 1:
            return (
                "The contacts of this video are hard to explain, and it was searched once: there may be a better "
                "explanation, or others as good."
            )
        if not self.agreed:
            return (
                f"The contacts of this video are hard to explain: {self.attempts} searches did not agree on the most "
                "probable course of events; there may be a better explanation, or others as good."
            )
        return ""


def agree(costs: Sequence[float], expected: float) -> bool:
    """Whether the two best of some fits have found the same explanation, going by their costs (nats).

    Fits are grown at the noise of the tracks themselves. Where they leave more than that, the noise will be taken to be
    larger, and what is much apart at the small one is not at the other.

    Parameters
    ----------
    costs
        Costs of the fits.
    expected
        The cost that noise alone would make.
    """
    best, second = sorted([*costs, np.inf, np.inf])[:2]
    return second - best < AGREED * max(best / expected, 1.0)

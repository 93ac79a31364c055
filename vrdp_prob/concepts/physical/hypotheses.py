"""What a new word may mean: every change of a physical parameter that is considered, and its prior.

A word for a change takes a parameter of an object and multiplies it, or adds to it; or it changes nothing. Before any
answer every parameter is as probable as every other and as no change at all; the two ways to change one parameter share
its probability.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from vrdp_prob.reasoning.changes import PhysicalParameter, Rule, Shift


@dataclass(frozen=True)
class Hypothesis:
    """One parameter that a word may change, one way to change it, and how much is to be expected.

    Parameters
    ----------
    parameter, rule
        What is changed, and how.
    prior_sd
        Standard deviation of the normal prior of the amount, around no change: of the logarithm of a factor, of an
        offset in its unit.
    limit
        Largest amount that is considered, in the same scale; the prior ends there.
    points
        Number of amounts on an even grid from `-limit` to `limit`.
    """

    parameter: PhysicalParameter
    rule: Rule
    prior_sd: float
    limit: float
    points: int

    @property
    def name(self) -> str:
        """For example `mass factor`."""
        return f"{self.parameter} {self.rule}"

    @property
    def unit(self) -> str:
        """Unit of its amounts, empty for a pure number."""
        return "m/s" if (self.parameter, self.rule) == (PhysicalParameter.SPEED, Rule.OFFSET) else ""

    @cached_property
    def scale(self) -> Float[np.ndarray, "amount"]:
        """The grid: logarithms of factors, or offsets."""
        return np.linspace(-self.limit, self.limit, self.points)

    @cached_property
    def amounts(self) -> Float[np.ndarray, "amount"]:
        """Factors, or offsets."""
        return np.exp(self.scale) if self.rule is Rule.FACTOR else self.scale

    @property
    def range(self) -> tuple[float, float]:
        """Smallest and largest amount that is considered."""
        return float(self.amounts[0]), float(self.amounts[-1])

    @cached_property
    def prior(self) -> Float[np.ndarray, "amount"]:
        """Prior probability of the neighbourhood of every amount (trapezoidal rule), given that the word does this."""
        density = np.exp(-0.5 * (self.scale / self.prior_sd) ** 2)
        density[[0, -1]] /= 2
        return density / density.sum()

    def shifts(self) -> tuple[Shift, ...]:
        """The change of each amount."""
        return tuple(Shift(self.parameter, self.rule, float(amount)) for amount in self.amounts)


HYPOTHESES = (
    # a factor, not an offset: a video tells masses only relative to each other
    Hypothesis(PhysicalParameter.MASS, Rule.FACTOR, prior_sd=np.log(4), limit=np.log(16), points=33),
    # restitution lies between 0 and 1: beyond a factor of 4 every object is as dead or as bouncy as can be
    Hypothesis(PhysicalParameter.RESTITUTION, Rule.FACTOR, prior_sd=np.log(2), limit=np.log(4), points=9),
    Hypothesis(PhysicalParameter.RESTITUTION, Rule.OFFSET, prior_sd=0.3, limit=0.8, points=9),
    # a factor, not an offset: spheres roll and cubes slide with a hundredfold different friction
    Hypothesis(PhysicalParameter.FRICTION, Rule.FACTOR, prior_sd=np.log(4), limit=np.log(16), points=13),
    Hypothesis(PhysicalParameter.SPEED, Rule.FACTOR, prior_sd=np.log(2), limit=np.log(4), points=13),
    # objects on a table move at about 1 m/s
    Hypothesis(PhysicalParameter.SPEED, Rule.OFFSET, prior_sd=0.5, limit=1.2, points=13),
)
"""All changes of a parameter that are considered."""

MEANINGS: tuple[Shift | None, ...] = (None, *(shift for one in HYPOTHESES for shift in one.shifts()))
"""Everything that a word may mean, in the order of every axis of meanings: no change, then the amounts of each
hypothesis."""


def prior_of(hypothesis: Hypothesis | None) -> float:
    """Prior probability of a hypothesis; None stands for no change."""
    parameters = {one.parameter for one in HYPOTHESES}
    if hypothesis is None:
        return 1 / (len(parameters) + 1)
    ways = sum(one.parameter is hypothesis.parameter for one in HYPOTHESES)
    return 1 / (len(parameters) + 1) / ways


def meaning_prior() -> Float[np.ndarray, "meaning"]:
    """Prior probability of everything that a word may mean."""
    return np.concatenate([[prior_of(None)], *(prior_of(one) * one.prior for one in HYPOTHESES)])


def places_of(hypothesis: Hypothesis) -> slice:
    """Where the amounts of a hypothesis are among all meanings."""
    before = 1 + sum(one.points for one in HYPOTHESES[: HYPOTHESES.index(hypothesis)])
    return slice(before, before + hypothesis.points)

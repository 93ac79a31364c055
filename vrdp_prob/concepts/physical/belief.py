"""What is believed of one change that a word may mean: how probable it is, and by how much."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.integrate import cumulative_trapezoid

from vrdp_prob.reasoning.changes import Meaning, PhysicalParameter, Rule, Shift

FINENESS = 40
"""Places between two amounts of the grid at which the density of the amount is interpolated."""

SMALLEST_DENSITY = 1e-300


@dataclass(frozen=True)
class Belief:
    """One hypothesis after the examples.

    Parameters
    ----------
    parameter, rule
        What the word changes, and how; None where it changes nothing.
    probability, mc_error
        Its posterior probability, and the Monte Carlo standard error of that.
    log_evidence
        Logarithm of the probability of the answers under it over that of guessing (nats).
    amounts, weights
        Factors or offsets in ascending order, on an even grid of their logarithm or themselves, and their posterior
        probabilities if the hypothesis holds; empty where it changes nothing.
    """

    parameter: PhysicalParameter | None
    rule: Rule | None
    probability: float
    mc_error: float
    log_evidence: float
    amounts: tuple[float, ...] = ()
    weights: tuple[float, ...] = ()

    @property
    def subject(self) -> str:
        """What the word changes: a parameter, or `nothing`."""
        return "nothing" if self.parameter is None else str(self.parameter)

    @property
    def name(self) -> str:
        """For example `mass factor`; `nothing` where it changes nothing."""
        return self.subject if self.rule is None else f"{self.subject} {self.rule}"

    @property
    def unit(self) -> str:
        """Unit of the amounts, empty for a pure number."""
        return "m/s" if (self.parameter, self.rule) == (PhysicalParameter.SPEED, Rule.OFFSET) else ""

    def quantile(self, level: float) -> float:
        """Quantile of the amount if the hypothesis holds, with the density interpolated between the grid's amounts."""
        amounts = np.array(self.amounts)
        grid = np.log(amounts) if self.rule is Rule.FACTOR else amounts
        place = _quantile(grid, np.array(self.weights), level)
        return float(np.exp(place)) if self.rule is Rule.FACTOR else place

    def interval(self, level: float = 0.9) -> tuple[float, float]:
        """Central interval of the amount if the hypothesis holds."""
        return self.quantile((1 - level) / 2), self.quantile((1 + level) / 2)

    def meanings(self) -> tuple[Meaning, ...]:
        """What the word may mean, with the probability of each amount."""
        if self.parameter is None or self.rule is None:
            return (Meaning(self.probability, None),)
        return tuple(
            Meaning(self.probability * weight, Shift(self.parameter, self.rule, amount))
            for amount, weight in zip(self.amounts, self.weights, strict=True)
        )


def _quantile(grid: Float[np.ndarray, "amount"], weights: Float[np.ndarray, "amount"], level: float) -> float:
    density = weights.copy()
    density[[0, -1]] *= 2
    fine = np.linspace(grid[0], grid[-1], (len(grid) - 1) * FINENESS + 1)
    interpolated = np.exp(np.interp(fine, grid, np.log(np.maximum(density, SMALLEST_DENSITY))))
    below = cumulative_trapezoid(interpolated, fine, initial=0)
    return float(np.interp(level * below[-1], below, fine))

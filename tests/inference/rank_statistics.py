"""Whether ranks are uniform: bands that their whole distribution stays within, and a test with a known error rate.

Source: Saeilynoja, Buerkner and Vehtari, Graphical test for discrete uniformity and its applications in
goodness-of-fit evaluation and multiple sample comparison, Statistics and Computing 32 (2022), with their adjustment of
the pointwise levels by simulation.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.stats import binom

SIMULATIONS = 10_000


@dataclass(frozen=True)
class Band:
    """Limits of the share of ranks at or below each threshold.

    Parameters
    ----------
    share
        Share that uniform ranks have in the mean.
    lower, upper
        Limits that the shares of uniform ranks keep to at all thresholds at once, with the band's probability.
    """

    share: np.ndarray
    lower: np.ndarray
    upper: np.ndarray

    def holds(self, ranks: np.ndarray) -> bool:
        """Whether ranks stay within the band."""
        found = shares(ranks, len(self.share))
        return bool(((found >= self.lower - 1e-12) & (found <= self.upper + 1e-12)).all())


def shares(ranks: np.ndarray, levels: int) -> np.ndarray:
    """Share of the ranks (0 to `levels`) at or below each of 0 to `levels` - 1."""
    counts = np.bincount(np.asarray(ranks, dtype=int), minlength=levels + 1)
    return np.cumsum(counts)[:levels] / max(len(ranks), 1)


def simultaneous_band(count: int, levels: int, probability: float = 0.95) -> Band:
    """The band for so many independent ranks."""
    share = np.arange(1, levels + 1) / (levels + 1)
    level = float(np.quantile(_extremes(count, levels), 1 - probability, method="lower"))
    lower = binom.ppf(level / 2, count, share) / count
    upper = binom.ppf(1 - level / 2, count, share) / count
    return Band(share, lower, upper)


def uniformity(ranks: np.ndarray, levels: int) -> float:
    """Probability that so many independent uniform ranks deviate as much somewhere; uniform itself, or larger."""
    found = _tails(np.round(shares(ranks, levels) * len(ranks)).astype(int)[None], len(ranks), levels).min()
    return float((np.count_nonzero(_extremes(len(ranks), levels) <= found + 1e-12) + 1) / (SIMULATIONS + 1))


@lru_cache
def _extremes(count: int, levels: int) -> np.ndarray:
    """Smallest pointwise tail probability of each of many simulated sets of uniform ranks."""
    generator = np.random.default_rng([count, levels])
    counts = generator.multinomial(count, np.full(levels + 1, 1 / (levels + 1)), size=SIMULATIONS)
    return _tails(np.cumsum(counts, axis=1)[:, :levels], count, levels).min(axis=1)


def _tails(below: np.ndarray, count: int, levels: int) -> np.ndarray:
    """Two-sided binomial tail probability of the number of ranks at or below each threshold."""
    share = np.arange(1, levels + 1) / (levels + 1)
    numbers = np.arange(count + 1)[:, None]
    tails = 2 * np.minimum(binom.cdf(numbers, count, share), binom.sf(numbers - 1, count, share))
    return np.minimum(tails, 1.0)[below, np.arange(levels)]

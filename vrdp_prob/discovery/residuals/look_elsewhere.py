"""The look-elsewhere effect: the largest statistic of a scan is large by chance, the more places it looks at."""

import numpy as np
from jaxtyping import Float
from scipy.stats import chi2

TAIL = 0.05
"""Tail probability at which the number of independent places of a scan is read off its null distribution."""


def independent_places(largest: Float[np.ndarray, "replica"], degrees: int, places: int) -> float:
    """Number of independent places that makes the largest chi-square of a scan as large as it is by chance.

    What replications tell of low levels is carried to those beyond their reach, where the tail is that of the single
    statistic, as in E. Gross and O. Vitells, Trial factors for the look elsewhere effect in high energy physics, Eur.
    Phys. J. C 70 (2010); they count upcrossings.

    Parameters
    ----------
    largest
        Largest chi-square of each replication.
    degrees
        Degrees of freedom of each.
    places
        Number of places looked at, which is an upper bound.
    """
    alone = float(chi2.sf(np.quantile(largest, 1 - TAIL), degrees))
    return float(np.clip(TAIL / max(alone, 1e-300), 1.0, max(places, 1)))


def anywhere(p_value: float, places: float) -> float:
    """Probability of so small a p-value at the best of so many independent places."""
    return 1.0 if p_value >= 1 else float(-np.expm1(places * np.log1p(-p_value)))

"""Probabilities by chance from replications: what a statistic is where the model is right.

A few hundred replications tell probabilities down to a percent. Beyond that the tail is that of a law whose form the
statistic suggests and whose numbers the replications give, so that a strong effect has a small probability and not
one over the number of replications.
"""

import numpy as np
from jaxtyping import Float
from scipy.stats import chi2, norm

REPLICATIONS = 300
TAIL = 0.05
"""Tail probability at which the number of independent places of a scan is read off its null distribution."""


def independent_places(largest: Float[np.ndarray, "replica"], degrees: int, places: int) -> float:
    """Number of independent places that makes the largest chi-square of a scan as large as it is by chance.

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
    return float(-np.expm1(places * np.log1p(-min(p_value, 1 - 1e-16))))


def sum_p_value(value: float, replicas: Float[np.ndarray, "replica"]) -> float:
    """Probability of so large a sum of squares, whose replications have the mean and variance of a scaled chi-square.

    Source: F. E. Satterthwaite, An approximate distribution of estimates of variance components, Biometrics Bulletin 2
    (1946).
    """
    mean, variance = float(replicas.mean()), float(replicas.var())
    if mean <= 0 or variance <= 0:
        return 1.0
    scale = variance / (2 * mean)
    return float(chi2.sf(value / scale, mean / scale))


def two_sided_p_value(value: float, replicas: Float[np.ndarray, "replica"]) -> float:
    """Probability of so unusual a number, whose replications have a normal distribution."""
    sd = float(replicas.std())
    return float(2 * norm.sf(abs(value - float(replicas.mean())) / sd)) if sd > 0 else 1.0

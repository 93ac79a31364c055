"""Probabilities by chance from replications: what a statistic is where the model is right.

A few hundred replications tell probabilities down to a percent. Beyond that the tail is that of a law whose form the
statistic suggests and whose numbers the replications give, so that a strong effect has a small probability and not
one over the number of replications.
"""

import numpy as np
from jaxtyping import Float
from scipy.stats import chi2, norm

REPLICATIONS = 300


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

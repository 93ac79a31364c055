"""How large something random is, learned from the few examples that a video holds, and from other videos."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.special import logsumexp
from scipy.stats import norm

SCALES = np.geomspace(0.002, 2.0, 80)
"""Scales that are thought of."""
SPREADS = np.linspace(0.15, 1.5, 10)
"""Standard deviations of the logarithm of a scale among videos that are thought of."""

Examples = Sequence[tuple[float, float]]
"""Deviations from zero as they were measured, each with the variance of its measurement."""


@dataclass(frozen=True)
class ScalePrior:
    """What is believed of a scale before a video is looked at: a log-normal.

    Parameters
    ----------
    median
        Its median.
    log_sd
        Standard deviation of its logarithm.
    """

    median: float
    log_sd: float

    @classmethod
    def learned(cls, videos: Sequence[Examples]) -> "ScalePrior":
        """The log-normal under which the examples of several videos are most probable (empirical Bayes)."""
        each = np.array([_log_likelihood(examples) for examples in videos])
        medians, spreads = np.meshgrid(SCALES, SPREADS, indexing="ij")
        priors = [cls(float(m), float(s)) for m, s in zip(medians.ravel(), spreads.ravel(), strict=True)]
        evidence = [float(logsumexp(each + prior.log_density, axis=1).sum()) for prior in priors]
        return priors[int(np.argmax(evidence))]

    @property
    def log_density(self) -> Float[np.ndarray, "scale"]:
        """Logarithm of the probability of each of `SCALES`."""
        logarithm = -0.5 * ((np.log(SCALES) - np.log(self.median)) / self.log_sd) ** 2
        return np.asarray(logarithm - logsumexp(logarithm))

    def given(self, examples: Examples) -> Float[np.ndarray, "scale"]:
        """Probability of each of `SCALES` once the examples of a video were seen."""
        logarithm = self.log_density + _log_likelihood(examples)
        return np.asarray(np.exp(logarithm - logsumexp(logarithm)))

    def quantiles(self, examples: Examples, level: Float[np.ndarray, "draw"]) -> Float[np.ndarray, "draw"]:
        """Quantiles of the scale once examples were seen; uniform random levels give draws."""
        density = self.given(examples)
        middle = np.cumsum(density) - 0.5 * density
        return np.asarray(np.exp(np.interp(level, middle, np.log(SCALES))))


def _log_likelihood(examples: Examples) -> Float[np.ndarray, "scale"]:
    """Log density of the examples at each of `SCALES`."""
    result = np.zeros(len(SCALES))
    for value, variance in examples:
        result = result + norm.logpdf(value, scale=np.sqrt(SCALES**2 + variance))
    return result

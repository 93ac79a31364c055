"""Whether the model explains the tracks: chi-square against the measured noise, and residuals that remember."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from vrdp_prob.scene import Tracks

LARGEST_RATIO = 1.5
"""Residuals this much larger than the measurement noise are called a misfit."""
LARGEST_CORRELATION = 0.3
"""Correlation of neighbouring residuals from which on they are called a misfit."""
LONGEST_MEMORY = 40.0
"""Upper limit of the number of frames that count as one observation."""


@dataclass(frozen=True)
class Misfit:
    """How the residuals of the best fit compare with pure measurement noise.

    Parameters
    ----------
    residual_sd
        Standard deviation (m) of the residuals per axis.
    noise_sd
        Standard deviation (m) of the measurement noise: the stated one where there is one, at least that of the
        tracks' roughness.
    noise_stated
        Whether whoever measured the tracks stated their noise. Such noise may be alike in neighbouring frames.
    correlation
        Correlation of the residuals of neighbouring frames.
    memory
        Number of frames that together count as one independent observation.
    worst
        Id of the body with the largest residuals, and `worst_sd` their standard deviation in m.
    """

    residual_sd: float
    noise_sd: float
    noise_stated: bool
    correlation: float
    memory: float
    worst: str
    worst_sd: float

    @property
    def fits(self) -> bool:
        """Whether nothing speaks against the model."""
        small = self.residual_sd <= LARGEST_RATIO * self.noise_sd
        return small and (self.noise_stated or self.independent)

    @property
    def independent(self) -> bool:
        """Whether every frame can count as an observation of its own."""
        return self.correlation < LARGEST_CORRELATION

    @property
    def sentence(self) -> str:
        """What is wrong, in plain words; empty where the model fits."""
        if self.fits:
            return ""
        return (
            f"The model does not explain this motion: after the best fit positions are still off by "
            f"{self.residual_sd:.3g} m where measurement noise is {self.noise_sd:.3g} m (most for object {self.worst}, "
            f"{self.worst_sd:.3g} m), and errors persist over about {self.memory:.0f} frames; the intervals were "
            "widened accordingly, but masses, restitutions and predictions may still be biased."
        )


def judge(tracks: Tracks, predicted: Float[np.ndarray, "time body 2"], noise: float) -> Misfit:
    """Compare predicted positions with the seen ones."""
    residuals = tracks.positions - predicted
    with np.errstate(all="ignore"):
        per_body = np.sqrt(np.nanmean(residuals**2, axis=(0, 2)))
    worst = int(np.nanargmax(per_body))
    overall = float(np.sqrt(np.nanmean(residuals**2)))
    correlations = autocorrelation(residuals)
    memory = float(np.clip(1 + 2 * _first_positive_sum(correlations[1:]), 1, LONGEST_MEMORY))
    first = float(correlations[1]) if len(correlations) > 1 else 0.0
    covariance = tracks.position_covariance
    stated = 0.0 if covariance is None else float(np.sqrt(np.nanmedian(covariance[..., [0, 1], [0, 1]])))
    noise = max(noise, stated)
    return Misfit(
        overall, noise, covariance is not None, first, memory, tracks.bodies[worst].id, float(per_body[worst])
    )


def autocorrelation(residuals: Float[np.ndarray, "time body 2"]) -> Float[np.ndarray, "lag"]:
    """Autocorrelation over frames, about zero (a constant offset is an error too), missing frames left out."""
    count = len(residuals)
    lags = min(count - 1, 60)
    variance = np.nanmean(residuals**2)
    values = np.ones(lags + 1)
    for lag in range(1, lags + 1):
        products = residuals[lag:] * residuals[:-lag]
        known = np.isfinite(products)
        values[lag] = products[known].sum() / max(int(known.sum()), 1) / variance if variance > 0 else 0.0
    return values


def _first_positive_sum(correlations: Float[np.ndarray, "lag"]) -> float:
    """Sum up to the first value lost in noise."""
    lost = np.flatnonzero(correlations < 0.05)
    return float(correlations[: lost[0] if len(lost) else None].sum())

"""Whether the model explains the tracks: chi-square against the measured noise, and residuals that remember."""

from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Float

from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.model_error import ModelError

LARGEST_RATIO = 1.5
"""Residuals this much larger than the measurement noise are called a misfit."""


@dataclass(frozen=True)
class Misfit:
    """How the residuals of the best fit compare with pure measurement noise.

    Parameters
    ----------
    residual_sd
        Standard deviation (m) of the residuals per axis, outliers discounted.
    noise_sd
        Standard deviation (m) of the measurement noise: the stated one where there is one, at least that of the
        tracks' roughness.
    noise_stated
        Whether whoever measured the tracks stated their noise. Such noise may be alike in neighbouring frames.
    correlation
        Correlation of the residuals of neighbouring frames.
    worst
        Id of the body with the largest residuals, and `worst_sd` their standard deviation in m.
    outliers
        Number of positions that lie far off those before and after.
    error_acceleration, error_duration
        Size (m/s^2) and duration (s) of the unknown acceleration that the intervals allow for; None where none is
        needed.
    """

    residual_sd: float
    noise_sd: float
    noise_stated: bool
    correlation: float
    worst: str
    worst_sd: float
    outliers: int = 0
    error_acceleration: float | None = None
    error_duration: float | None = None

    @property
    def ratio(self) -> float:
        """Residuals in units of the noise; about 1 where the model fits."""
        return self.residual_sd / self.noise_sd

    @property
    def chi_square(self) -> float:
        """Mean squared residual in units of the squared noise; about 1 where the model fits."""
        return self.ratio**2

    @property
    def large(self) -> bool:
        """Whether the residuals are much larger than noise."""
        return self.residual_sd > LARGEST_RATIO * self.noise_sd

    @property
    def fits(self) -> bool:
        """Whether nothing speaks against the model."""
        return not self.large and (self.noise_stated or self.error_acceleration is None)

    @property
    def sentences(self) -> tuple[str, ...]:
        """What is wrong, in plain words."""
        found: tuple[str, ...] = () if self.fits else (self._misfit_sentence(),)
        if self.outliers:
            positions = "1 position lies" if self.outliers == 1 else f"{self.outliers} positions lie"
            found += (
                f"{positions} far off those before and after; the noise is taken as Student-t, which discounts them.",
            )
        return found

    def with_error(self, error: ModelError, reference: float) -> "Misfit":
        """The same with a model error, where noise scale 1 stands for a reference (m)."""
        acceleration = error.acceleration * error.noise_scale * reference
        return replace(self, error_acceleration=acceleration, error_duration=error.duration)

    def _misfit_sentence(self) -> str:
        if self.large:
            text = (
                "The model does not explain this motion: after the best fit positions are off by "
                f"{self.residual_sd:.2g} m where measurement noise is {self.noise_sd:.2g} m (most for object "
                f"{self.worst}, {self.worst_sd:.2g} m), and neighbouring errors are alike (correlation "
                f"{self.correlation:.2f})."
            )
        else:
            text = (
                "The model does not quite explain this motion: after the best fit positions are off by no more than "
                f"measurement noise ({self.residual_sd:.2g} m), but smoothly, as noise would not be (correlation of "
                f"neighbouring errors {self.correlation:.2f}; most for object {self.worst})."
            )
        if self.error_acceleration is not None:
            text += (
                f" The intervals allow for an unknown acceleration of {self.error_acceleration:.2g} m/s^2 that lasts "
                f"about {self.error_duration:.2g} s; masses, restitutions and predictions may still be biased."
            )
        return text


def judge(likelihood: Likelihood, point: Float[np.ndarray, "dimension"], noise: float, outliers: int) -> Misfit:
    """Compare what a fit predicts with what was seen.

    Parameters
    ----------
    likelihood
        The density that was fitted.
    point
        The fit.
    noise
        Measurement noise (m) from the tracks' roughness.
    outliers
        Number of gross outliers in the tracks.
    """
    tracks, observations = likelihood.tracks, likelihood.observations
    residuals = tracks.positions - likelihood.predicted(torch.from_numpy(point[None]))[0, :, :, :2]
    shares = np.full(tracks.seen.shape, np.nan)
    shares[observations.frame, observations.body] = likelihood.information_shares(torch.from_numpy(point[None]))[0][0]
    weights = shares[..., None] * np.ones(2)
    squares = np.where(np.isnan(weights), 0.0, weights * np.nan_to_num(residuals) ** 2)
    counted = np.nansum(weights, axis=(0, 2))
    per_body = np.sqrt(squares.sum(axis=(0, 2)) / counted)
    worst = int(np.argmax(per_body))
    stated = 0.0 if tracks.position_covariance is None else observations.position_reference
    return Misfit(
        residual_sd=float(np.sqrt(squares.sum() / counted.sum())),
        noise_sd=max(noise, stated),
        noise_stated=tracks.position_covariance is not None,
        correlation=_neighbour_correlation(np.sqrt(weights) * residuals),
        worst=tracks.bodies[worst].id,
        worst_sd=float(per_body[worst]),
        outliers=outliers,
    )


def _neighbour_correlation(residuals: Float[np.ndarray, "time body 2"]) -> float:
    """Correlation of neighbouring frames, about zero (a constant offset is an error too), missing frames left out."""
    products = residuals[1:] * residuals[:-1]
    known = np.isfinite(products)
    variance = np.nanmean(residuals**2)
    return float(products[known].mean() / variance) if known.any() and variance > 0 else 0.0

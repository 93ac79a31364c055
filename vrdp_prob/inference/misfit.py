"""Whether the model explains the tracks: chi-square against the measured noise, and residuals that remember."""

from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Float
from scipy.ndimage import median_filter

from vrdp_prob.inference.clues import Clues
from vrdp_prob.inference.outliers import FARTHEST
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.model_error import ModelError
from vrdp_prob.models.noise import NoiseFamily

TINY = 1e-300
NEIGHBOURS = 5
"""Residuals in a row whose median says what is usual there."""
LARGEST_RATIO = 1.5
"""Residuals this much larger than the measurement noise are called a misfit."""
LIKE_NOISE = 1.05
"""Residuals in units of the noise up to which they are said to be no larger."""


@dataclass(frozen=True)
class Misfit:
    """How the residuals of the best fit compare with pure measurement noise.

    Parameters
    ----------
    residual_sd
        Standard deviation (m) of the residuals per axis. Under Student-t noise gross outliers are left out, and others
        count for as much as the largest error that is none.
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
    outliers_count
        Whether they count in full, since the noise is not Student-t.
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
    outliers_count: bool = False
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
        """Whether nothing speaks against the model.

        Errors within the stated noise that are alike in neighbouring frames are what a camera makes; an unknown
        acceleration that they look like widens the intervals, and speaks against nothing.
        """
        within_stated_noise = self.noise_stated and self.ratio <= LIKE_NOISE
        return not self.large and (self.error_acceleration is None or within_stated_noise)

    @property
    def sentences(self) -> tuple[str, ...]:
        """What is wrong, in plain words."""
        found: tuple[str, ...] = () if self.fits else (self._misfit_sentence(),)
        if self.outliers:
            positions = "1 position lies" if self.outliers == 1 else f"{self.outliers} positions lie"
            if self.outliers_count:
                taken = "Gaussian, as was asked for, so that they count in full"
            elif self.error_acceleration is not None:
                taken = "Gaussian and larger there, which discounts them"
            else:
                taken = "Student-t, which discounts them"
            found += (f"{positions} far off those before and after; the noise is taken as {taken}.",)
        elif self.error_acceleration is not None and not self.outliers_count:
            found += (
                "Beside an unknown acceleration the noise is taken as Gaussian, not Student-t as was asked for; only "
                "what lies far off its neighbours is discounted.",
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
            smooth = f"correlation of neighbouring errors {self.correlation:.2f}; most for object {self.worst}"
            if self.ratio > LIKE_NOISE:
                off = f"{self.residual_sd:.2g} m, {self.ratio:.2f} times the measurement noise, and smoothly"
            else:
                off = f"no more than measurement noise ({self.residual_sd:.2g} m), but smoothly"
            if self.noise_stated:
                text = (
                    f"After the best fit positions are off by {off} ({smooth}): either errors of measurement are alike "
                    "in neighbouring frames, or the model does not quite explain this motion."
                )
            else:
                text = (
                    f"The model does not quite explain this motion: after the best fit positions are off by {off}, as "
                    f"noise would not be ({smooth})."
                )
        if self.error_acceleration is not None:
            text += (
                f" The intervals allow for an unknown acceleration of {self.error_acceleration:.2g} m/s^2 that lasts "
                f"about {self.error_duration:.2g} s; masses, restitutions and predictions may still be biased."
            )
        return text


def judge(likelihood: Likelihood, point: Float[np.ndarray, "dimension"], clues: Clues) -> Misfit:
    """Compare what a fit predicts with what was seen.

    Parameters
    ----------
    likelihood
        The density that was fitted.
    point
        The fit.
    clues
        Noise and outliers that the tracks show by themselves.
    """
    tracks = likelihood.tracks
    residuals = tracks.positions - likelihood.fitted(torch.from_numpy(point[None]))[0, :, :, :2]
    robust = likelihood.noise is NoiseFamily.STUDENT_T
    if robust:
        residuals = tempered(residuals, clues)
    squares = np.nanmean(residuals**2, axis=(0, 2))
    worst = int(np.argmax(squares))
    stated = 0.0 if tracks.position_covariance is None else likelihood.observations.position_reference
    return Misfit(
        residual_sd=float(np.sqrt(np.nanmean(residuals**2))),
        noise_sd=max(clues.noise, stated),
        noise_stated=tracks.position_covariance is not None,
        correlation=_neighbour_correlation(residuals),
        worst=tracks.bodies[worst].id,
        worst_sd=float(np.sqrt(squares[worst])),
        outliers=int(clues.outliers.sum()),
        outliers_count=not robust,
    )


def tempered(residuals: Float[np.ndarray, "time body 2"], clues: Clues) -> Float[np.ndarray, "time body 2"]:
    """Residuals as a measure of what a model leaves unexplained, in spite of outliers.

    Gross outliers of the tracks are left out, and what lies farther off the residuals around it than noise does is
    drawn to the farthest that noise reaches. What is off as its neighbours are off stays: heavy tails would take that
    for outliers.

    Parameters
    ----------
    residuals
        Differences (m) of what was seen from what a fit predicts; NaN where nothing was seen.
    clues
        Noise and outliers that the tracks show by themselves.
    """
    result = np.where(clues.outliers[..., None], np.nan, residuals)
    for body in range(residuals.shape[1]):
        seen = np.flatnonzero(np.isfinite(result[:, body, 0]))
        around = median_filter(result[seen, body], size=(NEIGHBOURS, 1), mode="mirror")
        off = result[seen, body] - around
        reach = FARTHEST * clues.position_sd[seen, body] / np.maximum(np.linalg.norm(off, axis=-1), TINY)
        result[seen, body] = np.where(reach[:, None] < 1.0, around + reach[:, None] * off, result[seen, body])
    return result


def _neighbour_correlation(residuals: Float[np.ndarray, "time body 2"]) -> float:
    """Correlation of neighbouring frames, about zero (a constant offset is an error too), missing frames left out."""
    products = residuals[1:] * residuals[:-1]
    known = np.isfinite(products)
    variance = np.nanmean(residuals**2)
    return float(products[known].mean() / variance) if known.any() and variance > 0 else 0.0

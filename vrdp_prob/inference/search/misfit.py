"""Whether the model explains the tracks: chi-square against the measured noise, and residuals that remember."""

from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Bool, Float
from scipy.ndimage import median_filter

from vrdp_prob.inference.search.clues import Clues
from vrdp_prob.inference.search.outliers import FARTHEST, FEWEST_LEFT
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
SUSPICIOUS = 5.5
"""Standard deviations off the residuals around it from which a position is an outlier where all else is explained; by
chance one in a hundred thousand is."""
HARDLY_MORE = 1.15
"""Residuals in units of the noise up to which chance may have made them so large in a short video."""
ALIKE = 0.2
"""Correlation from which on neighbouring errors are said to be alike."""


@dataclass(frozen=True)
class Misfit:
    """How the residuals of the best fit compare with pure measurement noise.

    Parameters
    ----------
    residual_sd
        Standard deviation (m) of the residuals per axis. Where the noise of each position is stated, residuals count in
        units of it, and are told as those of a position of middle noise. Under Student-t noise gross outliers are left
        out, and others count for as much as the largest error that is none.
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
        Number of positions that lie far off those before and after, or off what the fit leaves of these.
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
            found += (f"{positions} far off the motion around them; the noise is taken as {taken}.",)
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
                f"{self.worst}, {self.worst_sd:.2g} m), and neighbouring errors are "
                f"{'alike' if self.correlation > ALIKE else 'not alike'} (correlation {self.correlation:.2f})."
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
    residuals = residuals_of(likelihood, point)
    robust = likelihood.noise is NoiseFamily.STUDENT_T
    if robust:
        residuals = tempered(residuals, clues)
    stated = 0.0 if tracks.position_covariance is None else likelihood.observations.position_reference
    noise = max(clues.noise, stated)
    residuals = residuals * (noise / clues.position_sd[..., None])
    squares = np.nanmean(residuals**2, axis=(0, 2))
    worst = int(np.argmax(squares))
    return Misfit(
        residual_sd=float(np.sqrt(np.nanmean(residuals**2))),
        noise_sd=noise,
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
    around, reach = _around(result, clues)
    return np.where(reach[..., None] < 1.0, around + reach[..., None] * (result - around), result)


def isolated(
    residuals: Float[np.ndarray, "time body 2"], clues: Clues, farthest: float = FARTHEST
) -> Bool[np.ndarray, "time body"]:
    """Positions that lie farther off the residuals around them than noise does, and are no outliers of the tracks.

    Parameters
    ----------
    residuals, clues
        As those of `tempered`.
    farthest
        How far noise reaches, in standard deviations.
    """
    reach = _around(np.where(clues.outliers[..., None], np.nan, residuals), clues)[1]
    return np.asarray(reach < FARTHEST / farthest)


def shows_outliers(clues: Clues, likelihood: Likelihood, point: Float[np.ndarray, "dimension"]) -> bool:
    """Whether what a fit leaves may be outliers that the tracks do not show by themselves, and that drew it along."""
    return bool(isolated(residuals_of(likelihood, point), clues, SUSPICIOUS).any())


def with_outliers(clues: Clues, likelihood: Likelihood, point: Float[np.ndarray, "dimension"]) -> Clues:
    """The clues with the outliers that only a fit shows, where nothing but these is left unexplained.

    Neighbours predict a position with errors of their own, a fit with hardly any.

    Parameters
    ----------
    clues
        Noise and outliers that the tracks show by themselves.
    likelihood
        A density that discounts outliers.
    point
        Its fit.
    """
    residuals = residuals_of(likelihood, point)
    found = isolated(residuals, clues, SUSPICIOUS)
    if not found.any():
        return clues
    rest = np.where((clues.outliers | found)[..., None], np.nan, residuals) / clues.position_sd[..., None]
    explained = np.nanmean(rest**2) <= HARDLY_MORE**2 and _neighbour_correlation(rest) <= ALIKE
    explained &= bool((np.isfinite(rest[..., 0]).sum(axis=0) >= FEWEST_LEFT).all())
    return replace(clues, outliers=clues.outliers | found) if explained else clues


def residuals_of(likelihood: Likelihood, point: Float[np.ndarray, "dimension"]) -> Float[np.ndarray, "time body 2"]:
    """What was seen less what a fit predicts (m); NaN where nothing was seen."""
    fitted = likelihood.fitted(torch.from_numpy(point[None]))[0, :, :, :2]
    return np.asarray(likelihood.tracks.positions - fitted)


def _around(
    residuals: Float[np.ndarray, "time body 2"], clues: Clues
) -> tuple[Float[np.ndarray, "time body 2"], Float[np.ndarray, "time body"]]:
    """What is usual around each residual (m), and how far noise reaches from there as a share of what is off."""
    around, reach = np.full(residuals.shape, np.nan), np.full(residuals.shape[:2], np.inf)
    for body in range(residuals.shape[1]):
        seen = np.flatnonzero(np.isfinite(residuals[:, body, 0]))
        around[seen, body] = median_filter(residuals[seen, body], size=(NEIGHBOURS, 1), mode="mirror")
        off = np.linalg.norm(residuals[seen, body] - around[seen, body], axis=-1)
        reach[seen, body] = FARTHEST * clues.position_sd[seen, body] / np.maximum(off, TINY)
    return around, reach


def _neighbour_correlation(residuals: Float[np.ndarray, "time body 2"]) -> float:
    """Correlation of neighbouring frames, about zero (a constant offset is an error too), missing frames left out."""
    products = residuals[1:] * residuals[:-1]
    known = np.isfinite(products)
    variance = np.nanmean(residuals**2)
    return float(products[known].mean() / variance) if known.any() and variance > 0 else 0.0

"""What positions say of their own noise before anything is fitted, and what is taken where they do not."""

import numpy as np
from jaxtyping import Bool, Float

from vrdp_prob.models.observation import SMALLEST_SHARE, prior_noise, stated_reference
from vrdp_prob.scene import Tracks
from vrdp_prob.scene.third_differences import FEWEST, NORMAL_MAD, WINDOW, third_difference

SHARPEST = 1e-3
"""Noise, as a share of what is expected beforehand, that tracks are taken to have at least: computed positions have
none, and no simulation agrees with them to their last digit."""
MOST_DECIMALS = 6
"""Digits after the point (m) up to which positions are recognised as rounded."""


def noise_scale(tracks: Tracks) -> float:
    """Standard deviation (m) of the positions, from third differences of neighbouring frames (kinks are outvoted).

    Differences are divided ones, to which motion at a constant acceleration adds nothing, however far apart the frames
    are. Where standard deviations are stated it is that of a position which is stated like the one in the middle. A
    coordinate that an object keeps to the last digit was not measured, and tells nothing; nan where all are so, or
    frames are too few.
    """
    positions = tracks.positions
    count = len(positions) - WINDOW + 1
    if count < 1:
        return float("nan")
    sd, reference = _stated_sd(tracks) or (np.ones(tracks.seen.shape), 1.0)
    windows = np.arange(count)[:, None] + np.arange(WINDOW)
    weights = third_difference(tracks.times[windows])
    spread = np.sqrt(np.einsum("wf,wfb->wb", weights**2, sd[windows] ** 2))
    differences = np.einsum("wf,wfba->wba", weights, positions[windows]) / spread[..., None]
    told = differences[:, ~_kept(positions)]
    values = told[np.isfinite(told)]
    if len(values) < FEWEST:
        return float("nan")
    return float(reference * np.median(np.abs(values)) / NORMAL_MAD)


def untold_noise(tracks: Tracks) -> float | None:
    """The noise (m) that tracks are taken to have where they do not tell it; None where they do.

    They do not where positions are computed, or rounded to more than they scatter, and where all objects keep one
    coordinate to the last digit: then half of the residuals are 0 whatever the noise.
    """
    noise = noise_scale(tracks)
    if tracks.position_covariance is not None or not np.isfinite(noise):
        return None
    least = max(SHARPEST * prior_noise(tracks), _rounding(tracks.positions))
    if noise < least:
        return least
    kept = _kept(tracks.positions)
    moving = ~kept.all(axis=1)
    return noise if moving.any() and kept[moving].any(axis=1).all() else None


def position_sd(tracks: Tracks, noise: float) -> Float[np.ndarray, "time body"]:
    """Standard deviation (m) per axis: the stated ones, all larger where the tracks are rougher.

    Errors that last look like motion, and make no roughness.

    Parameters
    ----------
    tracks
        The tracks.
    noise
        The noise (m) that they are taken to have.
    """
    if (stated := _stated_sd(tracks)) is None:
        return np.full(tracks.seen.shape, noise)
    sd, reference = stated
    return sd * max(noise / reference, 1.0)


def _stated_sd(tracks: Tracks) -> tuple[Float[np.ndarray, "time body"], float] | None:
    """Standard deviations (m) of positions as they are stated, and that of the one in the middle; None where none is.

    A position without a statement is like the one in the middle; none is believed to be far more exact than that.
    """
    variance, reference = tracks.position_variance, stated_reference(tracks)
    if variance is None or reference is None:
        return None
    return np.maximum(np.sqrt(np.nan_to_num(variance, nan=reference**2)), SMALLEST_SHARE * reference), reference


def _kept(positions: Float[np.ndarray, "time body 2"]) -> Bool[np.ndarray, "body 2"]:
    """Coordinates that an object keeps to the last digit."""
    return np.asarray(np.nanmax(positions, axis=0) == np.nanmin(positions, axis=0))


def _rounding(positions: Float[np.ndarray, "time body 2"]) -> float:
    """Standard deviation (m) of what was rounded off; 0 where positions were not rounded."""
    values = positions[np.isfinite(positions)]
    for decimals in range(MOST_DECIMALS + 1):
        if np.abs(values - values.round(decimals)).max() < 1e-3 * 10.0**-decimals:
            return float(10.0**-decimals / np.sqrt(12))
    return 0.0

"""The acceleration that a model misses, window by window along the paths, whatever it depends on.

In every window of half a second one body has an unknown further acceleration. All windows have one normal prior whose
size the data tell (empirical Bayes); in videos that the model explains it shrinks to nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from vrdp_prob.discovery.residuals.fitted_motion import FittedMotion
from vrdp_prob.discovery.residuals.residual_model import ABSORBED, ResidualModel
from vrdp_prob.inference.search.clues import Clues

LENGTH = 0.5
"""Longest window in s."""
FEWEST = 3
"""Frames that a window has at least."""
SIZES = np.concatenate([[0.0], np.geomspace(1e-5, 1e4, 91)])
"""Sizes (m/s^2) of the missing acceleration among which the most probable one is chosen."""
FAR, EXTREME = 10.0, 3.0
"""A video is lost that asks for so many times what the one in the middle does, or its own tracks show where nothing
touches, and for more than so many m/s^2: its fit misses a contact, or the contact lasts."""


@dataclass(frozen=True)
class Windows:
    """Missing accelerations in windows of the paths.

    Parameters
    ----------
    size
        Root mean square of a component in m/s^2: the most probable size of the prior.
    video, body, time
        Which video, which body, and when (s since the first frame) each window is.
    position, velocity
        Mean place in m and velocity in m/s.
    acceleration, sd
        Mean and standard deviation in m/s^2 of the posterior of both components.
    lost
        Names of videos that have no windows, since no acceleration is what the model misses there.
    """

    size: float
    video: Float[np.ndarray, "window"]
    body: Float[np.ndarray, "window"]
    time: Float[np.ndarray, "window"]
    position: Float[np.ndarray, "window 2"]
    velocity: Float[np.ndarray, "window 2"]
    acceleration: Float[np.ndarray, "window 2"]
    sd: Float[np.ndarray, "window 2"]
    lost: tuple[str, ...] = ()

    @property
    def speed(self) -> Float[np.ndarray, "window"]:
        """Speed in m/s."""
        return np.linalg.norm(self.velocity, axis=1)

    @property
    def along(self) -> Float[np.ndarray, "window"]:
        """Acceleration in m/s^2 along the velocity."""
        return (self.acceleration * self.velocity).sum(axis=1) / np.maximum(self.speed, 1e-9)

    @property
    def across(self) -> Float[np.ndarray, "window"]:
        """Acceleration in m/s^2 to the left of the velocity."""
        x, y = self.velocity.T
        return (self.acceleration * np.stack([-y, x], axis=1)).sum(axis=1) / np.maximum(self.speed, 1e-9)


@dataclass(frozen=True)
class Separate:
    """What each video by itself says of patterns: its own numbers and the shared ones may differ from the fit.

    Parameters
    ----------
    patterns, residuals
        What is left of the patterns (0 where all but nothing is) and of the residuals (observed less predicted) of
        each video.
    noise
        Mean square of the residuals if they are noise alone.
    degrees
        Number of the residuals of each video, less what is absorbed of them.
    """

    patterns: tuple[Float[np.ndarray, "_ _"], ...]
    residuals: tuple[Float[np.ndarray, "_"], ...]
    noise: float
    degrees: tuple[float, ...]

    @classmethod
    def of(cls, model: ResidualModel, patterns: Sequence[Float[np.ndarray, "_ _"]], noise: float) -> "Separate":
        """Patterns in the residuals of a model, for a given mean square of the noise."""
        left, residuals, degrees = [], [], []
        for video, rows in zip(model.videos, patterns, strict=True):
            linear = video.linear.alone()
            reduced = linear.without_own(linear.padded(rows))
            left.append(reduced * ((reduced**2).sum(axis=0) > ABSORBED * (rows**2).sum(axis=0)))
            residuals.append(-linear.without_own(linear.residuals[:, None])[:, 0])
            degrees.append(linear.data - linear.absorbed)
        return cls(tuple(left), tuple(residuals), noise, tuple(degrees))

    def without(self, lost: Sequence[bool]) -> "Separate":
        """What the videos say that are not lost."""

        def kept(parts: Sequence[Any]) -> tuple[Any, ...]:
            return tuple(one for one, far in zip(parts, lost, strict=True) if not far)

        return Separate(kept(self.patterns), kept(self.residuals), self.noise, kept(self.degrees))


def missing_acceleration(model: ResidualModel, noise: float) -> Windows:
    """Accelerations that a model misses.

    Parameters
    ----------
    model
        The residuals.
    noise
        Mean square of the residuals if they are noise alone.
    """
    windows = [_windows(video.motion) for video in model.videos]
    rows = []
    for video, mine in zip(model.videos, windows, strict=True):
        fields = np.zeros((*video.motion.speed.shape, 2, 2 * len(mine)))
        for place, (body, frames) in enumerate(mine):
            for axis in range(2):
                fields[frames, body, axis, 2 * place + axis] = 1.0
        rows.append(video.rows(video.motion.pushed(fields)))
    separate = Separate.of(model, rows, noise)
    decomposed = [np.linalg.svd(one, full_matrices=False) for one in separate.patterns]
    parts = [
        (values**2 / noise, (left.T @ residuals) ** 2 / noise)
        for (left, values, _), residuals in zip(decomposed, separate.residuals, strict=True)
    ]
    own = [_size(*part) for part in parts]
    middle = float(np.median([one for one, mine in zip(own, windows, strict=True) if mine] or [0.0]))
    shown = [Clues.of(video.motion.tracks).acceleration for video in model.videos]
    lost = [one > max(FAR * min(middle, most), EXTREME) for one, most in zip(own, shown, strict=True)]
    usual = [part for part, far in zip(parts, lost, strict=True) if not far]
    size = _size(*(np.concatenate(rows) for rows in zip(*usual, strict=True))) if usual else 0.0
    means, spreads = [], []
    for (left, values, right), residuals in zip(decomposed, separate.residuals, strict=True):
        shrunk = size**2 / (size**2 * values**2 + noise)
        means.append(right.T @ (shrunk * values * (left.T @ residuals)))
        variance = size**2 - size**2 * (right**2 * (shrunk * values**2)[:, None]).sum(axis=0)
        spreads.append(np.sqrt(np.maximum(variance, 0.0)))
    return _gathered(model, windows, size, (means, spreads), lost)


def _size(information: Float[np.ndarray, "number"], squares: Float[np.ndarray, "number"]) -> float:
    """Most probable size (m/s^2) of the missing acceleration."""
    growth = 1 + SIZES[:, None] ** 2 * information
    return float(SIZES[np.argmin((np.log(growth) + squares / growth).sum(axis=1))])


def _windows(motion: FittedMotion) -> list[tuple[int, np.ndarray]]:
    """Body and frames of each window: parts of its motion between contacts."""
    result = []
    for body in range(motion.speed.shape[1]):
        moving = np.flatnonzero(motion.moving[:, body] & motion.tracks.seen[:, body])
        flights = np.searchsorted(motion.contact_times(body), motion.times[moving])
        for flight in np.unique(flights):
            frames = moving[flights == flight]
            span = motion.times[frames[-1]] - motion.times[frames[0]]
            parts = np.array_split(frames, max(1, round(float(span) / LENGTH)))
            result += [(body, part) for part in parts if len(part) >= FEWEST]
    return result


def _gathered(
    model: ResidualModel,
    windows: Sequence[Sequence[tuple[int, np.ndarray]]],
    size: float,
    found: tuple[Sequence[Float[np.ndarray, "_"]], Sequence[Float[np.ndarray, "_"]]],
    lost: Sequence[bool],
) -> Windows:
    """The windows of the videos that are not lost."""
    rows = [(k, body, frames) for k, mine in enumerate(windows) if not lost[k] for body, frames in mine]
    kept = [[one for one, far in zip(part, lost, strict=True) if not far] for part in found]
    mean, sd = (np.concatenate([np.zeros(0), *part]) for part in kept)
    motions = [video.motion for video in model.videos]
    return Windows(
        size,
        np.array([k for k, _, _ in rows], dtype=float),
        np.array([body for _, body, _ in rows], dtype=float),
        np.array([motions[k].times[frames].mean() - motions[k].times[0] for k, _, frames in rows], dtype=float),
        np.array([motions[k].position[frames, body].mean(axis=0) for k, body, frames in rows]).reshape(-1, 2),
        np.array([motions[k].velocity[frames, body].mean(axis=0) for k, body, frames in rows]).reshape(-1, 2),
        mean.reshape(-1, 2),
        sd.reshape(-1, 2),
        tuple(video.linear.name for video, far in zip(model.videos, lost, strict=True) if far),
    )

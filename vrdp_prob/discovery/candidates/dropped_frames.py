"""Frames that are missing under even stamps, where tracks show by themselves that all bodies took several steps in one.

A fit that does not know of them spreads the time that is lost over whole videos, and finds the way to none of them.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.models.effects.dropped_frames import MOST_DROPPED, DroppedFrames
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.roughness import noise_scale
from vrdp_prob.scene import Tracks

AROUND = 3
"""Steps before and after one by which the usual one is told."""
EVEN = 0.01
"""Share of the time between two stamps by which stamps may be uneven."""
SIGNIFICANT = 6.0
"""Standard deviations by which a step is too long, from which on it is several, wherever it was looked for."""
WHOLE = 0.25
"""Share of a step by which it may be off a whole number of usual ones, beside the noise: bodies brake."""
AWAY = 0.1
"""The same for it with the two beside it: a frame that comes late by itself makes the next step as much shorter."""
BEND = 0.5
"""Share of a step by which those before and after may differ: by more, the body has met something."""
ALIKE = 4.0
"""Standard deviations of the noise that a usual step has at least, and by which the step of each body may be off."""
AGAIN = 2
"""Frames that are dropped in one video from which it is no single event."""


@dataclass(frozen=True)
class Dropped:
    """Frames that a video lacks.

    Parameters
    ----------
    after
        Time in s, between two stamps, of each frame that is missing there, in order.
    frame_time
        Time in s between two stamps.
    """

    after: tuple[float, ...]
    frame_time: float

    def restamped(self, tracks: Tracks) -> Tracks:
        """The tracks at the times at which they were taken."""
        late = np.searchsorted(np.array(self.after), tracks.times) * self.frame_time
        return tracks.at_times(tracks.times + late)


def choices(tracks: Tracks, dropped: int) -> float:
    """Logarithm of the number of places, between two stamps each, among which those of dropped frames are chosen."""
    return dropped * math.log(len(tracks.times) - 1)


def frames_unknown_to(fit: SharedFit, catalogue: Sequence[Effect]) -> list[Dropped]:
    """Frames that tracks show to be missing again and again, where nothing in the model of a fit shifts the clock.

    None where they are not looked for.
    """
    looked_for = any(isinstance(effect, DroppedFrames) for effect in catalogue)
    shifted = any(effect.overrides("measured_times") for effect in fit.model.effects)
    return dropped_frames(fit.tracks) if looked_for and not shifted else []


def dropped_frames(videos: Sequence[Tracks]) -> list[Dropped]:
    """The frames that each video lacks; none of any where no video lacks several, or one lacks too many.

    Parameters
    ----------
    videos
        What was seen.
    """
    found = [_of_video(tracks) for tracks in videos]
    counts = [len(one.after) for one in found]
    return found if AGAIN <= max(counts, default=0) <= MOST_DROPPED else []


def _of_video(tracks: Tracks) -> Dropped:
    intervals = np.diff(tracks.times)
    usual = float(np.median(intervals)) if len(intervals) else 0.0
    noise = noise_scale(tracks)
    if len(intervals) <= 2 * AROUND or not np.isfinite(noise) or np.ptp(intervals) > EVEN * usual:
        return Dropped((), usual)
    steps = np.diff(tracks.positions, axis=0)
    after: list[float] = []
    for place in range(AROUND, len(steps) - AROUND):
        missing = _missing(steps, place, noise)
        after += [float(tracks.times[place] + tracks.times[place + 1]) / 2] * missing
    return Dropped(tuple(after), usual)


def _missing(steps: Float[np.ndarray, "step body 2"], place: int, noise: float) -> int:
    """How many frames are missing within a step, by how many of the usual ones each body makes in it.

    The usual ones are the middle of those around it, so that neither a contact nor another missing frame among these
    misleads. A position that lies off by itself is taken back by the step after it.
    """
    before, later = _middle(steps[place - AROUND : place]), _middle(steps[place + 1 : place + 1 + AROUND])
    usual, bend = (before + later) / 2, np.linalg.norm(later - before, axis=1)
    size = np.linalg.norm(usual, axis=1)
    around = steps[place - 1 : place + 2]
    with np.errstate(invalid="ignore"):
        taken = (around * usual).sum(axis=2) / size**2
        beside = np.nan_to_num(taken[[0, 2]], nan=1.0)
        telling = (bend < BEND * size) & (size > ALIKE * noise) & (beside > 0.5).all(0)
    told = np.flatnonzero(telling & np.isfinite(taken[1]))
    if not len(told):
        return 0
    squares = size[told] ** 2
    count, sd = float(np.average(taken[1, told], weights=squares)), np.sqrt(2.0 / squares.sum()) * noise
    with_those_beside = count + float(np.average(beside[:, told].sum(axis=0), weights=squares))
    whole = round(count)
    if whole < 2 or count - 1 < SIGNIFICANT * sd or abs(count - whole) > WHOLE + 2 * sd:
        return 0
    if abs(with_those_beside - (whole + 2)) > AWAY + 2 * sd:
        return 0
    off = np.linalg.norm(around[1, told] - whole * usual[told], axis=1)
    allowed = ALIKE * np.sqrt(2.0 * (1 + whole**2)) * noise + WHOLE * size[told]
    return whole - 1 if (off < allowed).all() else 0


def _middle(steps: Float[np.ndarray, "step body 2"]) -> Float[np.ndarray, "body 2"]:
    """The step in the middle of each body; not a number where fewer than two are seen."""
    seen = np.isfinite(steps).all(axis=2).sum(axis=0) >= AROUND - 1
    middle = np.full(steps.shape[1:], np.nan)
    middle[seen] = np.nanmedian(steps[:, seen], axis=0)
    return middle

"""Trajectory and window features: where an object is from frame to frame, in the picture and on the floor.

Ding et al. (NeurIPS 2021), section 3.2: a trajectory is 4 numbers per frame; a pair has, for a window of S = 10 frames,
both trajectories and their absolute difference, 12 S numbers.
"""

import numpy as np
import torch
from jaxtyping import Bool, Float
from scipy.fft import dct
from torch import Tensor

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.events import EventUniverse
from vrdp_prob.scene import Tracks
from vrdp_prob.scene.camera import REST_HEIGHT

WINDOW = 10
"""Frames S of a window."""
COORDINATES = 4
_METRES = 3.0
"""Length that makes floor positions about as large as picture positions, which go from -1 to 1."""
_TO_WAVES = torch.from_numpy(dct(np.eye(WINDOW), norm="ortho", axis=0)).float()
"""Cosine transform of a window, a turn of its axes: first the mean, then the slope, then the bend of what it holds."""


def trajectories(tracks: Tracks) -> Float[np.ndarray, "frame body 4"]:
    """Picture and floor position of each object in each frame, gaps filled in; 0 before and after it is seen.

    Raises
    ------
    InputError
        If the tracks have no camera, or fewer frames than a window.
    """
    camera = tracks.camera
    if camera is None:
        raise InputError(f"{tracks.video}: the tracks have no camera, so there is no picture that concepts could see.")
    if len(tracks.times) < WINDOW:
        raise InputError(f"{tracks.video}: the video has {len(tracks.times)} frames; concepts need at least {WINDOW}.")
    table = np.zeros((len(tracks.times), len(tracks.bodies), COORDINATES))
    half = np.array([camera.width, camera.height]) / 2
    for body in range(len(tracks.bodies)):
        seen = np.flatnonzero(tracks.seen[:, body])
        frames = np.arange(seen[0], seen[-1] + 1)
        place = np.stack([np.interp(frames, seen, tracks.positions[seen, body, axis]) for axis in (0, 1)], axis=1)
        height = np.full((len(frames), 1), tracks.bodies[body].radius or REST_HEIGHT)
        pixels = camera.project(np.concatenate([place, height], axis=1))
        table[frames, body] = np.concatenate([pixels / half - 1, place / _METRES], axis=1)
    return table


def in_sight(tracks: Tracks) -> Bool[np.ndarray, "frame body"]:
    """Frames from the first to the last in which an object is seen."""
    frames = np.arange(len(tracks.times))[:, None]
    seen = tracks.seen
    return (frames >= seen.argmax(axis=0)) & (frames < len(frames) - seen[::-1].argmax(axis=0))


def window_features(trajectory: Float[Tensor, "frame body 4"]) -> Float[Tensor, "window body feature"]:
    """The 4 S numbers of each object in each window, as waves along the window."""
    windows = trajectory.unfold(0, WINDOW, 1)
    return (windows @ _TO_WAVES.T.to(trajectory)).flatten(start_dim=2)


def pair_features(
    trajectory: Float[Tensor, "frame body 4"], universe: EventUniverse
) -> Float[Tensor, "order window pair feature"]:
    """The 12 S numbers of each pair in each window, with its objects in both orders, as waves along the window."""
    windows = trajectory.unfold(0, WINDOW, 1)
    first, second = (windows[:, [pair[place] for pair in universe.pairs]] for place in (0, 1))
    apart = (first - second).abs()
    both = torch.stack([torch.cat([first, second, apart], dim=2), torch.cat([second, first, apart], dim=2)])
    return (both @ _TO_WAVES.T.to(trajectory)).flatten(start_dim=3)


def windows_in_sight(sight: Bool[Tensor, "frame body"]) -> Bool[Tensor, "window body"]:
    """Windows in which an object is in sight from beginning to end."""
    return sight.unfold(0, WINDOW, 1).all(dim=-1)


def window_of_frame(frames: int) -> Tensor:
    """The window around each frame: the first and the last windows serve for the frames at the ends."""
    return (torch.arange(frames) - WINDOW // 2).clamp(0, frames - WINDOW)

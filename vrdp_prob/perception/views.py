"""The frames in which a video shows an object best, and what nearer objects hide of it there."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, UInt8

from vrdp_prob.perception.placing import Sighting, Track
from vrdp_prob.perception.region import Window, apparent_radius, paint
from vrdp_prob.perception.solids import Pose
from vrdp_prob.perception.tracking import Tracker
from vrdp_prob.spread import evenly_spread

_MOST_VIEWS = 16
_LOST = 0.1
"""Share of an object's picture that a view may show less than the best view does."""
_RIM = 0.12
"""Rim of an object's picture that is not looked at for its attributes, in apparent radii."""


@dataclass(frozen=True)
class View:
    """One object in one frame.

    Parameters
    ----------
    frame
        Index of the frame.
    pose
        Where the object is.
    window
        Its pixels, hidden ones included.
    hidden
        1 where something nearer is.
    behind
        Tracks that may show where this one does not.
    """

    frame: int
    pose: Pose
    window: Window
    hidden: UInt8[np.ndarray, "height width"]
    behind: tuple[Track, ...]


def best_views(tracker: Tracker, tracks: Sequence[Track], track: Track) -> list[View]:
    """Views of a track in frames that show most of it, evenly spread over these."""
    ranked = sorted(track.sightings, key=lambda frame: -round(track.sightings[frame].visible, 2))
    least = track.sightings[ranked[0]].visible - _LOST
    best = [frame for frame in ranked if track.sightings[frame].visible >= least]
    places = evenly_spread(_MOST_VIEWS, len(best))
    return [_view(tracker, tracks, track, best[place]) for place in places]


def _view(tracker: Tracker, tracks: Sequence[Track], track: Track, frame: int) -> View:
    sightings: Mapping[int, Sighting] = {
        other.number: other.sightings[frame] for other in tracks if frame in other.sightings
    }
    live = [other for other in tracks if other.number in sightings]
    pose = track.sightings[frame].pose
    hidden = tracker.covered(track, live, sightings)
    behind = tuple(other for other in live if other is not track)
    return View(frame, pose, tracker.placer.window(track.solid, pose), hidden, behind)


def inner_pixels(
    tracker: Tracker, track: Track, view: View
) -> tuple[UInt8[np.ndarray, "pixel 3"], Bool[np.ndarray, "pixel"]]:
    """Pixels well inside the picture of a track that nothing nearer hides, and whether each is on its flat top."""
    window = view.window
    margin = max(1, round(_RIM * apparent_radius(tracker.camera, track.solid, view.pose)))
    free = np.pad(window.mask, 1)
    free[1:-1, 1:-1] *= view.hidden[window.place] == 0
    core = cv2.erode(free, np.ones((2 * margin + 1,) * 2, np.uint8))[1:-1, 1:-1] > 0
    return tracker.frames[view.frame][window.place][core], _on_lid(tracker, track, view)[core]


def _on_lid(tracker: Tracker, track: Track, view: View) -> Bool[np.ndarray, "row column"]:
    """Where in a window the flat top of a track is in sight."""
    height, width = tracker.frames.shape[1:3]
    on_lid = np.zeros((height, width), dtype=bool)
    lid = track.solid.lid(tracker.camera, view.pose)
    if lid is not None:
        face = paint(lid, height, width)
        on_lid[face.place] = face.mask > 0
    return on_lid[view.window.place]

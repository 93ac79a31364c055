"""Small pictures of each object, cut where the tracker saw it."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float32, Int, UInt8

from vrdp_prob.perception.placing import Track
from vrdp_prob.perception.region import Gain, apparent_radius
from vrdp_prob.perception.tracking import Tracker
from vrdp_prob.perception.views import View

SIDE = 32
"""Pixels along the side of a crop."""
_REACH = 1.7
"""Half the side of what a crop shows, in apparent radii: a cube's corners lie within."""


Picture = UInt8[np.ndarray, "height width 3"] | Float32[np.ndarray, "height width"]
Square = UInt8[np.ndarray, "size size 3"] | Float32[np.ndarray, "size size"]


@dataclass(frozen=True)
class Crops:
    """Pictures of one object, all of the same scale against its apparent size.

    Parameters
    ----------
    pictures
        The object and what is around it, RGB.
    masks
        Probability, in steps of 1/255, that a pixel shows the object, by its colours alone: no shape is supposed.
    """

    pictures: UInt8[np.ndarray, "view side side 3"]
    masks: UInt8[np.ndarray, "view side side"]

    def __len__(self) -> int:
        return len(self.pictures)


def cut_crops(tracker: Tracker, track: Track, views: Sequence[View]) -> Crops:
    """Cut a track out of the frames of its views."""
    cut = [_cut(tracker, track, view) for view in views]
    return Crops(np.stack([picture for picture, _ in cut]), np.stack([mask for _, mask in cut]))


def _cut(
    tracker: Tracker, track: Track, view: View
) -> tuple[UInt8[np.ndarray, "side side 3"], UInt8[np.ndarray, "side side"]]:
    centre = tracker.camera.project(np.array([view.pose.x, view.pose.y, track.radius]))
    half = max(_REACH * apparent_radius(tracker.camera, track.solid, view.pose), 1.0)
    corner = np.round(centre - half).astype(int)
    size = max(round(2 * half), 1)
    picture = _square(tracker.frames[view.frame], corner, size, cv2.BORDER_REPLICATE)
    shows = _square(_shown(tracker, track, view), corner, size, cv2.BORDER_CONSTANT)
    small = cv2.resize(picture, (SIDE, SIDE), interpolation=cv2.INTER_AREA)
    share = cv2.resize(shows, (SIDE, SIDE), interpolation=cv2.INTER_AREA)
    return np.asarray(small, dtype=np.uint8), np.round(255 * share).astype(np.uint8)


def _shown(tracker: Tracker, track: Track, view: View) -> Float32[np.ndarray, "height width"]:
    """Probability of each pixel to show the track rather than the floor, a shadow or another object."""
    evidence = tracker.evidence(view.frame)
    behind = [
        (tracker.placer.window(other.solid, other.sightings[view.frame].pose), other.appearance)
        for other in view.behind
    ]
    odds = Gain.of(evidence, track.appearance, view.hidden, behind).odds
    return np.where(view.hidden > 0, 0, 1 / (1 + np.exp(-odds))).astype(np.float32)


def _square(picture: Picture, corner: Int[np.ndarray, "2"], size: int, border: int) -> Square:
    """A square of a picture from a corner (column, row) on; outside the picture the border is made up."""
    height, width = picture.shape[:2]
    left, top = (int(value) for value in corner)
    before, after = max(-min(left, top), 0), max(left + size - width, top + size - height, 0)
    wide = cv2.copyMakeBorder(picture, before, after, before, after, border)
    return np.asarray(wide[top + before : top + before + size, left + before : left + before + size])

"""Score a solid's pose by the pixels its picture would cover, and look for the best pose nearby."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, Float32, UInt8

from vrdp_prob.perception.appearance import Appearance, Evidence
from vrdp_prob.perception.solids import Pose, Solid
from vrdp_prob.scene.body import Shape
from vrdp_prob.scene.camera import Camera

_LARGEST_GAIN = 6.0
"""Log odds beyond which one pixel says no more: neighbouring pixels share their errors."""
_SUBPIXEL_BITS = 4
_COMPASS = np.array([(1, 0), (-1, 0), (0, 1), (0, -1)])
_LONGEST_WALK = 12
_LONGEST_STEP = 2.5
"""Steps on the plane are at most so many times those across the line of sight, however flat the view."""
_YAW_STEP = 0.35
"""Turn (rad) per step of one apparent radius in the search."""


@dataclass(frozen=True)
class Window:
    """A solid's picture inside a rectangle of the frame.

    Parameters
    ----------
    rows, columns
        The rectangle.
    mask
        1 where the solid is.
    """

    rows: slice
    columns: slice
    mask: UInt8[np.ndarray, "row column"]

    @property
    def place(self) -> tuple[slice, slice]:
        """Index into a picture."""
        return self.rows, self.columns

    @property
    def area(self) -> int:
        """Number of pixels of the solid inside the frame."""
        return int(cv2.countNonZero(self.mask)) if self.mask.size else 0


def paint(polygon: Float[np.ndarray, "point 2"], height: int, width: int, *, margin: int = 0) -> Window:
    """The pixels inside a convex polygon; outside the frame there are none. `margin` widens the rectangle only."""
    left, top = np.floor(polygon.min(axis=0)).astype(int) - 1 - margin
    right, bottom = np.ceil(polygon.max(axis=0)).astype(int) + 1 + margin
    left, top = max(int(left), 0), max(int(top), 0)
    right, bottom = max(min(int(right), width), left), max(min(int(bottom), height), top)
    mask = np.zeros((bottom - top, right - left), np.uint8)
    if mask.size > 0:
        corner = np.array([left + 0.5, top + 0.5])
        points = np.round((polygon - corner) * 2**_SUBPIXEL_BITS).astype(np.int32)
        cv2.fillConvexPoly(mask, points, 1, shift=_SUBPIXEL_BITS)
    return Window(slice(top, bottom), slice(left, right), mask)


def polygon_area(polygon: Float[np.ndarray, "point 2"]) -> float:
    """Area in square pixels of a convex polygon, whether or not it lies in the frame."""
    x, y = polygon.T
    return float(abs((x * np.roll(y, -1) - np.roll(x, -1) * y).sum()) / 2)


@dataclass(frozen=True)
class Gain:
    """What each pixel says for one object: log odds of its colour against whatever else would be there.

    Parameters
    ----------
    odds
        Log odds in a rectangle of the frame, 0 where something nearer hides the object.
    top, left
        Corner of the rectangle in the frame.
    """

    odds: Float32[np.ndarray, "row column"]
    top: int = 0
    left: int = 0

    @classmethod
    def of(
        cls,
        evidence: Evidence,
        appearance: Appearance,
        nearer: UInt8[np.ndarray, "height width"],
        behind: Sequence[tuple[Window, Appearance]],
        place: tuple[slice, slice] = (slice(None), slice(None)),
    ) -> "Gain":
        """Weigh an appearance against the floor and the objects behind it, inside a rectangle."""
        height, width = nearer.shape
        top, bottom, _ = place[0].indices(height)
        left, right, _ = place[1].indices(width)
        other = evidence.floor[place].copy()
        for window, farther in behind:
            rows = slice(max(window.rows.start, top), min(window.rows.stop, bottom))
            columns = slice(max(window.columns.start, left), min(window.columns.stop, right))
            if rows.start >= rows.stop or columns.start >= columns.stop:
                continue
            mask = window.mask[_shifted(rows, window.rows.start), _shifted(columns, window.columns.start)]
            region = other[_shifted(rows, top), _shifted(columns, left)]
            claimed = farther.log_density(evidence.bins[rows, columns])
            np.maximum(region, np.where(mask > 0, claimed, region), out=region)
        odds = np.clip(appearance.log_density(evidence.bins[place]) - other, -_LARGEST_GAIN, _LARGEST_GAIN)
        odds[nearer[place] > 0] = 0
        return cls(odds.astype(np.float32), top, left)

    def score(self, polygon: Float[np.ndarray, "point 2"]) -> float:
        """Sum of the log odds over an outline's inside."""
        window = paint(polygon - (self.left, self.top), *self.odds.shape)
        if window.mask.size == 0:
            return 0.0
        return float(np.vdot(self.odds[window.place], window.mask.astype(np.float32)))


def _shifted(piece: slice, start: int) -> slice:
    return slice(piece.start - start, piece.stop - start)


def climb(gain: Gain, camera: Camera, solid: Solid, start: Pose, steps: tuple[float, ...]) -> tuple[Pose, float]:
    """Walk uphill in compass steps measured in apparent radii; returns the pose and its score."""
    pose, polygon = start, solid.polygon(camera, start)
    best = gain.score(polygon)
    for step in steps:
        for _ in range(_LONGEST_WALK):
            trials = [
                (gain.score(outline), trial, outline) for trial, outline in _moves(camera, solid, pose, polygon, step)
            ]
            value, trial, _ = max(trials, key=lambda item: item[0])
            if value <= best:
                break
            # the shifted outline is only nearly that of the moved solid
            pose, polygon = trial, solid.polygon(camera, trial)
            best = gain.score(polygon)
    return pose, best


def _moves(
    camera: Camera, solid: Solid, pose: Pose, polygon: Float[np.ndarray, "point 2"], step: float
) -> Iterator[tuple[Pose, Float[np.ndarray, "point 2"]]]:
    """Poses one step away in the picture, with their outlines."""
    to_plane = camera.plane_jacobian(np.array([pose.x, pose.y]), solid.radius)
    pixels = step * solid.radius / _across(to_plane)
    for direction in _COMPASS:
        shift = pixels * direction
        x, y = to_plane @ shift
        length = float(np.hypot(x, y))
        shrink = min(1.0, _LONGEST_STEP * step * solid.radius / max(length, 1e-9))
        yield pose.moved(float(x) * shrink, float(y) * shrink), polygon + shrink * shift
    if solid.shape is Shape.CUBE:
        for turn in (_YAW_STEP * step, -_YAW_STEP * step):
            turned = pose.moved(0.0, 0.0, turn)
            yield turned, solid.polygon(camera, turned)


def apparent_radius(camera: Camera, solid: Solid, pose: Pose) -> float:
    """Radius in pixels at which a sphere of the solid's radius would appear there."""
    return solid.radius / _across(camera.plane_jacobian(np.array([pose.x, pose.y]), solid.radius))


def _across(jacobian: Float[np.ndarray, "2 2"]) -> float:
    """Metres per pixel across the line of sight, the direction that is not foreshortened."""
    half_sum = float((jacobian**2).sum()) / 2
    determinant = float(jacobian[0, 0] * jacobian[1, 1] - jacobian[0, 1] * jacobian[1, 0])
    return float(np.sqrt(max(half_sum - np.sqrt(max(half_sum**2 - determinant**2, 0.0)), 1e-18)))

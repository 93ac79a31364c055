"""Score a solid's pose by the pixels its picture would cover, and look for the best pose nearby."""

from collections.abc import Callable
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
_COMPASS = ((1, 0), (-1, 0), (0, 1), (0, -1))
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
        Log odds, 0 where something nearer hides the object.
    """

    odds: Float32[np.ndarray, "height width"]

    @classmethod
    def of(
        cls,
        evidence: Evidence,
        appearance: Appearance,
        nearer: UInt8[np.ndarray, "height width"],
        behind: list[tuple[Window, Appearance]],
    ) -> "Gain":
        """Weigh an appearance against the floor and the objects behind it."""
        other = evidence.floor.copy()
        for window, farther in behind:
            claimed = farther.log_density(evidence.bins[window.place])
            region = other[window.place]
            np.maximum(region, np.where(window.mask > 0, claimed, region), out=region)
        odds = np.clip(appearance.log_density(evidence.bins) - other, -_LARGEST_GAIN, _LARGEST_GAIN)
        odds[nearer > 0] = 0
        return cls(odds.astype(np.float32))

    def score(self, camera: Camera, solid: Solid, pose: Pose) -> float:
        """Sum of the log odds over the solid's picture."""
        height, width = self.odds.shape
        window = paint(solid.polygon(camera, pose), height, width)
        if window.mask.size == 0:
            return 0.0
        return float(np.vdot(self.odds[window.place], window.mask.astype(np.float32)))


def climb(
    score: Callable[[Pose], float],
    camera: Camera,
    solid: Solid,
    start: Pose,
    steps: tuple[float, ...],
) -> tuple[Pose, float]:
    """Walk uphill in compass steps measured in apparent radii; returns the pose and its score."""
    pose, best = start, score(start)
    for step in steps:
        moves = _moves(camera, solid, pose, step)
        for _ in range(12):
            trials = [(score(trial), trial) for trial in (pose.moved(*move) for move in moves)]
            value, trial = max(trials, key=lambda item: item[0])
            if value <= best:
                break
            pose, best = trial, value
    return pose, best


def _moves(camera: Camera, solid: Solid, pose: Pose, step: float) -> list[tuple[float, float, float]]:
    pixels = step * apparent_radius(camera, solid, pose)
    to_plane = camera.plane_jacobian(np.array([pose.x, pose.y]), solid.radius)
    moves = []
    for direction in _COMPASS:
        x, y = to_plane @ (pixels * np.array(direction))
        length = float(np.hypot(x, y))
        shrink = min(1.0, 2.5 * step * solid.radius / max(length, 1e-9))
        moves.append((float(x) * shrink, float(y) * shrink, 0.0))
    if solid.shape is Shape.CUBE:
        moves += [(0.0, 0.0, _YAW_STEP * step), (0.0, 0.0, -_YAW_STEP * step)]
    return moves


def apparent_radius(camera: Camera, solid: Solid, pose: Pose) -> float:
    """Radius in pixels at which a sphere of the solid's radius would appear there."""
    jacobian = camera.plane_jacobian(np.array([pose.x, pose.y]), solid.radius)
    # the direction across the line of sight is the one that is not foreshortened
    return solid.radius / max(float(np.linalg.svd(jacobian, compute_uv=False)[-1]), 1e-9)

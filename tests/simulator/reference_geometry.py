"""Distances of convex outlines by their Minkowski difference; no code of the project.

Two outlines overlap where the origin is inside of the set of all differences of their points, and their distance is the
distance of the origin from that set. A disc is one corner with a radius, a wall has two corners, a square four.
"""

from dataclasses import dataclass

import numpy as np

CORNER_DOUBT = 1e-4
"""Distance in m from the end of a side within which two polygons that meet may as well meet by another feature."""


@dataclass(frozen=True)
class Outline:
    """Corners in the body's own frame, counter-clockwise, in m, and a radius around them."""

    corners: np.ndarray
    radius: float = 0.0

    @property
    def reach(self) -> float:
        """Radius of the circle around the origin of the frame that holds the outline."""
        return float(np.hypot(*self.corners.T).max()) + self.radius


@dataclass(frozen=True)
class Touch:
    """Normal from the first to the second outline, touching point, and whether the feature is in doubt."""

    normal: np.ndarray
    point: np.ndarray
    doubtful: bool


def disc(radius: float) -> Outline:
    return Outline(np.zeros((1, 2)), radius)


def square(half: float) -> Outline:
    return Outline(half * np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]]))


def wall(line: np.ndarray) -> Outline:
    return Outline(np.reshape(line, (2, 2)))


def _placed(outline: Outline, pose: np.ndarray) -> np.ndarray:
    """Corners [..., corner, 2] of an outline at poses (x, y, angle)."""
    x, y = outline.corners.T
    cosine, sine = np.cos(pose[..., 2:3]), np.sin(pose[..., 2:3])
    return np.stack([pose[..., 0:1] + cosine * x - sine * y, pose[..., 1:2] + sine * x + cosine * y], axis=-1)


def _edges(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Starts and ends of the edges; a point has none."""
    if corners.shape[-2] == 1:
        return corners[..., :0, :], corners[..., :0, :]
    return corners, np.roll(corners, -1, axis=-2)


def _lowest(corners: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Corner [..., direction, 2] with the lowest product with each direction [..., direction, 2]."""
    index = (direction @ np.swapaxes(corners, -1, -2)).argmin(-1)
    return np.take_along_axis(corners, index[..., None], axis=-2)


def _outward(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    along = end - start
    return np.stack([along[..., 1], -along[..., 0]], axis=-1)


@dataclass(frozen=True)
class _Difference:
    """Edges of the Minkowski difference; the first `own` are edges of the first outline."""

    start: np.ndarray
    end: np.ndarray
    outward: np.ndarray
    corner: np.ndarray
    own: int

    @classmethod
    def of(cls, first: np.ndarray, second: np.ndarray) -> "_Difference":
        (a0, a1), (b0, b1) = _edges(first), _edges(second)
        if not a0.shape[-2] + b0.shape[-2]:
            point = first - second
            return cls(point, point, 0 * point, second, 1)
        normal_a, normal_b = _outward(a0, a1), _outward(b0, b1)
        of_b, of_a = _lowest(second, normal_a), _lowest(first, normal_b)
        return cls(
            start=np.concatenate([a0 - of_b, of_a - b0], axis=-2),
            end=np.concatenate([a1 - of_b, of_a - b1], axis=-2),
            outward=np.concatenate([normal_a, -normal_b], axis=-2),
            corner=np.concatenate([of_b, of_a], axis=-2),
            own=a0.shape[-2],
        )

    def nearest(self) -> tuple[np.ndarray, np.ndarray]:
        """Nearest points [..., edge, 2] to the origin and their shares of the edges."""
        along = self.end - self.start
        square_length = np.maximum((along**2).sum(-1), 1e-300)
        share = np.clip(-(self.start * along).sum(-1) / square_length, 0.0, 1.0)
        return self.start + share[..., None] * along, share

    def inside(self) -> np.ndarray:
        """Whether the origin is inside, so that the outlines overlap."""
        return ((self.outward * self.start).sum(-1) > 0).all(-1)


def gap(first: Outline, second: Outline, pose: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Distance in m of two outlines at poses [..., 3]; negative where they overlap."""
    if len(first.corners) == len(second.corners) == 1:
        return np.hypot(other[..., 0] - pose[..., 0], other[..., 1] - pose[..., 1]) - first.radius - second.radius
    difference = _Difference.of(_placed(first, pose), _placed(second, other))
    distance = np.sqrt((difference.nearest()[0] ** 2).sum(-1).min(-1))
    return np.where(difference.inside(), -distance, distance) - first.radius - second.radius


def touch(first: Outline, second: Outline, pose: np.ndarray, other: np.ndarray) -> Touch:
    """How two outlines touch at one pair of poses at which their gap is 0."""
    corners, others = _placed(first, pose), _placed(second, other)
    difference = _Difference.of(corners, others)
    points, share = difference.nearest()
    edge = int((points**2).sum(-1).argmin())
    if first.radius + second.radius > 0:
        normal = -points[edge] / np.hypot(*points[edge])
        centre = corners[0] + first.radius * normal if first.radius > 0 else others[0] - second.radius * normal
        return Touch(normal, centre, False)
    normal = difference.outward[edge] / np.hypot(*difference.outward[edge])
    length = np.hypot(*(difference.end - difference.start)[edge])
    doubtful = min(share[edge], 1 - share[edge]) * length < CORNER_DOUBT
    return Touch(normal, difference.corner[edge], bool(doubtful))

"""What a solid looks like to the camera: the outline of its picture, in space and in pixels."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float

from vrdp_prob.scene.body import Shape
from vrdp_prob.scene.camera import Camera

_CIRCLE = np.stack(
    [np.cos(np.linspace(0, 2 * np.pi, 40, endpoint=False)), np.sin(np.linspace(0, 2 * np.pi, 40, endpoint=False))], -1
)
_CORNERS = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])


@dataclass(frozen=True)
class Pose:
    """Where a solid stands on the floor.

    Parameters
    ----------
    x, y
        Centre on the plane in m.
    yaw
        Turn about the vertical in rad; only a cube's shows.
    """

    x: float
    y: float
    yaw: float = 0.0

    def moved(self, x: float, y: float, yaw: float = 0.0) -> "Pose":
        """The pose with a step added."""
        return Pose(self.x + x, self.y + y, self.yaw + yaw)


@dataclass(frozen=True)
class Solid:
    """A solid of known shape and size that rests on the floor z = 0.

    Parameters
    ----------
    shape
        Sphere, cube or cylinder (upright, as high as wide).
    radius
        Radius or half side in m; the centre is at this height.
    """

    shape: Shape
    radius: float

    def rim(self, camera: Camera, pose: Pose) -> Float[np.ndarray, "point 3"]:
        """Points in space (m) whose pictures' convex hull is the solid's picture."""
        centre = np.array([pose.x, pose.y, self.radius])
        if self.shape is Shape.SPHERE:
            return self._sphere_rim(camera_centre(camera), centre)
        if self.shape is Shape.CYLINDER:
            discs = [np.column_stack([_CIRCLE, np.full(len(_CIRCLE), level)]) for level in (-1.0, 1.0)]
            return centre + self.radius * np.concatenate(discs)
        cosine, sine = np.cos(pose.yaw), np.sin(pose.yaw)
        turn = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1.0]])
        return centre + self.radius * _CORNERS @ turn.T

    def _sphere_rim(
        self, viewpoint: Float[np.ndarray, "3"], centre: Float[np.ndarray, "3"]
    ) -> Float[np.ndarray, "point 3"]:
        """The circle along which lines of sight touch the sphere."""
        towards = viewpoint - centre
        distance = max(float(np.linalg.norm(towards)), 1.001 * self.radius)
        towards = towards / distance
        ratio = self.radius / distance
        side = np.cross(towards, (0.0, 0.0, 1.0) if abs(towards[2]) < 0.9 else (1.0, 0.0, 0.0))
        side /= np.linalg.norm(side)
        up = np.cross(towards, side)
        middle = centre + self.radius * ratio * towards
        width = self.radius * np.sqrt(1 - ratio**2)
        return middle + width * (_CIRCLE[:, :1] * side + _CIRCLE[:, 1:] * up)

    def polygon(self, camera: Camera, pose: Pose) -> Float[np.ndarray, "point 2"]:
        """Outline in pixels, convex."""
        pixels = camera.project(self.rim(camera, pose))
        return np.asarray(cv2.convexHull(pixels.astype(np.float32))[:, 0], dtype=float)

    def lid(self, camera: Camera, pose: Pose) -> Float[np.ndarray, "point 2"] | None:
        """Outline in pixels of the flat top, convex; a sphere has none."""
        if self.shape is Shape.SPHERE:
            return None
        rim = self.rim(camera, pose)
        top = camera.project(rim[rim[:, 2] > self.radius])
        return np.asarray(cv2.convexHull(top.astype(np.float32))[:, 0], dtype=float)

    def outline(self, camera: Camera, pose: Pose, count: int) -> "Outline":
        """Points evenly spaced along the outline."""
        rim = self.rim(camera, pose)
        pixels = camera.project(rim)
        hull = cv2.convexHull(pixels.astype(np.float32), returnPoints=False)[:, 0]
        corners, space = pixels[hull], rim[hull]
        steps = np.roll(corners, -1, axis=0) - corners
        lengths = np.linalg.norm(steps, axis=1)
        ends = np.cumsum(lengths)
        along = (np.arange(count) + 0.5) * ends[-1] / count
        segment = np.searchsorted(ends, along)
        share = ((along - ends[segment] + lengths[segment]) / lengths[segment])[:, None]
        following = (segment + 1) % len(hull)
        normals = np.stack([steps[:, 1], -steps[:, 0]], -1)[segment] / lengths[segment][:, None]
        points = corners[segment] + share * steps[segment]
        outward = np.sign(((points - corners.mean(axis=0)) * normals).sum(axis=1).sum()) or 1.0
        return Outline(points, outward * normals, space[segment] * (1 - share) + space[following] * share)


@dataclass(frozen=True)
class Outline:
    """Points on the outline of a solid's picture.

    Parameters
    ----------
    pixels
        The points in the picture.
    normals
        Unit normals in the picture, pointing outward.
    space
        The same points in space, m.
    """

    pixels: Float[np.ndarray, "point 2"]
    normals: Float[np.ndarray, "point 2"]
    space: Float[np.ndarray, "point 3"]

    def sensitivity(self, camera: Camera, pose: Pose) -> Float[np.ndarray, "point 3"]:
        """Motion of the outline along its normals in pixels per m of x and of y, and per rad of yaw."""
        matrix = camera.projection
        homogeneous = self.space @ matrix[:, :3].T + matrix[:, 3]
        pixels = homogeneous[:, :2] / homogeneous[:, 2:]
        per_metre = (matrix[None, :2, :2] - pixels[:, :, None] * matrix[2, :2]) / homogeneous[:, 2:, None]
        along = np.einsum("pi,pij->pj", self.normals, per_metre)
        lever = np.stack([-(self.space[:, 1] - pose.y), self.space[:, 0] - pose.x], -1)
        return np.column_stack([along, (along * lever).sum(axis=1)])


def camera_centre(camera: Camera) -> Float[np.ndarray, "3"]:
    """Place of the camera in m."""
    return -np.linalg.solve(camera.projection[:, :3], camera.projection[:, 3])


def depth(camera: Camera, pose: Pose, height: float) -> float:
    """How far along the line of sight a solid is; only the order matters."""
    return float(np.linalg.norm(camera_centre(camera) - np.array([pose.x, pose.y, height])))

"""A small renderer for tests: it shares no code with what it tests."""

from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np

RADIUS = 0.2
FRAME_RATE = 25.0
_SUPERSAMPLING = 3
_LIGHT = np.array([0.35, 0.3, 0.9]) / np.linalg.norm([0.35, 0.3, 0.9])
_SHADOW = 0.6
COLORS = {
    "gray": (87, 87, 87),
    "red": (173, 35, 35),
    "blue": (42, 75, 215),
    "green": (29, 105, 20),
    "brown": (129, 74, 25),
    "cyan": (41, 208, 208),
    "purple": (129, 38, 192),
    "yellow": (235, 218, 51),
}


@dataclass
class Thing:
    """An object of a drawn scene: its path on the plane, frame by frame."""

    shape: str
    color: str
    path: np.ndarray
    yaw: np.ndarray | float = 0.0
    highlight: bool = False


@dataclass
class Stage:
    """A camera and the things before it."""

    things: list[Thing] = field(default_factory=list)
    width: int = 320
    height: int = 240
    focal: float = 420.0
    eye: tuple[float, float, float] = (5.0, -3.0, 4.0)
    target: tuple[float, float, float] = (0.0, 0.0, 0.1)
    floor: float = 165.0
    noise: float = 1.0

    def projection(self) -> np.ndarray:
        """The 3x4 matrix of the camera."""
        eye = np.array(self.eye)
        forward = np.array(self.target) - eye
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, [0, 0, 1])
        right /= np.linalg.norm(right)
        rotation = np.stack([right, np.cross(forward, right), forward])
        intrinsic = np.array([[self.focal, 0, self.width / 2], [0, self.focal, self.height / 2], [0, 0, 1]])
        return intrinsic @ np.column_stack([rotation, -rotation @ eye])

    def frame(self, index: int, rng: np.random.Generator) -> np.ndarray:
        """Draw one frame, RGB."""
        scale = _SUPERSAMPLING
        height, width = self.height * scale, self.width * scale
        rows, columns = np.mgrid[0:height, 0:width]
        away = ((rows / height - 0.55) ** 2 + (columns / width - 0.45) ** 2) * 0.6
        picture = np.repeat((self.floor * (1 - away))[..., None], 3, axis=2)
        present = [thing for thing in self.things if np.isfinite(thing.path[index]).all()]
        shade = np.zeros((height, width), np.uint8)
        for thing in present:
            self._fill(shade, _shadow(_surface(thing, index)), 1)
        picture[shade > 0] *= _SHADOW
        eye = np.array(self.eye)
        for thing in sorted(present, key=lambda item: -np.linalg.norm(eye[:2] - item.path[index])):
            self._draw(picture, thing, index)
        small = cv2.resize(picture, (self.width, self.height), interpolation=cv2.INTER_AREA)
        return np.clip(small + rng.normal(0, self.noise, small.shape), 0, 255).astype(np.uint8)

    def _pixels(self, points: np.ndarray) -> np.ndarray:
        matrix = self.projection()
        homogeneous = points @ matrix[:, :3].T + matrix[:, 3]
        return _SUPERSAMPLING * homogeneous[:, :2] / homogeneous[:, 2:]

    def _fill(self, picture: np.ndarray, points: np.ndarray, color: object) -> None:
        hull = cv2.convexHull((self._pixels(points) - 0.5).astype(np.float32))
        cv2.fillConvexPoly(picture, np.round(hull * 16).astype(np.int32), color, shift=4)

    def _draw(self, picture: np.ndarray, thing: Thing, index: int) -> None:
        base = np.array(COLORS[thing.color], dtype=float)
        centre = np.array([*thing.path[index], RADIUS])
        if thing.shape == "sphere":
            self._sphere(picture, centre, base, highlight=thing.highlight)
        elif thing.shape == "cylinder":
            self._fill(picture, _surface(thing, index), (0.75 * base).tolist())
            self._fill(picture, centre + _ring(RADIUS, RADIUS), base.tolist())
        else:
            corners = _surface(thing, index)
            for axis in range(3):
                for side in (0, 1):
                    face = corners.reshape(2, 2, 2, 3).take(side, axis=axis).reshape(4, 3)
                    normal = face.mean(axis=0) - centre
                    normal /= np.linalg.norm(normal)
                    if normal @ (np.array(self.eye) - face.mean(axis=0)) > 0:
                        self._fill(picture, face, (base * (0.6 + 0.4 * max(0, normal @ _LIGHT))).tolist())

    def _sphere(self, picture: np.ndarray, centre: np.ndarray, base: np.ndarray, *, highlight: bool) -> None:
        """Shade a sphere pixel by pixel along its lines of sight."""
        matrix = self.projection()
        eye = np.array(self.eye)
        middle = self._pixels(centre[None])[0]
        reach = int(1.6 * _SUPERSAMPLING * self.focal * RADIUS / np.linalg.norm(eye - centre))
        left, top = np.maximum(middle - reach, 0).astype(int)
        right, bottom = np.minimum(middle + reach, [picture.shape[1], picture.shape[0]]).astype(int)
        if right <= left or bottom <= top:
            return
        v, u = np.mgrid[top:bottom, left:right] + 0.5
        rays = np.stack([u / _SUPERSAMPLING, v / _SUPERSAMPLING, np.ones_like(u)], -1) @ np.linalg.inv(matrix[:, :3]).T
        rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
        along = rays @ (centre - eye)
        inside = RADIUS**2 - ((centre - eye) @ (centre - eye) - along**2)
        hit = inside > 0
        points = eye + (along - np.sqrt(np.maximum(inside, 0)))[..., None] * rays
        normals = (points - centre) / RADIUS
        colour = base * (0.55 + 0.45 * np.maximum(normals @ _LIGHT, 0))[..., None]
        if highlight:
            halfway = _LIGHT - rays
            halfway /= np.linalg.norm(halfway, axis=-1, keepdims=True)
            colour += 170 * np.maximum((normals * halfway).sum(-1), 0)[..., None] ** 40
        picture[top:bottom, left:right][hit] = np.minimum(colour, 255)[hit]

    def write(self, path: Path, *, seed: int = 0) -> Path:
        """Encode all frames as mp4."""
        rng = np.random.default_rng(seed)
        writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"mp4v"), FRAME_RATE, (self.width, self.height))
        for index in range(len(self.things[0].path) if self.things else 20):
            writer.write(np.ascontiguousarray(self.frame(index, rng)[..., ::-1]))
        writer.release()
        return path


def _ring(radius: float, level: float) -> np.ndarray:
    angle = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.full(60, level)])


def _surface(thing: Thing, index: int) -> np.ndarray:
    """Points in space whose hull is the thing."""
    centre = np.array([*thing.path[index], RADIUS])
    if thing.shape == "sphere":
        rings = [_ring(RADIUS * np.cos(a), RADIUS * np.sin(a)) for a in np.linspace(-1.4, 1.4, 13)]
        return centre + np.concatenate(rings)
    if thing.shape == "cylinder":
        return centre + np.concatenate([_ring(RADIUS, -RADIUS), _ring(RADIUS, RADIUS)])
    yaw = float(np.broadcast_to(thing.yaw, len(thing.path))[index])
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * RADIUS
    turn = np.array([[np.cos(yaw), np.sin(yaw), 0], [-np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    return centre + corners @ turn


def _shadow(points: np.ndarray) -> np.ndarray:
    """Points thrown onto the floor along the light."""
    return points - points[:, 2:] / _LIGHT[2] * _LIGHT


def line(start: tuple[float, float], end: tuple[float, float], frames: int) -> np.ndarray:
    """A straight path at constant speed."""
    share = np.linspace(0, 1, frames)[:, None]
    return (1 - share) * np.array(start) + share * np.array(end)


def resting(place: tuple[float, float], frames: int) -> np.ndarray:
    """A path that stays."""
    return np.tile(np.array(place, dtype=float), (frames, 1))

"""Find the camera from videos of objects whose places on the plane are known.

Blobs are found without a camera; which blob is which object is not told, so a homography is sought that explains as
many known positions as it can. With the camera that follows, the objects' outlines are fitted, which gives their
centres to a fraction of a pixel, and the camera is refined on those.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from vrdp_prob.errors import InputError
from vrdp_prob.perception.appearance import frame_evidence
from vrdp_prob.perception.background import estimate_background
from vrdp_prob.perception.camera_fit import PictureSize, apply_homography, calibrate_camera, fit_homography
from vrdp_prob.perception.placing import Placer
from vrdp_prob.perception.solids import Pose, Solid
from vrdp_prob.perception.video import DEFAULT_FRAME_RATE, read_frames
from vrdp_prob.progress import ProgressDisplay, SilentProgress
from vrdp_prob.scene.body import Body
from vrdp_prob.scene.camera import REST_HEIGHT, Camera
from vrdp_prob.scene.tracks import Tracks
from vrdp_prob.spread import evenly_spread

_FRAMES_PER_VIDEO = 16
_SMALLEST_BLOB = 4e-4
"""Share of the picture below which a blob is not looked at."""
_SAMPLES = 4000
"""Homographies that are tried."""
_CHUNK = 200
_NEAR = 0.03
"""Distance in picture widths within which a blob's middle explains a position."""
_FOLLOWED = 20
"""Homographies that are refined."""
_LEAST_EXPLAINED = 0.35
"""Score per blob that a right homography reaches at least; blobs of several objects match nothing."""
_REFINEMENTS = 2
_YAWS = tuple(np.radians((0.0, 22.5, 45.0, 67.5)))
_LEAST_SUPPORT = 0.75
_ALONE = 3.0
"""Radii between the centres from which neither object hides the other's outline much."""
_FARTHEST = 0.5
"""Radii by which an outline fit may leave the known place."""


@dataclass(frozen=True)
class View:
    """One frame with what is known of it.

    Parameters
    ----------
    picture
        The frame, RGB.
    blobs
        Middles in pixels of the blobs that do not touch the picture's edge.
    positions
        Known places in m of the objects in view.
    bodies
        The objects, in the order of `positions`.
    """

    picture: UInt8[np.ndarray, "height width 3"]
    blobs: Float[np.ndarray, "blob 2"]
    positions: Float[np.ndarray, "object 2"]
    bodies: tuple[Body, ...]


def calibrate_from_videos(
    videos: Sequence[Path],
    known: Sequence[Tracks],
    *,
    seed: int = 0,
    radius: float = REST_HEIGHT,
    progress: ProgressDisplay | None = None,
) -> Camera:
    """Estimate the camera from videos whose objects' positions on the plane are known.

    Parameters
    ----------
    videos
        Videos of one fixed camera, all of one size; the method's authors used 20.
    known
        Positions of the objects in view, one set of tracks per video; time 0 is the first frame. Ids and colours do not
        matter, shapes do.
    seed
        Seed of the search for the first homography.
    radius
        Radius or half side of objects whose radius is not given; centres are at this height, m.
    progress
        Where to tell how far it is.

    Returns
    -------
    Camera
        Its `pixel_sd` is the reprojection error of the objects' centres per pixel coordinate.

    Raises
    ------
    InputError
        If there is no video, a video cannot be used, sizes differ, or no camera explains the positions.
    """
    if not videos or len(videos) != len(known):
        raise InputError(
            f"calibration: {len(videos)} videos and {len(known)} sets of positions; give one set for each of at least "
            "one video."
        )
    display = progress or SilentProgress()
    views: list[View] = []
    size: PictureSize | None = None
    with display.stage("Reading videos", len(videos)) as advance:
        for path, tracks in zip(videos, known, strict=True):
            size = _read(path, tracks, size, views)
            advance(1)
    assert size is not None  # there is at least one video
    positions, pixels = _first_matches(views, size, np.random.default_rng(seed))
    camera = calibrate_camera(positions, pixels, radius, size)
    with display.stage("Refining the camera", _REFINEMENTS) as advance:
        for _ in range(_REFINEMENTS):
            positions, pixels = _outline_matches(views, camera, radius)
            camera = calibrate_camera(positions, pixels, radius, size)
            advance(1)
    return camera


def _read(path: Path, tracks: Tracks, size: PictureSize | None, views: list[View]) -> PictureSize:
    """Add views of some frames of a video; all videos must have one size."""
    video = read_frames(path)
    height, width = video.frames.shape[1:3]
    if size is not None and (width, height) != (size.width, size.height):
        raise InputError(
            f"{path}: the video is {width}x{height} pixels but others are {size.width}x{size.height}; "
            "calibrate with videos of one camera."
        )
    rate = tracks.frame_rate or video.frame_rate or DEFAULT_FRAME_RATE
    frame_of = np.rint(tracks.times * rate).astype(int)
    usable = np.nonzero(tracks.seen.any(axis=1) & (frame_of < len(video.frames)))[0]
    if len(usable) == 0:
        raise InputError(f"{path}: no known position falls into the video; check that times and video belong together.")
    background = estimate_background(video.frames)
    chosen = usable[evenly_spread(_FRAMES_PER_VIDEO, len(usable))]
    for index in chosen:
        picture = video.frames[frame_of[index]]
        seen = tracks.seen[index]
        bodies = tuple(body for body, visible in zip(tracks.bodies, seen, strict=True) if visible)
        blobs = _blobs(frame_evidence(picture, background).strange)
        views.append(View(picture.copy(), blobs, tracks.positions[index][seen], bodies))
    return PictureSize(width, height, video.frame_rate)


def _blobs(strange: Bool[np.ndarray, "height width"]) -> Float[np.ndarray, "blob 2"]:
    """Middles of the connected patches that do not touch the picture's edge."""
    height, width = strange.shape
    _, _, statistics, middles = cv2.connectedComponentsWithStats(strange.astype(np.uint8), connectivity=8)
    left, top, across, down, area = statistics[1:].T
    inside = (left > 0) & (top > 0) & (left + across < width) & (top + down < height)
    return middles[1:][inside & (area >= _SMALLEST_BLOB * height * width)] + 0.5


@dataclass(frozen=True)
class _Puzzle:
    """Known places and blobs of all views, padded with values that match nothing; `near` is in pixels."""

    positions: Float[np.ndarray, "view object 2"]
    blobs: Float[np.ndarray, "view blob 2"]
    near: float

    @classmethod
    def of(cls, views: Sequence[View], size: PictureSize) -> "_Puzzle":
        positions = np.full((len(views), max(len(view.bodies) for view in views), 2), np.nan)
        blobs = np.full((len(views), max(len(view.blobs) for view in views), 2), np.nan)
        for index, view in enumerate(views):
            positions[index, : len(view.bodies)] = view.positions
            blobs[index, : len(view.blobs)] = view.blobs
        return cls(positions, blobs, _NEAR * size.width)

    def distances(
        self, homographies: Float[np.ndarray, "homography 3 3"]
    ) -> Float[np.ndarray, "homography view object blob"]:
        """Pixels between every blob and every place of its view; infinite for what is no view from above."""
        flat = self.positions.reshape(-1, 2)
        with np.errstate(all="ignore"):
            homogeneous = apply_homography(homographies, flat)
            depth = homogeneous[..., 2]
            # seen from above, turning left stays turning left, which pixels counted downward reverse
            above = (np.linalg.det(homographies)[:, None] / depth**3 < 0) | np.isnan(depth)
            pixels = (homogeneous[..., :2] / depth[..., None]).reshape(len(homographies), *self.positions.shape)
            distance = np.linalg.norm(pixels[:, :, :, None] - self.blobs[None, :, None], axis=-1)
        return np.where(np.isfinite(distance) & above.all(axis=1)[:, None, None, None], distance, np.inf)

    def score(self, homographies: Float[np.ndarray, "homography 3 3"]) -> Float[np.ndarray, "homography"]:
        """How many blobs have a place near, the nearer the better; a blob counts once."""
        nearest = self.distances(homographies).min(axis=2)
        return np.clip(1 - nearest / self.near, 0, None).sum(axis=(1, 2))

    def matches(
        self, homography: Float[np.ndarray, "3 3"], near: float
    ) -> tuple[Float[np.ndarray, "match 2"], Float[np.ndarray, "match 2"]]:
        """Places and blobs that are each other's nearest."""
        distance = self.distances(homography[None])[0]
        mutual = (distance == distance.min(axis=1, keepdims=True)) & (distance == distance.min(axis=2, keepdims=True))
        view, item, blob = np.nonzero(mutual & (distance < near))
        return self.positions[view, item], self.blobs[view, blob]


def _first_matches(
    views: Sequence[View], size: PictureSize, rng: np.random.Generator
) -> tuple[Float[np.ndarray, "match 2"], Float[np.ndarray, "match 2"]]:
    """Places and blob middles that one homography brings together."""
    pairs = np.array(
        [(v, o, b) for v, view in enumerate(views) for o in range(len(view.bodies)) for b in range(len(view.blobs))]
    )
    if len(pairs) < 4:
        raise InputError("calibration: no object stands out from the floor in the videos; give videos with objects.")
    puzzle = _Puzzle.of(views, size)
    candidates, scores = _random_homographies(puzzle, pairs, rng)
    best, most = candidates[0], -1.0
    for index in np.argsort(-scores)[:_FOLLOWED]:
        homography = candidates[index]
        for near in (puzzle.near, puzzle.near, puzzle.near / 2):
            positions, pixels = puzzle.matches(homography, near)
            if len(positions) < 4:
                break
            homography = fit_homography(positions, pixels)
        score = float(puzzle.score(homography[None])[0])
        if score > most:
            best, most = homography, score
    if most < _LEAST_EXPLAINED * np.isfinite(puzzle.blobs[..., 0]).sum():
        raise InputError(
            "calibration: the known positions do not match what the videos show; check that they belong together."
        )
    return puzzle.matches(best, puzzle.near / 2)


def _random_homographies(
    puzzle: _Puzzle, pairs: Int[np.ndarray, "pair 3"], rng: np.random.Generator
) -> tuple[Float[np.ndarray, "homography 3 3"], Float[np.ndarray, "homography"]]:
    """Homographies through four random pairs of place and blob, and their scores."""
    choices = np.bincount(pairs[:, 0])[pairs[:, 0]]
    picked = rng.choice(len(pairs), size=(_SAMPLES, 4), p=(1 / choices) / (1 / choices).sum())
    source = puzzle.positions[pairs[:, 0], pairs[:, 1]][picked]
    target = puzzle.blobs[pairs[:, 0], pairs[:, 2]][picked]
    with np.errstate(all="ignore"):
        homographies = fit_homography(source, target)
    usable = np.isfinite(homographies).all(axis=(1, 2))
    homographies = np.where(usable[:, None, None], homographies, np.eye(3))
    scores = [puzzle.score(homographies[start : start + _CHUNK]) for start in range(0, _SAMPLES, _CHUNK)]
    return homographies, np.concatenate(scores) * usable


def _outline_matches(
    views: Sequence[View], camera: Camera, radius: float
) -> tuple[Float[np.ndarray, "match 2"], Float[np.ndarray, "match 2"]]:
    """Known positions and the pixels of the centres that the outlines give, for objects that stand alone."""
    placer = Placer(camera)
    positions, pixels = [], []
    for view in views:
        free = np.zeros(view.picture.shape[:2], np.uint8)
        for index, body in enumerate(view.bodies):
            distances = np.linalg.norm(view.positions - view.positions[index], axis=1)
            size = body.radius or radius
            if (np.delete(distances, index) < _ALONE * size).any():
                continue
            solid, (x, y) = Solid(body.shape, size), view.positions[index]
            start = Pose(float(x), float(y))
            fits = [placer.refine_picture(view.picture, solid, start.moved(0, 0, yaw), free) for yaw in _yaws(solid)]
            good = [fit for fit in fits if fit is not None and fit.support >= _LEAST_SUPPORT]
            if not good:
                continue
            pose = min(good, key=lambda fit: fit.misfit).pose
            if np.hypot(pose.x - x, pose.y - y) < _FARTHEST * size:
                positions.append((x, y))
                pixels.append(camera.project(np.array([pose.x, pose.y, size])))
    return np.array(positions).reshape(-1, 2), np.array(pixels).reshape(-1, 2)


def _yaws(solid: Solid) -> tuple[float, ...]:
    return (0.0,) if solid.shape.is_disc else _YAWS

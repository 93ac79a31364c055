"""The whole way from a video file to measured tracks."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from vrdp_prob.errors import InputError
from vrdp_prob.perception.attributes import (
    Look,
    color_probabilities,
    look,
    material_probabilities,
    shape_probabilities,
)
from vrdp_prob.perception.crops import Crops, cut_crops
from vrdp_prob.perception.noise import position_covariance
from vrdp_prob.perception.placing import Track
from vrdp_prob.perception.tracking import Tracker
from vrdp_prob.perception.video import DEFAULT_FRAME_RATE, Video, read_frames
from vrdp_prob.perception.views import View, best_views, inner_pixels
from vrdp_prob.progress import ProgressDisplay
from vrdp_prob.scene.body import Body, Shape
from vrdp_prob.scene.camera import REST_HEIGHT, Camera
from vrdp_prob.scene.tracks import Tracks

CERTAIN = 0.97
"""Probability from which an attribute is taken for certain."""
_LARGEST_SD = 0.1
"""Metres of standard deviation from which a position is no measurement but a guess, and the row is left out."""
_LEAST_MOTION = 0.05
"""Metres that an object must travel to count as moving."""
_FEWEST_PIXELS = 30
_FEWEST_ROWS = 2


@dataclass(frozen=True)
class SeenObjects:
    """What was measured in a video, and what its objects look like.

    Parameters
    ----------
    tracks
        Positions and attributes.
    crops
        Small pictures of each object, in the order of the tracks' bodies.
    """

    tracks: Tracks
    crops: tuple[Crops, ...]


@dataclass(frozen=True)
class _Measured:
    """Tracks, and where each of their objects shows best."""

    tracks: Tracks
    tracker: Tracker
    views: tuple[tuple[Track, list[View]], ...]


def read_video(
    path: Path,
    camera: Camera,
    *,
    frames: int | None = None,
    radius: float = REST_HEIGHT,
    progress: ProgressDisplay | None = None,
) -> Tracks:
    """Measure the objects of a video.

    Parameters
    ----------
    path
        Video of a fixed camera, in any format that OpenCV reads.
    camera
        The camera that took it; its `pixel_sd` enters the positions' covariance.
    frames
        Read only so many frames from the start; None reads all.
    radius
        Radius of spheres and cylinders and half side of cubes, in m; objects rest on the floor z = 0.
    progress
        Where to tell how far it is.

    Returns
    -------
    Tracks
        Position of every object in the frames that show it with its centre in the picture, covariance of each position,
        yaw of cubes, and the attributes with probabilities where they are not certain.

    Raises
    ------
    InputError
        If the file is no usable video, its pictures have another size than the camera's, or no object moves in it.
    """
    return _measured(path, camera, frames, radius, progress).tracks


def see_video(
    path: Path,
    camera: Camera,
    *,
    frames: int | None = None,
    radius: float = REST_HEIGHT,
    progress: ProgressDisplay | None = None,
) -> SeenObjects:
    """Measure the objects of a video and cut out their pictures; parameters and refusals are those of `read_video`."""
    measured = _measured(path, camera, frames, radius, progress)
    crops = tuple(cut_crops(measured.tracker, track, views) for track, views in measured.views)
    return SeenObjects(measured.tracks, crops)


def _measured(
    path: Path, camera: Camera, frames: int | None, radius: float, progress: ProgressDisplay | None
) -> _Measured:
    video = read_frames(path, frames=frames, progress=progress)
    check_size(path, video, camera)
    tracker = Tracker(video.frames, camera, radius)
    found = [track for track in tracker.run(progress) if track.sightings]
    found.sort(key=lambda track: (min(track.sightings), track.number))
    rate = camera.frame_rate or video.frame_rate or DEFAULT_FRAME_RATE
    arrays = [_arrays(track, camera, len(video.frames)) for track in found]
    kept = [index for index, rows in enumerate(arrays) if np.isfinite(rows[:, 0]).sum() >= _FEWEST_ROWS]
    if not kept:
        raise InputError(
            f"{path}: no object can be seen in the video; check that it shows objects and fits the camera."
        )
    table = np.stack([arrays[index] for index in kept], axis=1)
    if not _moves(table[..., :2]):
        raise InputError(f"{path}: no object moves in the video; give one in which objects move.")
    views = tuple((found[index], best_views(tracker, found, found[index])) for index in kept)
    bodies = tuple(
        _body(str(number), track, _looks(tracker, track, own), radius) for number, (track, own) in enumerate(views)
    )
    cubes = np.array([body.shape is Shape.CUBE for body in bodies])
    tracks = Tracks.from_arrays(
        video.name,
        bodies,
        np.arange(len(video.frames)) / rate,
        table[..., :2],
        angles=np.where(cubes, table[..., 2], np.nan) if cubes.any() else None,
        position_covariance=table[..., 3:].reshape(*table.shape[:2], 2, 2),
        camera=camera,
    )
    return _Measured(tracks, tracker, views)


def check_size(path: Path, video: Video, camera: Camera) -> None:
    """Refuse pictures that are not the camera's.

    Raises
    ------
    InputError
        If the sizes differ.
    """
    height, width = video.frames.shape[1:3]
    if (width, height) != (camera.width, camera.height):
        raise InputError(
            f"{path}: the video is {width}x{height} pixels but the camera's picture is {camera.width}x{camera.height}; "
            "give the camera of this video or scale the video."
        )


def _arrays(track: Track, camera: Camera, count: int) -> Float[np.ndarray, "frame 7"]:
    """Rows of x, y, yaw and the covariance; NaN where there is no measurement."""
    rows = np.full((count, 7), np.nan)
    scatters = [sighting.contour.scale for sighting in track.sightings.values() if sighting.contour is not None]
    typical = float(np.median(scatters)) if scatters else 0.0
    for frame, sighting in track.sightings.items():
        place = np.array([sighting.pose.x, sighting.pose.y])
        covariance = position_covariance(camera, track.solid, sighting, typical)
        if covariance is None or float(np.linalg.eigvalsh(covariance)[-1]) > _LARGEST_SD**2:
            continue
        if bool(camera.in_view(place, track.radius)):
            rows[frame] = (*place, sighting.pose.yaw, *np.ravel(covariance))
    return rows


def _moves(positions: Float[np.ndarray, "frame body 2"]) -> bool:
    low, high = np.nanmin(positions, axis=0), np.nanmax(positions, axis=0)
    return bool((np.linalg.norm(high - low, axis=-1) > _LEAST_MOTION).any())


def _looks(tracker: Tracker, track: Track, views: Sequence[View]) -> list[Look]:
    pixels = [inner_pixels(tracker, track, view) for view in views]
    return [look(*sample) for sample in pixels if len(sample[0]) >= _FEWEST_PIXELS]


def _body(name: str, track: Track, looks: Sequence[Look], radius: float) -> Body:
    shapes = shape_probabilities(track.shape_scores, track.shape_frames)
    unsure: dict[str, Mapping[str, float]] = {}
    if max(shapes.values()) < CERTAIN:
        unsure["shape"] = {str(shape): value for shape, value in shapes.items()}
    best: dict[str, str | None] = {"color": None, "material": None}
    if looks:
        attributes = {
            "color": color_probabilities(looks),
            "material": material_probabilities(looks, track.shape),
        }
        for attribute, probabilities in attributes.items():
            best[attribute] = max(probabilities, key=lambda value: probabilities[value])
            if max(probabilities.values()) < CERTAIN:
                unsure[attribute] = probabilities
    return Body(
        name,
        track.shape,
        radius,
        material=best["material"],
        color=best["color"],
        attribute_probabilities=unsure,
    )

"""Tracks folders: `tracks.csv`, `objects.csv` and optionally `walls.csv`, `camera.json`.

`tracks.csv` has the columns `video,object,time,x,y[,angle]` in s, m and rad; a missing observation is a missing row.
`objects.csv` has `video,object,shape,radius[,mass,inertia,material,color]`; `walls.csv` has
`video,x1,y1,x2,y2,restitution`, where `video` may be `*` for all videos and an empty restitution is unknown.
"""

import csv
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Float

from vrdp_prob.datasets.tables import Row, read_rows
from vrdp_prob.errors import InputError
from vrdp_prob.files import write_atomically
from vrdp_prob.scene import Body, Camera, Shape, Tracks, Wall

TRACK_COLUMNS = ("video", "object", "time", "x", "y")
OBJECT_COLUMNS = ("video", "object", "shape", "radius")
WALL_COLUMNS = ("video", "x1", "y1", "x2", "y2")
ALL_VIDEOS = "*"
TIME_DECIMALS = 9
ROUNDING = 1e-3
"""Share of the shortest step of any object below which stamps of two objects are those of one frame."""


@dataclass
class _Measurements:
    """Rows of one object of one video, in the order of the file."""

    times: list[float] = field(default_factory=list)
    positions: list[tuple[float, float]] = field(default_factory=list)
    angles: list[float] = field(default_factory=list)


def video_names(folder: Path) -> list[str]:
    """Names of the videos of a tracks folder, in the order in which they first appear."""
    return list(_read_measurements(folder / "tracks.csv"))


def read_folder(
    folder: Path | str, *, videos: Sequence[str] | None = None, camera: Camera | None = None
) -> list[Tracks]:
    """Tracks of the videos of a folder.

    Parameters
    ----------
    folder
        Folder with `tracks.csv` and `objects.csv`, optionally `walls.csv`.
    videos
        Names of the videos to return, all by default.
    camera
        The camera of all videos; the folder's `camera.json` by default, where there is one.

    Raises
    ------
    InputError
        With file, row and column, if a table is unusable or a named video is not there.
    """
    folder = Path(folder)
    measurements = _read_measurements(folder / "tracks.csv")
    bodies = _read_bodies(folder / "objects.csv")
    for video, object_id in bodies:
        if object_id not in measurements.get(video, {}):
            raise InputError(
                f"{folder / 'objects.csv'}: object {object_id} of video {video} has no row in tracks.csv; "
                "correct its name or take its row out."
            )
    walls = _read_walls(folder / "walls.csv", list(measurements))
    if camera is None and (folder / "camera.json").is_file():
        camera = Camera.read(folder / "camera.json")
    names = chosen(folder, list(measurements), videos)
    return [
        _tracks(folder, name, measurements[name], bodies, walls=walls[ALL_VIDEOS] + walls[name], camera=camera)
        for name in names
    ]


def write_folder(folder: Path | str, videos: Iterable[Tracks]) -> None:
    """Write tracks as a tracks folder that `read_folder` reads; the camera of the first video becomes `camera.json`.

    Raises
    ------
    InputError
        If the folder cannot be written.
    """
    folder, videos = Path(folder), list(videos)
    with_angle = any(tracks.angles is not None for tracks in videos)
    track_rows: list[Sequence[object]] = [TRACK_COLUMNS + (("angle",) if with_angle else ())]
    object_rows: list[Sequence[object]] = [(*OBJECT_COLUMNS, "mass", "inertia", "material", "color")]
    wall_rows: list[Sequence[object]] = [(*WALL_COLUMNS, "restitution")]
    for tracks in videos:
        track_rows += _track_rows(tracks, with_angle=with_angle)
        object_rows += [
            (tracks.video, body.id, body.shape.value, body.radius, body.mass, body.inertia, body.material, body.color)
            for body in tracks.bodies
        ]
        wall_rows += [(tracks.video, wall.x1, wall.y1, wall.x2, wall.y2, wall.restitution) for wall in tracks.walls]
    _write_rows(folder / "tracks.csv", track_rows)
    _write_rows(folder / "objects.csv", object_rows)
    if len(wall_rows) > 1:
        _write_rows(folder / "walls.csv", wall_rows)
    camera = next((tracks.camera for tracks in videos if tracks.camera is not None), None)
    if camera is not None:
        camera.write(folder / "camera.json")


def _read_measurements(path: Path) -> dict[str, dict[str, _Measurements]]:
    videos: dict[str, dict[str, _Measurements]] = defaultdict(lambda: defaultdict(_Measurements))
    for row in read_rows(path, TRACK_COLUMNS):
        measured = videos[row.text("video")][row.text("object")]
        time = round(row.number_in("time"), TIME_DECIMALS)
        if measured.times and time <= measured.times[-1]:
            problem = "is there twice" if time == measured.times[-1] else "comes after a later one"
            raise InputError(
                f"{row.place}: time {time:g} of object {row.text('object')} {problem}; "
                "sort the rows by time, one per frame."
            )
        angle = row.optional_number("angle")
        measured.times.append(time)
        measured.positions.append((row.number_in("x"), row.number_in("y")))
        measured.angles.append(np.nan if angle is None else angle)
    if not videos:
        raise InputError(f"{path}: there are 0 objects; give tracks of at least one.")
    return {video: dict(objects) for video, objects in videos.items()}


def _read_bodies(path: Path) -> dict[tuple[str, str], Body]:
    bodies: dict[tuple[str, str], Body] = {}
    for row in read_rows(path, OBJECT_COLUMNS):
        key = row.text("video"), row.text("object")
        if key in bodies:
            raise InputError(f"{row.place}: object {key[1]} of video {key[0]} is there twice; keep one row.")
        try:
            bodies[key] = Body(
                id=key[1],
                shape=_shape(row),
                radius=row.optional_number("radius"),
                mass=row.optional_number("mass"),
                inertia=row.optional_number("inertia"),
                material=row.optional_text("material"),
                color=row.optional_text("color"),
            )
        except InputError as error:
            message = str(error)
            raise InputError(message if message.startswith(str(path)) else f"{row.place}: {message}") from error
    return bodies


def _shape(row: Row) -> Shape:
    name = row.text("shape")
    try:
        return Shape.named(name)
    except InputError as error:
        raise InputError(f"{row.place}: {error}") from error


def _read_walls(path: Path, videos: Sequence[str]) -> dict[str, tuple[Wall, ...]]:
    walls: dict[str, tuple[Wall, ...]] = defaultdict(tuple)
    if path.is_file():
        for row in read_rows(path, WALL_COLUMNS):
            x1, y1, x2, y2 = (row.number_in(column) for column in ("x1", "y1", "x2", "y2"))
            try:
                wall = Wall(x1, y1, x2, y2, row.optional_number("restitution"))
            except InputError as error:
                raise InputError(f"{row.place}: {error}") from error
            video = row.text("video")
            if video not in (ALL_VIDEOS, *videos):
                raise InputError(
                    f"{row.place}: tracks.csv has no video '{video}'; the videos are {some(videos)}, and "
                    f"{ALL_VIDEOS} means all."
                )
            walls[video] += (wall,)
    return walls


def _tracks(
    folder: Path,
    video: str,
    measurements: dict[str, _Measurements],
    bodies: dict[tuple[str, str], Body],
    *,
    walls: tuple[Wall, ...],
    camera: Camera | None,
) -> Tracks:
    for object_id in measurements:
        if (video, object_id) not in bodies:
            raise InputError(
                f"{folder / 'objects.csv'}: object {object_id} of video {video} has tracks but no row; "
                "add one with its shape."
            )
    times = _frames([measured.times for measured in measurements.values()])
    positions = np.full((len(times), len(measurements), 2), np.nan)
    angles = np.full((len(times), len(measurements)), np.nan)
    for index, measured in enumerate(measurements.values()):
        frames = np.searchsorted((times[1:] + times[:-1]) / 2, measured.times)
        positions[frames, index] = measured.positions
        angles[frames, index] = measured.angles
    return Tracks.from_arrays(
        video,
        tuple(bodies[video, object_id] for object_id in measurements),
        times,
        positions,
        angles=angles if np.isfinite(angles).any() else None,
        walls=walls,
        camera=camera,
    )


def _frames(stamps: Sequence[Sequence[float]]) -> Float[np.ndarray, "frame"]:
    """Times in s of the frames of some objects; stamps that differ by their rounding alone are one frame."""
    times = np.unique(np.concatenate(stamps))
    steps = [float(np.diff(one).min()) for one in stamps if len(one) > 1]
    gaps = np.diff(times, prepend=-np.inf)
    return times[gaps > ROUNDING * min(steps, default=0.0)]


def _track_rows(tracks: Tracks, *, with_angle: bool) -> list[Sequence[object]]:
    rows: list[Sequence[object]] = []
    angles = tracks.angles
    for index, body in enumerate(tracks.bodies):
        for frame in np.flatnonzero(tracks.seen[:, index]):
            x, y = tracks.positions[frame, index]
            row: tuple[str, ...] = (tracks.video, body.id, _in_seconds(tracks.times[frame]), f"{x:.9g}", f"{y:.9g}")
            if with_angle:
                angle = np.nan if angles is None else angles[frame, index]
                row += (f"{angle:.9g}" if np.isfinite(angle) else "",)
            rows.append(row)
    return rows


def _in_seconds(time: float) -> str:
    """A time as a table has it: to the nanosecond, however long ago its zero was."""
    return np.format_float_positional(round(float(time), TIME_DECIMALS), trim="-")


def _write_rows(path: Path, rows: Sequence[Sequence[object]]) -> None:
    with write_atomically(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows(["" if cell is None else cell for cell in row] for row in rows)


def chosen(source: Path | str, names: Sequence[str], asked: Sequence[str] | None) -> list[str]:
    """Names of the videos that are asked for, all where None.

    Raises
    ------
    InputError
        If one of them is not there.
    """
    for name in asked or ():
        if name not in names:
            raise InputError(f"{source}: there is no video '{name}'; the videos are {some(names)}.")
    return list(names if asked is None else asked)


def some(names: Sequence[str]) -> str:
    """The first few of many names, for a sentence."""
    shown = ", ".join(names[:6])
    return shown if len(names) <= 6 else f"{shown}, ... ({len(names)} in all)"

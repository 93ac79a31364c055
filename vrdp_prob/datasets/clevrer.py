"""CLEVRER's own files: annotations of a video, and questions with programs (Yi et al., ICLR 2020).

Of an annotation only positions and the yaw of cubes inside the picture become measurements; velocities, collisions and
positions out of view stay for scoring.
"""

import json
from collections.abc import Mapping, Sized
from pathlib import Path
from typing import Any

import numpy as np

from vrdp_prob.datasets.question_entry import check_ids, in_short, question_of
from vrdp_prob.errors import InputError
from vrdp_prob.scene import Body, Camera, Question, Shape, Tracks
from vrdp_prob.scene.camera import REST_HEIGHT

FRAME_RATE = 25.0
"""Frames per second of CLEVRER's videos."""

Document = Mapping[str, Any]


def read_json(path: Path | str) -> Any:
    """Content of a JSON file.

    Raises
    ------
    InputError
        If the file cannot be read or is not JSON.
    """
    try:
        return json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: the file cannot be read ({error.strerror}); check the path.") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not a JSON file (it is not text); check that it is the right one.") from error
    except RecursionError as error:
        raise InputError(f"{path}: not a JSON file of this tool (it is nested too deeply); check it.") from error
    except ValueError as error:
        raise InputError(f"{path}: not a JSON file ({error}); check that it is whole.") from error


def annotated_video(path: Path) -> str:
    """Name of the video of an annotation file: the stem of its `video_filename`, else of the file itself."""
    document = read_json(path)
    name = document.get("video_filename") if isinstance(document, dict) else None
    return Path(str(name)).stem if name else path.stem


def read_annotation(path: Path | str, *, camera: Camera | None = None) -> Tracks:
    """Tracks of a CLEVRER annotation file.

    Parameters
    ----------
    path
        JSON file with `object_property` and `motion_trajectory`.
    camera
        The camera of the video, where it is known.

    Raises
    ------
    InputError
        If the file is not such a document, an object has an unknown shape, or none is ever in view.
    """
    document = read_json(path)
    try:
        properties = document["object_property"]
        frames = document["motion_trajectory"]
        video = Path(document["video_filename"]).stem
        check_ids(str(path), "object_id", [entry["object_id"] for entry in properties])
        index = {entry["object_id"]: number for number, entry in enumerate(properties)}
        positions = np.full((len(frames), len(properties), 2), np.nan)
        yaw = np.full((len(frames), len(properties)), np.nan)
        for number, frame in enumerate(frames):
            for entry in frame["objects"]:
                if entry["inside_camera_view"]:
                    positions[number, index[entry["object_id"]]] = entry["location"][:2]
                    yaw[number, index[entry["object_id"]]] = entry["orientation"][2]
        bodies = [_body(path, entry) for entry in properties]
        times = np.array([frame["frame_id"] for frame in frames]) / (
            camera.frame_rate if camera is not None and camera.frame_rate else FRAME_RATE
        )
    except (KeyError, TypeError, IndexError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        reason = f"there is no {error}" if isinstance(error, KeyError) else "a field is of another form"
        raise InputError(
            f"{path}: not a CLEVRER annotation ({reason}); "
            "it needs 'object_property', 'motion_trajectory' and 'video_filename'."
        ) from error
    seen_twice = np.isfinite(positions[..., 0]).sum(axis=0) >= 2
    kept = tuple(body for body, seen in zip(bodies, seen_twice, strict=True) if seen)
    cube = np.array([body.shape is Shape.CUBE for body in kept], dtype=bool)
    angles = _unwrapped(np.where(cube, yaw[:, seen_twice], np.nan))
    return Tracks.from_arrays(
        video,
        kept,
        times,
        positions[:, seen_twice],
        angles=angles if cube.any() else None,
        camera=camera,
    )


def read_questions(path: Path | str) -> dict[str, list[Question]]:
    """Questions of a CLEVRER question file by the stem of their video's file name.

    Raises
    ------
    InputError
        If the file is not such a document, or holds no question.
    """
    questions: dict[str, list[Question]] = {}
    for name, scene in _scenes(path):
        several = [question_of(f"{path}, {name}", entry) for entry in scene["questions"]]
        check_ids(f"{path}, {name}", "question_id", [question.question_id for question in several])
        questions.setdefault(name, []).extend(several)
    if not any(questions.values()):
        raise InputError(f"{path}: the file holds no question; give at least one.")
    return questions


def scene_indices(path: Path | str) -> dict[str, int]:
    """`scene_index` of each video of a CLEVRER question file, its place in the file where none is stated.

    Raises
    ------
    InputError
        If the file is not such a document, or an index is no number.
    """
    indices: dict[str, int] = {}
    for place, (name, scene) in enumerate(_scenes(path)):
        index = scene.get("scene_index", place)
        if not isinstance(index, int):
            raise InputError(f"{path}, {name}: 'scene_index' is {index!r}; it must be a whole number.")
        indices.setdefault(name, index)
    return indices


def questions_about(path: Path | str, scenes: tuple[int, int] | None) -> dict[str, list[Question]]:
    """Questions of a CLEVRER question file about some of its scenes, by the names of the videos.

    Parameters
    ----------
    path
        The file.
    scenes
        First `scene_index` and the one after the last; all where None.

    Raises
    ------
    InputError
        If the file cannot be read; see `read_questions` and `scene_indices`.
    """
    index = scene_indices(path)
    wanted = range(*scenes) if scenes is not None else index.values()
    return {name: several for name, several in read_questions(path).items() if index[name] in wanted}


def check_scenes(path: Path | str, scenes: tuple[int, int] | None, found: Sized) -> None:
    """Refuse scenes of which a question file has none, telling which it has.

    Raises
    ------
    InputError
        If nothing was found of them.
    """
    if not found:
        index = scene_indices(path)
        first, last = min(index.values()), max(index.values())
        wanted = "" if scenes is None else f" from {scenes[0]} to {scenes[1] - 1}"
        raise InputError(f"{path}: no scene{wanted} is in the file, which holds {first} to {last}.")


def _scenes(path: Path | str) -> list[tuple[str, Document]]:
    """Entries of a question file with the stems of their videos."""
    document = read_json(path)
    found = []
    for number, scene in enumerate(document if isinstance(document, list) else [document], start=1):
        problem = _problem_of_scene(scene)
        if problem is not None:
            raise InputError(
                f"{path}: not a CLEVRER question file (scene {number} {problem}); "
                "every scene needs 'video_filename', a text, and 'questions', a list."
            )
        found.append((Path(scene["video_filename"]).stem, scene))
    return found


def _problem_of_scene(scene: object) -> str | None:
    """What is wrong with an entry of a question file; None where nothing is."""
    if not isinstance(scene, dict):
        return f"is {in_short(scene)}"
    for name, kind in (("video_filename", str), ("questions", list)):
        if name not in scene:
            return f"has no '{name}'"
        if not isinstance(scene[name], kind):
            return f"has {in_short(scene[name])} for '{name}'"
    return None


def _body(path: Path | str, entry: Document) -> Body:
    identity = str(entry["object_id"])
    try:
        shape = Shape(entry["shape"])
    except ValueError as error:
        raise InputError(
            f"{path}: object {identity} has the unknown shape '{entry['shape']}'; use sphere, cube or cylinder."
        ) from error
    try:
        return Body(identity, shape, radius=REST_HEIGHT, material=entry.get("material"), color=entry.get("color"))
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _unwrapped(angles: np.ndarray) -> np.ndarray:
    """Angles (time, body) made continuous in time, gaps aside."""
    result = angles.copy()
    for column in result.T:
        measured = np.isfinite(column)
        column[measured] = np.unwrap(column[measured])
    return result

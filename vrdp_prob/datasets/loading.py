"""One door for every input: a video, a tracks folder, a CLEVRER annotation, or a folder of videos or annotations."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from vrdp_prob.datasets import folder as folders
from vrdp_prob.datasets.clevrer import annotated_video, read_annotation
from vrdp_prob.errors import InputError
from vrdp_prob.progress import ProgressDisplay
from vrdp_prob.scene import Camera, Tracks

CameraChoice = Camera | Path | str | None
Recogniser = Callable[[Any], Tracks]
"""Tracks with attributes from what perception saw of a video (`vrdp_prob.perception.SeenObjects`)."""
CAMERA_FILE = "camera.json"
TRACKS_FILE = "tracks.csv"
CLEVRER = "clevrer"
VIDEO_SUFFIXES = (".avi", ".m4v", ".mkv", ".mov", ".mp4", ".mpg", ".webm")
ANNOTATION_PATTERN = "annotation*.json"


def load(
    path: Path | str,
    *,
    video: str | None = None,
    camera: CameraChoice = None,
    recognise: Recogniser | None = None,
    progress: ProgressDisplay | None = None,
) -> Tracks:
    """Tracks of one video.

    Parameters
    ----------
    path
        A video file, a tracks folder (or its `tracks.csv`), a CLEVRER annotation file, or a folder of videos or of
        annotations.
    video
        Which video of a folder of several.
    camera
        A camera, the path of a camera file, or `"clevrer"` for the camera of that data set. By default `camera.json`
        beside the file or in its parent folder (of a tracks folder: in it). Only a video needs one.
    recognise
        What gives the objects of a video their attributes, learned concepts for example; perception's rules where None.
    progress
        Who follows the work on a video file.

    Raises
    ------
    InputError
        If the input cannot be used, a folder holds several videos and none is named, a video has no camera, or there is
        no video for `recognise` to look at.
    """
    names = video_names(path)
    if video is None and len(names) > 1:
        raise InputError(f"{path}: the folder holds {len(names)} videos; choose one (--video {names[0]}, say).")
    chosen = None if video is None else [video]
    return load_all(path, videos=chosen, camera=camera, recognise=recognise, progress=progress)[0]


def load_all(
    path: Path | str,
    *,
    videos: Sequence[str] | None = None,
    camera: CameraChoice = None,
    recognise: Recogniser | None = None,
    progress: ProgressDisplay | None = None,
) -> list[Tracks]:
    """Tracks of the named videos (all by default) of an input; parameters as for `load`."""
    source = _existing(path)
    if recognise is not None and has_tracks(source):
        raise InputError(
            f"{path}: learned concepts look at videos, and this holds positions; give videos, or leave --concepts out."
        )
    if _is_tracks_folder(source):
        folder = source if source.is_dir() else source.parent
        return folders.read_folder(folder, videos=videos, camera=find_camera(folder, camera))
    files = _annotation_files(source) or video_files(source)
    names = folders.chosen(path, list(files), videos)
    return [_load_file(files[name], camera, recognise, progress) for name in names]


def video_names(path: Path | str, videos: Sequence[str] | None = None) -> list[str]:
    """Names of the named videos (all by default) of an input, in the order in which `load_all` returns them.

    Raises
    ------
    InputError
        If there is no input, or no such video in it.
    """
    source = _existing(path)
    if _is_tracks_folder(source):
        names = folders.video_names(source if source.is_dir() else source.parent)
    else:
        names = list(_annotation_files(source) or video_files(source))
    return folders.chosen(path, names, videos)


def has_tracks(path: Path | str) -> bool:
    """Whether an input states positions, as a tracks folder or annotations do, rather than films."""
    source = _existing(path)
    return _is_tracks_folder(source) or bool(_annotation_paths(source))


def video_files(path: Path | str) -> dict[str, Path]:
    """Video files by their stem: the file itself, or those of a folder or of its sub-folder `videos`.

    Raises
    ------
    InputError
        If two have the same stem.
    """
    source = Path(path)
    return _by_name({file: file.stem for file in _video_paths(source)})


def pictures(path: Path | str) -> dict[str, Path]:
    """Video files to show beside what was measured, by their stem; of several with one stem any will do."""
    return {file.stem: file for file in _video_paths(Path(path))}


def find_camera(path: Path, camera: CameraChoice = None) -> Camera | None:
    """The camera for an input: the one asked for, else `camera.json` in or beside it, or in the parent folder.

    The parent folder's is for videos and annotations; a tracks folder, which needs none, has its own or none.
    """
    if isinstance(camera, Camera):
        return camera
    if camera is not None:
        return Camera.clevrer() if str(camera) == CLEVRER else Camera.read(Path(camera))
    folder = path if path.is_dir() else path.parent
    candidates = [folder / CAMERA_FILE]
    if not _is_tracks_folder(path):
        candidates.append(folder.resolve().parent / CAMERA_FILE)
    return next((Camera.read(candidate) for candidate in candidates if candidate.is_file()), None)


def _existing(path: Path | str) -> Path:
    source = Path(path)
    try:
        there = source.exists()
    except OSError as error:
        raise InputError(f"{source}: the path cannot be followed ({error.strerror}); check it.") from error
    if not there:
        raise InputError(f"{source}: there is no such file or folder; check the path.")
    if source.is_file() and source.suffix.lower() == ".csv" and not _is_tracks_folder(source):
        raise InputError(
            f"{source}: a table of positions must be named {TRACKS_FILE} and have an objects.csv beside it; rename it."
        )
    if source.is_dir() and not (_is_tracks_folder(source) or _annotation_paths(source) or _video_paths(source)):
        raise InputError(f"{source}: the folder holds no tracks.csv, no video and no annotation; check the path.")
    return source


def _is_tracks_folder(path: Path) -> bool:
    return (path / TRACKS_FILE).is_file() if path.is_dir() else path.name == TRACKS_FILE


def _annotation_files(path: Path) -> dict[str, Path]:
    """CLEVRER annotation files by the name of their video, which each has to be read for."""
    return _by_name({file: annotated_video(file) for file in _annotation_paths(path)})


def _by_name(names: Mapping[Path, str]) -> dict[str, Path]:
    """Files by the names of their videos, of which no two may be the same."""
    files: dict[str, Path] = {}
    for file, name in names.items():
        if name in files:
            raise InputError(f"{file}: video '{name}' is in {files[name].name} as well; rename one of them.")
        files[name] = file
    return files


def _video_paths(path: Path) -> list[Path]:
    if not path.is_dir():
        return [] if path.suffix.lower() in {".csv", ".json"} else [path]
    candidates = sorted((path / "videos").glob("*")) or sorted(path.glob("*"))
    return [file for file in candidates if file.suffix.lower() in VIDEO_SUFFIXES]


def _annotation_paths(path: Path) -> list[Path]:
    if path.is_dir():
        return sorted(path.glob(ANNOTATION_PATTERN))
    return [path] if path.suffix.lower() == ".json" else []


def _load_file(
    path: Path, camera: CameraChoice, recognise: Recogniser | None, progress: ProgressDisplay | None
) -> Tracks:
    found = find_camera(path, camera)
    if path.suffix.lower() == ".json":
        return read_annotation(path, camera=found)
    if found is None:
        raise InputError(
            f"{path}: no camera; put {CAMERA_FILE} beside the video or in its parent folder, or give --camera FILE "
            "(or --camera clevrer)."
        )
    from vrdp_prob.perception import read_video, see_video  # noqa: PLC0415 - OpenCV is loaded only for a video

    if recognise is None:
        return read_video(path, found, progress=progress)
    return recognise(see_video(path, found, progress=progress))

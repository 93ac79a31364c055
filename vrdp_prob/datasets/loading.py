"""One door for every input: a video, a tracks folder or a CLEVRER annotation."""

from collections.abc import Sequence
from pathlib import Path

from vrdp_prob.datasets.clevrer import read_annotation
from vrdp_prob.datasets.folder import read_folder, video_names
from vrdp_prob.errors import InputError
from vrdp_prob.progress import ProgressDisplay
from vrdp_prob.scene import Camera, Tracks

CameraChoice = Camera | Path | str | None
CAMERA_FILE = "camera.json"
CLEVRER = "clevrer"


def load(
    path: Path | str,
    *,
    video: str | None = None,
    camera: CameraChoice = None,
    progress: ProgressDisplay | None = None,
) -> Tracks:
    """Tracks of one video.

    Parameters
    ----------
    path
        A video file, a tracks folder (or its `tracks.csv`), or a CLEVRER annotation file.
    video
        Which video of a folder of several.
    camera
        A camera, the path of a camera file, or `"clevrer"` for the camera of that data set. By default `camera.json`
        beside the file or in its parent folder. Only a video needs one.
    progress
        Who follows the work on a video file.

    Raises
    ------
    InputError
        If the input cannot be used, a folder holds several videos and none is named, or a video has no camera.
    """
    path = Path(path)
    names = video_names_of(path)
    if video is None and len(names) > 1:
        raise InputError(f"{path}: the folder holds {len(names)} videos; choose one (--video {names[0]}, say).")
    return load_all(path, videos=None if video is None else [video], camera=camera, progress=progress)[0]


def load_all(
    path: Path | str,
    *,
    videos: Sequence[str] | None = None,
    camera: CameraChoice = None,
    progress: ProgressDisplay | None = None,
) -> list[Tracks]:
    """Tracks of all videos of a folder, or of the one video of a file; parameters as for `load`."""
    path = Path(path)
    if not path.exists():
        raise InputError(f"{path}: there is no such file or folder; check the path.")
    if _is_tracks_folder(path):
        folder = path if path.is_dir() else path.parent
        return read_folder(folder, videos=videos, camera=find_camera(folder, camera))
    if path.is_dir():
        raise InputError(f"{path}: the folder has no tracks.csv; give a tracks folder, a video or an annotation file.")
    if path.suffix.lower() == ".json":
        tracks = read_annotation(path, camera=find_camera(path, camera))
    else:
        found = find_camera(path, camera)
        if found is None:
            raise InputError(
                f"{path}: no camera; put {CAMERA_FILE} beside the video or in its parent folder, or give --camera FILE "
                "(or --camera clevrer)."
            )
        from vrdp_prob.perception import read_video  # noqa: PLC0415 - OpenCV is loaded only where there is a video

        tracks = read_video(path, found, progress=progress)
    if videos is not None and list(videos) != [tracks.video]:
        raise InputError(f"{path}: there is no video '{', '.join(videos)}' in it; it is {tracks.video}.")
    return [tracks]


def video_names_of(path: Path) -> list[str]:
    """Names of the videos of a tracks folder; the file's stem for any other input."""
    if _is_tracks_folder(path):
        return video_names(path if path.is_dir() else path.parent)
    return [path.stem]


def find_camera(path: Path, camera: CameraChoice = None) -> Camera | None:
    """The camera for an input: the one asked for, else `camera.json` in or beside it, or in the parent folder."""
    if isinstance(camera, Camera):
        return camera
    if camera is not None:
        return Camera.clevrer() if str(camera) == CLEVRER else Camera.read(Path(camera))
    folder = path if path.is_dir() else path.parent
    for candidate in (folder / CAMERA_FILE, folder.resolve().parent / CAMERA_FILE):
        if candidate.is_file():
            return Camera.read(candidate)
    return None


def _is_tracks_folder(path: Path) -> bool:
    return (path / "tracks.csv").is_file() if path.is_dir() else path.name == "tracks.csv"

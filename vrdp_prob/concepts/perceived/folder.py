"""Videos of a folder with the questions about them, ready to learn from; each video is looked at once."""

from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path

from vrdp_prob.concepts.perceived.examples import examples_of
from vrdp_prob.concepts.perceived.lessons import Taught
from vrdp_prob.concepts.perceived.observation import Observation
from vrdp_prob.datasets import check_scenes, find_camera, questions_about, video_files
from vrdp_prob.datasets.loading import CameraChoice
from vrdp_prob.errors import InputError
from vrdp_prob.inference.checkpoint import Checkpoint
from vrdp_prob.perception.reading import see_video
from vrdp_prob.progress import ProgressDisplay, SilentProgress
from vrdp_prob.scene import Camera


def taught_videos(
    folder: Path | str,
    questions: Path | str,
    *,
    scenes: tuple[int, int] | None = None,
    camera: CameraChoice = None,
    checkpoint: Path | None = None,
    progress: ProgressDisplay | None = None,
) -> dict[str, Taught]:
    """Videos with answers about them.

    Parameters
    ----------
    folder
        Folder of videos.
    questions
        CLEVRER question file with answers; only descriptive and explanatory questions are looked at.
    scenes
        First `scene_index` of the question file and the one after the last; all where None.
    camera
        Camera of the videos; see `vrdp_prob.load`.
    checkpoint
        Folder that keeps what was seen of each video, so that no video is looked at twice.
    progress
        Told of each video.

    Raises
    ------
    InputError
        If a question is not understood or contradicts another one, a video is missing, unusable or without a camera, or
        `checkpoint` belongs to other videos.
    """
    folder, questions = Path(folder), Path(questions)
    wanted = questions_about(questions, scenes)
    check_scenes(questions, scenes, wanted)
    examples = examples_of(wanted, source=str(questions))
    files = _files(folder, questions, list(examples))
    cameras = {name: _camera(file, camera) for name, file in files.items()}
    found = {}
    with (progress or SilentProgress()).stage("Looking at videos", total=len(files)) as advance:
        for name, file in files.items():
            found[name] = Taught(_seen(file, cameras[name], checkpoint), examples[name])
            advance(1)
    return found


def _files(folder: Path, questions: Path, names: list[str]) -> Mapping[str, Path]:
    if not folder.is_dir():
        raise InputError(f"{folder}: there is no such folder; name the folder of the videos.")
    files = video_files(folder)
    for name in names:
        if name not in files:
            raise InputError(
                f"{folder}: there is no video {name}, which {questions} asks about; add it, or leave its scene out "
                "(--scenes A:B)."
            )
    return {name: files[name] for name in names}


def _camera(file: Path, camera: CameraChoice) -> Camera:
    found = find_camera(file, camera)
    if found is None:
        raise InputError(
            f"{file}: no camera; put camera.json beside the video or in its parent folder, or give --camera FILE."
        )
    return found


def _seen(file: Path, camera: Camera, folder: Path | None) -> Observation:
    """What is seen of a video, read where it was kept."""
    if folder is None:
        return Observation.of(see_video(file, camera))
    facts = {"video": sha256(file.read_bytes()).hexdigest(), "camera": str(camera.to_document())}
    kept = Checkpoint(folder / file.stem, facts)
    arrays = kept.arrays("observation")
    if arrays is None:
        arrays = Observation.of(see_video(file, camera)).arrays
        kept.keep("observation", arrays)
    return Observation.of_arrays(arrays)

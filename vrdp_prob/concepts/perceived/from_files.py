"""Concepts learned from a folder of videos and a question file; broken off, it can go on."""

from collections.abc import Mapping
from concurrent.futures import as_completed
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from itertools import chain
from pathlib import Path

import torch

from vrdp_prob.concepts.perceived.examples import Example, examples_of
from vrdp_prob.concepts.perceived.learning import Learned, check_device, learn, vocabulary_of
from vrdp_prob.concepts.perceived.lessons import Taught
from vrdp_prob.concepts.perceived.observation import Observation
from vrdp_prob.datasets import check_scenes, find_camera, questions_about, video_files
from vrdp_prob.datasets.loading import CameraChoice
from vrdp_prob.errors import InputError
from vrdp_prob.inference.runs.checkpoint import Arrays, Checkpoint, film_facts, program_facts
from vrdp_prob.perception.reading import see_video
from vrdp_prob.progress import ProgressDisplay, SilentProgress
from vrdp_prob.scene import Camera
from vrdp_prob.workers import local_workers

OBSERVATION, OBSERVED = "observation", tuple(Observation.__dataclass_fields__)


@dataclass(frozen=True)
class Film:
    """A video file that nobody has looked at yet, with what is asked about it."""

    file: Path
    camera: Camera
    examples: tuple[Example, ...]

    @cached_property
    def facts(self) -> dict[str, str]:
        """What an observation of it depends on."""
        return {**film_facts(self.file, self.camera), **program_facts()}


def learn_from_files(
    folder: Path | str,
    questions: Path | str,
    *,
    scenes: tuple[int, int] | None = None,
    camera: CameraChoice = None,
    seed: int = 0,
    device: str = "cpu",
    checkpoint: Path | None = None,
    processes: int | None = None,
    progress: ProgressDisplay | None = None,
) -> Learned:
    """Learn concepts from the descriptive and explanatory questions of a file that have their answers.

    Parameters
    ----------
    folder, questions, scenes, camera
        See `films`.
    seed
        Seed of everything random in it.
    device
        See `learn`.
    checkpoint
        Folder that keeps what was seen and learned. The same call again, after an interruption, goes on from there and
        ends with the same numbers.
    processes
        Videos that are looked at at a time; as many as there are cores where None.
    progress
        Told of each video and epoch.

    Raises
    ------
    InputError
        If `films` refuses the input, torch finds no such device, no word of an attribute occurs in the questions, a
        video is unusable, or `checkpoint` belongs to another call.
    """
    check_device(device)
    shown = films(folder, questions, scenes=scenes, camera=camera)
    vocabulary_of(chain.from_iterable(film.examples for film in shown.values()))
    kept = None if checkpoint is None else Checkpoint(checkpoint / "networks", facts(shown, seed, device))
    seen = None if checkpoint is None else checkpoint / "videos"
    videos = look_at(shown, checkpoint=seen, processes=processes, progress=progress)
    return learn(videos, seed=seed, device=device, checkpoint=kept, progress=progress)


def films(
    folder: Path | str,
    questions: Path | str,
    *,
    scenes: tuple[int, int] | None = None,
    camera: CameraChoice = None,
) -> dict[str, Film]:
    """Videos with answers about them, by name.

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

    Raises
    ------
    InputError
        If a question is not understood or contradicts another one, or a video is missing or without a camera.
    """
    folder, questions = Path(folder), Path(questions)
    wanted = questions_about(questions, scenes)
    check_scenes(questions, scenes, wanted)
    examples = examples_of(wanted, source=str(questions))
    files = _files(folder, questions, list(examples))
    return {name: Film(file, _camera(file, camera), examples[name]) for name, file in files.items()}


def look_at(
    shown: Mapping[str, Film],
    *,
    checkpoint: Path | None = None,
    processes: int | None = None,
    progress: ProgressDisplay | None = None,
) -> dict[str, Taught]:
    """What is seen of each video, with what is asked about it.

    Parameters
    ----------
    shown
        The videos.
    checkpoint
        Folder that keeps what was seen, so that no video is looked at twice.
    processes
        Videos that are looked at at a time; as many as there are cores where None.
    progress
        Told of each video.

    Raises
    ------
    InputError
        If a video is unusable, or `checkpoint` belongs to other videos.
    """
    kept = {} if checkpoint is None else {name: Checkpoint(checkpoint / name, shown[name].facts) for name in shown}
    seen: dict[str, Arrays] = {
        name: arrays for name, one in kept.items() if (arrays := one.arrays(OBSERVATION, OBSERVED)) is not None
    }
    waiting = [name for name in shown if name not in seen]
    with (progress or SilentProgress()).stage("Looking at videos", total=len(shown)) as advance:
        advance(len(seen))
        with local_workers(processes, tasks=len(waiting)) as workers:
            looking = {workers.submit(_observed, shown[name].file, shown[name].camera): name for name in waiting}
            for future in as_completed(looking):
                name = looking[future]
                seen[name] = future.result()
                if name in kept:
                    kept[name].keep(OBSERVATION, seen[name])
                advance(1)
    return {name: Taught(Observation.of_arrays(seen[name]), film.examples) for name, film in shown.items()}


def facts(shown: Mapping[str, Film], seed: int, device: str) -> dict[str, str]:
    """What the concepts depend on that videos teach."""
    taught = sha256()
    for name, film in shown.items():
        asked = [(example.program.tokens, example.answer) for example in film.examples]
        taught.update(repr((name, film.facts, asked)).encode())
    return {"videos and answers": taught.hexdigest(), "seed": str(seed), "device": device, **program_facts()}


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


def _observed(file: Path, camera: Camera) -> Arrays:
    """What is seen of a video; it runs in a process of its own."""
    torch.set_num_threads(1)
    return Observation.of(see_video(file, camera)).arrays

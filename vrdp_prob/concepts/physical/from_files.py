"""A word learned from a folder of videos and a question file; broken off, it can go on."""

from collections.abc import Mapping, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import torch

from vrdp_prob.concepts.physical.agreement import Agreement, agreements_of
from vrdp_prob.concepts.physical.examples import mentions, prepared
from vrdp_prob.concepts.physical.hypotheses import HYPOTHESES
from vrdp_prob.concepts.physical.learn import DRAWS, check_draws, word_of
from vrdp_prob.concepts.physical.learned_word import LearnedWord
from vrdp_prob.concepts.physical.naming import check_name
from vrdp_prob.datasets import load_all, questions_about, video_names
from vrdp_prob.datasets.loading import CameraChoice
from vrdp_prob.errors import InputError
from vrdp_prob.inference import check_options, default_model, infer
from vrdp_prob.inference.runs.checkpoint import Checkpoint, fingerprint
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.rollout import compile_model
from vrdp_prob.progress import ProgressDisplay, SilentProgress
from vrdp_prob.reasoning.changes import Change, Meaning
from vrdp_prob.scene import Question, Tracks
from vrdp_prob.workers import local_workers

AGREEMENT, DRAWS_BY_MISTAKES = "agreement", "draws"


@dataclass(frozen=True)
class Settings:
    """How every video is worked on; see `learn_from_files`."""

    word: str
    model: PhysicsModel
    sampler: str
    draws: int
    seed: int


@dataclass(frozen=True)
class Lesson:
    """One video, and the questions about it that use the word."""

    tracks: Tracks
    questions: tuple[Question, ...]
    settings: Settings

    def checkpoint(self, folder: Path) -> Checkpoint:
        """What keeps how far its answers agree, in a folder of its own."""
        settings = self.settings
        facts = fingerprint(
            self.tracks,
            settings.model,
            word=settings.word,
            questions=sha256(repr(self.questions).encode()).hexdigest(),
            hypotheses=HYPOTHESES,
            sampler=settings.sampler,
            draws=settings.draws,
            seed=settings.seed,
        )
        return Checkpoint(folder / self.tracks.video, facts)


def learn_from_files(
    name: str,
    folder: Path | str,
    questions: Path | str,
    *,
    scenes: tuple[int, int] | None = None,
    camera: CameraChoice = None,
    model: PhysicsModel | None = None,
    sampler: str = "laplace",
    draws: int = DRAWS,
    seed: int = 0,
    checkpoint: Path | str | None = None,
    processes: int | None = None,
    progress: ProgressDisplay | None = None,
) -> LearnedWord:
    """Learn a word from the questions of a file that use it and have their answers.

    Parameters
    ----------
    name
        The word; see `learn_concept`.
    folder
        Tracks folder, or folder of annotations or of videos.
    questions
        CLEVRER question file with answers.
    scenes
        First `scene_index` of the question file and the one after the last; all where None.
    camera, model, sampler
        See `vrdp_prob.load` and `vrdp_prob.infer`. `laplace` does not hand on to another sampler here.
    draws, seed
        See `learn_concept`.
    checkpoint
        Folder that keeps what each video says. The same call again, after an interruption, goes on from there.
    processes
        Videos that are worked on at a time; as many as there are cores where None.
    progress
        Told how many videos are done.

    Raises
    ------
    InputError
        If an input cannot be used, the word is in no question, one of these has no answer, none is about a video of
        the folder, no video can be used, or `checkpoint` holds what belongs to another call.
    """
    check_name(name)
    check_options(sampler=sampler)
    check_draws(draws)
    settings = Settings(name, model or default_model(), sampler, draws, seed)
    asked = _asked(name, Path(questions), scenes)
    lessons = _lessons(Path(folder), asked, camera, settings, progress)
    kept = {} if checkpoint is None else {one.tracks.video: one.checkpoint(Path(checkpoint)) for one in lessons}
    found: dict[str, Agreement | str] = {}
    found |= {video: known for video, one in kept.items() if (known := _kept(one)) is not None}
    waiting = [lesson for lesson in lessons if lesson.tracks.video not in found]
    if waiting:
        compile_model(settings.model)
    with (progress or SilentProgress()).stage(f"Learning '{name}'", total=len(lessons)) as advance:
        advance(len(found))
        with local_workers(processes, tasks=len(waiting)) as workers:
            for future in as_completed([workers.submit(_taught, lesson) for lesson in waiting]):
                video, told = future.result()
                found[video] = told
                if video in kept and not isinstance(told, str):
                    kept[video].keep(AGREEMENT, {DRAWS_BY_MISTAKES: told.draws})
                advance(1)
    return _word(settings, lessons, found)


def _word(settings: Settings, lessons: Sequence[Lesson], found: Mapping[str, Agreement | str]) -> LearnedWord:
    """The word that the usable videos teach."""
    told = [(lesson, found[lesson.tracks.video]) for lesson in lessons]
    usable = [(lesson, agreement) for lesson, agreement in told if not isinstance(agreement, str)]
    left_out = tuple(reason for _, reason in told if isinstance(reason, str))
    if not usable:
        raise InputError(left_out[0])
    return word_of(
        settings.word,
        [agreement for _, agreement in usable],
        examples=sum(len(lesson.questions) for lesson, _ in usable),
        draws=settings.draws,
        seed=settings.seed,
        left_out=left_out,
    )


def _asked(name: str, path: Path, scenes: tuple[int, int] | None) -> dict[str, tuple[Question, ...]]:
    """The questions that use the word and are answered, understood before any work."""
    asked = {
        video: tuple(question for question in several if mentions(question, name))
        for video, several in questions_about(path, scenes).items()
    }
    if not any(asked.values()):
        where = "" if scenes is None else f" about scenes {scenes[0]} to {scenes[1] - 1}"
        raise InputError(f"{path}: no question{where} uses the word '{name}'; check its spelling, or the scenes.")
    for video, several in asked.items():
        for question in several:
            try:
                prepared(question, Change(name, (Meaning(1.0, None),)))
            except InputError as error:
                raise InputError(f"{path}, {video}, question {question.question_id}: {error}") from error
    return {video: several for video, several in asked.items() if several}


def _lessons(
    folder: Path,
    asked: dict[str, tuple[Question, ...]],
    camera: CameraChoice,
    settings: Settings,
    progress: ProgressDisplay | None,
) -> list[Lesson]:
    there = set(video_names(folder))
    names = [video for video in asked if video in there]
    if not names:
        raise InputError(
            f"{folder}: none of the videos that the questions with '{settings.word}' are about is in the folder."
        )
    videos = load_all(folder, videos=names, camera=camera, progress=progress)
    return [Lesson(one, asked[one.video], settings) for one in videos]


def _taught(lesson: Lesson) -> tuple[str, Agreement | str]:
    """What one video says, or why it says nothing; it runs in a process of its own."""
    torch.set_num_threads(1)
    video = lesson.tracks.video
    try:
        return video, _agreement(lesson)
    except InputError as error:
        reason = str(error)
    except Exception as error:  # one video must not take the others with it; the reason is told
        reason = f"internal error, please report it: {type(error).__name__}: {error}"
    return video, f"{video} was left out: {reason.removesuffix('.')}."


def _agreement(lesson: Lesson) -> Agreement:
    settings = lesson.settings
    # the fast way does not hand on here: many videos would take hours
    posterior = infer(lesson.tracks, sampler=settings.sampler, model=settings.model, seed=settings.seed, hand_on=False)
    (agreement,) = agreements_of(settings.word, posterior, [lesson.questions], draws=settings.draws, seed=settings.seed)
    return agreement


def _kept(checkpoint: Checkpoint) -> Agreement | None:
    """What a video was found to say in an earlier call; None where it has to be worked on."""
    arrays = checkpoint.arrays(AGREEMENT, (DRAWS_BY_MISTAKES,))
    return None if arrays is None else Agreement(arrays[DRAWS_BY_MISTAKES])

"""Evaluate the answers to a file of questions about many videos, in parallel; broken off, it can go on."""

import json
from collections.abc import Mapping, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path

from vrdp_prob.concepts.perceived.concepts import Concepts
from vrdp_prob.concepts.perceived.storage import read_concepts
from vrdp_prob.datasets import (
    check_scenes,
    find_camera,
    has_tracks,
    load_all,
    questions_about,
    video_files,
    video_names,
)
from vrdp_prob.datasets.loading import CameraChoice
from vrdp_prob.errors import InputError, check_whole_number
from vrdp_prob.evaluation.judgement import Judgement, Kind
from vrdp_prob.evaluation.one_scene import BEST_FIT, POSTERIOR, VARIANTS, SceneResult, Settings, Task, evaluate_scene
from vrdp_prob.evaluation.scores import Interval, Scores, brier_gain
from vrdp_prob.files import write_atomically
from vrdp_prob.inference import check_options, default_model
from vrdp_prob.inference.runs.checkpoint import Checkpoint, film_facts, model_facts, program_facts, tracks_facts
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.rollout import compile_model
from vrdp_prob.progress import ProgressDisplay, SilentProgress
from vrdp_prob.reasoning.prepared import check_answer, prepare
from vrdp_prob.reasoning.vocabulary import ChangeWord, Vocabulary
from vrdp_prob.reasoning.worlds import DRAWS
from vrdp_prob.scene import Question, Tracks
from vrdp_prob.workers import check_processes, cluster, local_workers

SOURCES = ("tracks", "videos")
"""What videos may be read from."""
RESULT = "result.json"
"""File of what one video gave, in its folder."""
GROUPS: Mapping[str, tuple[Kind, ...]] = {
    "descriptive": (Kind.DESCRIPTIVE,),
    "explanatory": (Kind.EXPLANATORY,),
    "predictive": (Kind.PREDICTIVE,),
    "counterfactual": (Kind.REMOVAL, Kind.MASS, Kind.WORD),
    "counterfactual_removal": (Kind.REMOVAL,),
    "counterfactual_mass": (Kind.MASS,),
    "counterfactual_word": (Kind.WORD,),
}
"""What is scored together, by its name in the document."""


@dataclass(frozen=True)
class Evaluation:
    """Judgements of all questions, and their scores.

    Parameters
    ----------
    results
        What each video gave, in the order of the question file.
    absent
        Number of videos that the question file asks about and the folder does not hold.
    seed
        Seed of the bootstrap.
    """

    results: tuple[SceneResult, ...]
    absent: int = 0
    seed: int = 0

    def judgements(self, variant: str = POSTERIOR, group: str | None = None) -> tuple[Judgement, ...]:
        """Judgements of a variant; those of one group, or all."""
        kinds = tuple(Kind) if group is None else GROUPS[group]
        return tuple(one for result in self.results for one in result.judgements[variant] if one.kind in kinds)

    @cached_property
    def scores(self) -> dict[str, dict[str, Scores]]:
        """Scores by variant and group."""
        return {
            variant: {group: Scores.of(self.judgements(variant, group), seed=self.seed) for group in GROUPS}
            for variant in VARIANTS
        }

    @cached_property
    def gains(self) -> dict[str, tuple[float, Interval | None] | None]:
        """How much lower the Brier score of the posterior is than that of the best fit, by group; see `brier_gain`."""
        return {
            group: brier_gain(ours, self.judgements(BEST_FIT, group), seed=self.seed) if ours else None
            for group in GROUPS
            for ours in [self.judgements(POSTERIOR, group)]
        }

    @property
    def failed(self) -> tuple[SceneResult, ...]:
        """Videos without answers."""
        return tuple(result for result in self.results if result.failed is not None)

    @property
    def seconds_per_video(self) -> float:
        """Mean time that a video took in its process, in s."""
        return sum(result.seconds for result in self.results) / len(self.results)


def evaluate(
    folder: Path | str,
    questions: Path | str,
    *,
    scenes: tuple[int, int] | None = None,
    source: str | None = None,
    camera: CameraChoice = None,
    concepts: Path | str | None = None,
    model: PhysicsModel | None = None,
    sampler: str = "laplace",
    seed: int = 0,
    draws: int = DRAWS,
    words: Sequence[ChangeWord] = (),
    out: Path | str | None = None,
    processes: int | None = None,
    dask: str | None = None,
    progress: ProgressDisplay | None = None,
) -> Evaluation:
    """Answer the questions of a file about the videos of a folder, and score the answers.

    Parameters
    ----------
    folder
        Tracks folder, or folder of annotations or of videos.
    questions
        CLEVRER question file with answers.
    scenes
        First `scene_index` of the question file and the one after the last; all where None.
    source
        `tracks` or `videos`; where None, tracks where the folder holds any.
    camera
        Camera of the videos; see `vrdp_prob.load`.
    concepts
        File of learned concepts that give the objects of videos their attributes; the rules of perception where None.
    model, sampler, seed
        See `vrdp_prob.infer`. `laplace` does not hand on to another sampler here.
    draws
        Posterior draws that answer the questions.
    words
        Learned words that the questions may use.
    out
        Folder that keeps the result of each video. The same call again, after an interruption, goes on from there.
    processes
        Videos that are worked on at a time; as many as there are cores where None.
    dask
        Address of the scheduler of a Dask cluster that does the work instead. Its workers need this package, and of
        videos the files.
    progress
        Told how many videos are done.

    Raises
    ------
    InputError
        If an input cannot be used, no video of the question file is in the folder, no question has an answer, or `out`
        holds the results of another evaluation.
    """
    check_options(sampler=sampler)
    if source not in (None, *SOURCES):
        raise InputError(f"input is '{source}'; use {' or '.join(SOURCES)}.")
    check_whole_number("draws", draws, least=1)
    check_whole_number("seed", seed, least=0)
    check_processes(processes)
    learned = None if concepts is None else read_concepts(concepts)
    if learned is not None and source != "videos" and has_tracks(folder):
        raise InputError(f"{folder}: learned concepts look at videos, and this holds positions; use --input videos.")
    file = None if concepts is None else Path(concepts).resolve()
    settings = Settings(model or default_model(), sampler, seed, draws, tuple(words), file)
    vocabulary = Vocabulary.of(words)
    asked = _asked(Path(questions), scenes, vocabulary)
    if learned is not None:
        _check_words(learned, asked, vocabulary, Path(questions))
    tasks = _tasks(Path(folder), asked, source, camera, settings)
    looks = "rules" if file is None else sha256(file.read_bytes()).hexdigest()
    kept = {} if out is None else {task.scene: _checkpoint(Path(out), task, looks) for task in tasks}
    done = {scene: result for scene, one in kept.items() if (result := _done(one)) is not None}
    waiting = [task for task in tasks if task.scene not in done]
    if waiting and dask is None:
        compile_model(settings.model)
    with (progress or SilentProgress()).stage("Evaluating", total=len(tasks)) as advance:
        advance(len(done))
        with cluster(dask) if dask is not None else local_workers(processes, tasks=len(waiting)) as workers:
            for task in waiting:
                if task.scene in kept:
                    kept[task.scene].claim()
            for future in as_completed([workers.submit(evaluate_scene, task) for task in waiting]):
                result = future.result()
                done[result.scene] = result
                if result.scene in kept:
                    _keep(kept[result.scene], result)
                advance(1)
    return Evaluation(tuple(done[task.scene] for task in tasks), len(asked) - len(tasks), seed)


def _asked(path: Path, scenes: tuple[int, int] | None, vocabulary: Vocabulary) -> dict[str, list[Question]]:
    """Questions with answers of the scenes that are wanted, understood before any work."""
    asked = {
        name: [question for question in several if question.is_answered]
        for name, several in questions_about(path, scenes).items()
    }
    check_scenes(path, scenes, asked)
    if not any(asked.values()):
        raise InputError(f"{path}: no question has its right answer beside it, so there is nothing to score.")
    for name, several in asked.items():
        for question in several:
            try:
                check_answer(prepare(question, (), vocabulary))
            except InputError as error:
                raise InputError(f"{path}, {name}, question {question.question_id}: {error}") from error
    return {name: several for name, several in asked.items() if several}


def _check_words(
    learned: Concepts, asked: Mapping[str, Sequence[Question]], vocabulary: Vocabulary, path: Path
) -> None:
    """Refuse questions that use a word which was never learned."""
    for name, several in asked.items():
        for question in several:
            try:
                learned.check_question(question, vocabulary)
            except InputError as error:
                raise InputError(f"{path}, {name}, question {question.question_id}: {error}") from error


def _tasks(
    folder: Path,
    asked: Mapping[str, Sequence[Question]],
    source: str | None,
    camera: CameraChoice,
    settings: Settings,
) -> list[Task]:
    if source == "tracks" and not has_tracks(folder):
        raise InputError(f"{folder}: the folder holds no tracks.csv and no annotation; use --input videos.")
    if source == "videos" and not video_files(folder):
        raise InputError(f"{folder}: the folder holds no video; use --input tracks.")
    if source != "videos" and has_tracks(folder):
        there = set(video_names(folder))
        names = [name for name in asked if name in there]
        every = load_all(folder, videos=names, camera=camera) if names else []
        return _some(folder, [Task(one.video, one, None, tuple(asked[one.video]), settings) for one in every])
    files = video_files(folder)
    tasks = [
        Task(name, files[name], find_camera(files[name], camera), tuple(asked[name]), settings)
        for name in asked
        if name in files
    ]
    return _some(folder, tasks)


def _some(folder: Path, tasks: list[Task]) -> list[Task]:
    if not tasks:
        raise InputError(f"{folder}: none of the videos that the question file asks about is in the folder.")
    return tasks


def _checkpoint(out: Path, task: Task, concepts: str) -> Checkpoint:
    """What keeps the result of a video; another evaluation, with other concepts say, must not go on from it."""
    settings, source = task.settings, task.source
    seen = tracks_facts(source) if isinstance(source, Tracks) else film_facts(source, task.camera)
    run = program_facts(
        questions=sha256(repr(task.questions).encode()).hexdigest(),
        concepts=concepts,
        sampler=settings.sampler,
        seed=settings.seed,
        draws=settings.draws,
        words=[word.change for word in settings.words],
    )
    return Checkpoint(out / "scenes" / task.scene, {**seen, **model_facts(settings.model), **run})


def _done(kept: Checkpoint) -> SceneResult | None:
    """A result that is there already; that of a video that failed, and a file that cannot be read, is made anew."""
    text = kept.text(RESULT)
    if text is None:
        return None
    try:
        result = SceneResult.of_document(json.loads(text))
    except (ValueError, KeyError, TypeError, AttributeError):
        return None
    return result if result.failed is None else None


def _keep(kept: Checkpoint, result: SceneResult) -> None:
    with write_atomically(kept.path(RESULT)) as temporary:
        temporary.write_text(json.dumps(result.to_document(), indent=1, allow_nan=False) + "\n", encoding="utf-8")

"""One video evaluated: inferred, asked, judged. It runs in a process of its own."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch

from vrdp_prob.concepts.perceived.storage import read_concepts
from vrdp_prob.datasets import load
from vrdp_prob.errors import InputError
from vrdp_prob.evaluation.judgement import Judgement, judge, unanswered
from vrdp_prob.inference import infer
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.reasoning import PosteriorWorlds
from vrdp_prob.reasoning.plug_in import plug_in_worlds
from vrdp_prob.reasoning.vocabulary import ChangeWord
from vrdp_prob.scene import Camera, Question, Tracks

POSTERIOR, PRIOR_DEFAULTS, BEST_FIT = "posterior", "posterior_prior_defaults", "map"
VARIANTS = (POSTERIOR, PRIOR_DEFAULTS, BEST_FIT)
"""What is scored: draws of the posterior with fixed defaults of what a video does not tell; with defaults drawn from
the prior; and the most probable values alone."""


@dataclass(frozen=True)
class Settings:
    """How every video is worked on; see `evaluate`."""

    model: PhysicsModel
    sampler: str
    seed: int
    draws: int
    words: tuple[ChangeWord, ...] = ()
    concepts: Path | None = None


@dataclass(frozen=True)
class Task:
    """One video and its questions.

    Parameters
    ----------
    scene
        Name of the video.
    source
        Its tracks, or its file.
    camera
        Its camera; only a file needs it.
    questions
        What is asked, with the right answers.
    settings
        How.
    """

    scene: str
    source: Tracks | Path
    camera: Camera | None
    questions: tuple[Question, ...]
    settings: Settings


@dataclass(frozen=True)
class SceneResult:
    """What one video gave.

    Parameters
    ----------
    scene
        Name of the video.
    judgements
        One for each question, by variant.
    seconds
        How long it took.
    convergence
        What the sampler says of its draws.
    warnings
        What else limits them.
    failed
        Why there are no answers; None where there are some. All its questions then count as wrong.
    """

    scene: str
    judgements: Mapping[str, tuple[Judgement, ...]]
    seconds: float
    convergence: str = ""
    warnings: tuple[str, ...] = ()
    failed: str | None = None

    def to_document(self) -> dict[str, Any]:
        """The result as JSON values."""
        return {
            "scene": self.scene,
            "judgements": {name: [one.to_document() for one in made] for name, made in self.judgements.items()},
            "seconds": self.seconds,
            "convergence": self.convergence,
            "warnings": list(self.warnings),
            "failed": self.failed,
        }

    @classmethod
    def of_document(cls, document: Mapping[str, Any]) -> "SceneResult":
        """What `to_document` made a document of."""
        judgements = {
            name: tuple(Judgement.of_document(one) for one in made) for name, made in document["judgements"].items()
        }
        return cls(**{**document, "judgements": judgements, "warnings": tuple(document["warnings"])})


def evaluate_scene(task: Task) -> SceneResult:
    """Infer, ask and judge; a video that cannot be worked on gives a result that says why."""
    torch.set_num_threads(1)
    begin = time.monotonic()
    try:
        return _evaluated(task, begin)
    except InputError as error:
        reason = str(error)
    except Exception as error:  # one video must not take the others with it; the reason stands in the result
        reason = f"internal error, please report it: {type(error).__name__}: {error}"
    nothing = tuple(unanswered(task.scene, question, reason, task.settings.words) for question in task.questions)
    return SceneResult(task.scene, dict.fromkeys(VARIANTS, nothing), time.monotonic() - begin, failed=reason)


def _loaded(task: Task, file: Path) -> Tracks:
    concepts = None if task.settings.concepts is None else read_concepts(task.settings.concepts)
    return load(file, camera=task.camera, recognise=None if concepts is None else concepts.recognise)


def _evaluated(task: Task, begin: float) -> SceneResult:
    settings = task.settings
    tracks = task.source if isinstance(task.source, Tracks) else _loaded(task, task.source)
    # the fast way does not hand on here: a batch would take hours, and its sentence says what it is worth
    posterior = infer(tracks, sampler=settings.sampler, model=settings.model, seed=settings.seed, hand_on=False)
    worlds = {
        POSTERIOR: PosteriorWorlds(posterior, draws=settings.draws),
        PRIOR_DEFAULTS: PosteriorWorlds(posterior, draws=settings.draws, defaults="prior"),
        BEST_FIT: plug_in_worlds(posterior),
    }
    judgements = {
        name: tuple(judge(task.scene, facts, question, settings.words) for question in task.questions)
        for name, facts in worlds.items()
    }
    return SceneResult(
        task.scene, judgements, time.monotonic() - begin, posterior.convergence.sentence, posterior.warnings
    )

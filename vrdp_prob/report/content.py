"""What a report says, as plain data: everything the page and report.json show, and nothing that computes it.

The adapter (`vrdp_prob.report.build`) fills a `ReportContent` from a posterior, its worlds and its answers; the page,
the document and the player's data are renderings of it. So each rendering is tested with content made by hand.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from vrdp_prob.scene import Body, QuestionType, Tracks

Status = Literal["identified", "ratio_only", "product_only", "default"]
"""What the data say about one parameter of one body."""


@dataclass(frozen=True)
class Interval:
    """Summary of the posterior of one positive number.

    Parameters
    ----------
    mean, sd
        Posterior mean and standard deviation.
    q05, q95
        Ends of the 90 % interval (5 % and 95 % quantiles).

    Raises
    ------
    ValueError
        If one of them is not finite.
    """

    mean: float
    sd: float
    q05: float
    q95: float

    def __post_init__(self) -> None:
        if not np.isfinite([self.mean, self.sd, self.q05, self.q95]).all():
            raise ValueError(f"a posterior summary is not finite: {self}")

    @classmethod
    def from_draws(cls, draws: Float[np.ndarray, "draw"]) -> "Interval":
        """Summary of posterior draws, all of the same weight."""
        low, high = np.quantile(draws, [0.05, 0.95])
        return cls(float(draws.mean()), float(draws.std()), float(low), float(high))


@dataclass(frozen=True)
class ParameterContent:
    """Mass (kg, relative to 1 where nothing was weighed) or restitution factor (dimensionless) of one body.

    Parameters
    ----------
    interval
        Its posterior.
    status
        What the data say about it.
    partners
        Ids of the bodies that a ratio or product refers to.
    """

    interval: Interval
    status: Status
    partners: tuple[str, ...] = ()


@dataclass(frozen=True)
class BodyContent:
    """One body with what was learned of it."""

    body: Body
    mass: ParameterContent
    restitution: ParameterContent


@dataclass(frozen=True)
class PairContent:
    """A number that belongs to two bodies: a ratio of masses (first over second) or a pair's restitution."""

    objects: tuple[str, str]
    interval: Interval


@dataclass(frozen=True)
class ConvergenceContent:
    """How well the sampler explored the posterior; None where a number does not apply to the sampler.

    Parameters
    ----------
    sampler
        Name of the sampler.
    converged
        Whether its draws can be relied on.
    r_hat, ess_bulk
        Largest split R-hat and smallest bulk effective sample size over all parameters.
    divergences
        Number of divergent transitions.
    pareto_k
        Shape of the importance weights' tail (k-hat).
    sentences
        The same in words, where the sampler has something of its own to say.
    """

    sampler: Literal["nuts", "emcee", "laplace"]
    converged: bool
    r_hat: float | None = None
    ess_bulk: float | None = None
    divergences: int | None = None
    pareto_k: float | None = None
    sentences: tuple[str, ...] = ()


@dataclass(frozen=True)
class ChoiceContent:
    """One option of a multiple-choice question with the probability that it is correct."""

    choice_id: int | str
    choice: str
    probability: float
    mc_error: float


@dataclass(frozen=True)
class AnswerContent:
    """One question with its answer.

    Parameters
    ----------
    question_id, question, question_type
        The question.
    answer
        The most probable answer; for multiple choice the ids of the choices judged correct.
    probability, mc_error
        Probability of that answer (multiple choice: that every choice is judged right) and its Monte Carlo error.
    entropy
        Entropy of the answer distribution in nats.
    distribution
        Probability of each answer of an open question; empty for multiple choice.
    choices
        The options of a multiple-choice question.
    relies_on_default
        Ids of objects whose default mass or restitution the answer depends on.
    notes
        Further plain sentences about this answer.
    world
        Key of the world (`WorldContent.key`) that the question is about, None where no world shows it.
    """

    question_id: int | str | None
    question: str
    question_type: QuestionType
    answer: str | int | tuple[int | str, ...]
    probability: float
    mc_error: float
    entropy: float
    distribution: Mapping[str, float] = field(default_factory=dict)
    choices: tuple[ChoiceContent, ...] = ()
    relies_on_default: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    world: str | None = None


class WorldKind(StrEnum):
    """What is done to a world before it runs."""

    FACTUAL = "factual"
    FUTURE = "future"
    REMOVED = "removed"
    HEAVIER = "heavier"
    LIGHTER = "lighter"


@dataclass(frozen=True)
class Collisions:
    """First contacts of pairs of bodies in the draws of one world; one row per collision, in any order.

    Parameters
    ----------
    draw
        Index of the posterior draw.
    time
        Time in s.
    bodies
        Indices of the two bodies.
    point
        Point of contact in m.
    """

    draw: Int[np.ndarray, "collision"]
    time: Float[np.ndarray, "collision"]
    bodies: Int[np.ndarray, "collision 2"]
    point: Float[np.ndarray, "collision 2"]


@dataclass(frozen=True)
class WorldContent:
    """Rollouts of some posterior draws in one world.

    Parameters
    ----------
    kind
        What is done to the world.
    body
        Id of the body that it is done to, None for the factual world and its future.
    times
        Times in s.
    trajectory
        Position (m) and angle (rad, counter-clockwise) of each body.
    exists
        Whether a body is released and present; once it is, it stays.
    collisions
        First contacts.

    Raises
    ------
    ValueError
        If a trajectory is not finite.
    """

    kind: WorldKind
    body: str | None
    times: Float[np.ndarray, "time"]
    trajectory: Float[np.ndarray, "draw time body 3"]
    exists: Bool[np.ndarray, "draw time body"]
    collisions: Collisions

    def __post_init__(self) -> None:
        if not np.isfinite(self.trajectory).all():
            raise ValueError(f"the trajectories of the world '{self.key}' are not finite")

    @property
    def key(self) -> str:
        """Name of the world within its report."""
        return str(self.kind) if self.body is None else f"{self.kind}:{self.body}"

    @property
    def draws(self) -> int:
        """Number of posterior draws."""
        return int(self.trajectory.shape[0])


@dataclass(frozen=True)
class Still:
    """One frame of the video.

    Parameters
    ----------
    image
        The picture; channels red, green, blue.
    time
        Its time in s.
    floor
        The same view with the objects cleared away, None where it is not known.
    """

    image: UInt8[np.ndarray, "height width 3"]
    time: float
    floor: UInt8[np.ndarray, "height width 3"] | None = None


@dataclass(frozen=True)
class ReportContent:
    """All that a report says.

    Parameters
    ----------
    tracks
        The measured positions, with the video's name and its camera.
    bodies
        The bodies in the order of the tracks, with what was learned of them.
    mass_ratios, restitution_pairs
        What the data say about pairs.
    convergence
        How well the sampler did.
    warnings
        Plain sentences on what limits the result.
    answers
        The questions, in the order asked.
    worlds
        The worlds that the player shows; the first one is shown first.
    model, effects
        Name of the physics model and of its effects.
    seed, version
        Seed of the run and version of the software.
    still
        A frame of the video, None where the input was no video.
    """

    tracks: Tracks
    bodies: tuple[BodyContent, ...]
    mass_ratios: tuple[PairContent, ...]
    restitution_pairs: tuple[PairContent, ...]
    convergence: ConvergenceContent
    warnings: tuple[str, ...]
    answers: tuple[AnswerContent, ...]
    worlds: tuple[WorldContent, ...]
    model: str
    effects: tuple[str, ...]
    seed: int
    version: str
    still: Still | None = None

    def world(self, kind: WorldKind) -> WorldContent | None:
        """The first world of a kind, None where there is none."""
        return next((world for world in self.worlds if world.kind is kind), None)

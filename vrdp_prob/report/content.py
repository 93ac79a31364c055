"""What a report says, as plain data: everything the page and report.json show, and nothing that computes it.

`vrdp_prob.report.build` fills a `ReportContent` from a posterior and its answers; the page, the document and
the player's data are renderings of it. So each rendering is tested with content made by hand.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from vrdp_prob.inference.draws.samples import Convergence
from vrdp_prob.inference.draws.summaries import ObjectSummary, PairSummary
from vrdp_prob.inference.identifiability.status import CollisionGroup
from vrdp_prob.inference.prior_sensitivity import Sensitivity
from vrdp_prob.inference.search.misfit import Misfit
from vrdp_prob.reasoning.answer import Answer
from vrdp_prob.reasoning.explanation.explanation import Explanation
from vrdp_prob.scene import Tracks


@dataclass(frozen=True)
class AnswerContent:
    """One question with its answer.

    Parameters
    ----------
    answer
        Question and answer.
    world
        Key of the world (`WorldContent.key`) that the question is about, None where no world shows it.
    explanation
        Why the answer is uncertain, None where it is not or nobody can say.
    """

    answer: Answer
    world: str | None = None
    explanation: Explanation | None = None

    @classmethod
    def of(cls, answer: Answer, world: str | None) -> "AnswerContent":
        """A question with its answer, explained where that is uncertain."""
        explanation = answer.explain() if answer.explainer is not None else None
        return cls(answer, world, explanation if explanation is not None and explanation.parts else None)

    def to_document(self) -> dict[str, object]:
        """As an item of `answers` in report.json."""
        return {
            **self.answer.to_document(),
            "explanation": None if self.explanation is None else self.explanation.to_document(),
        }


FACTUAL, FUTURE, REMOVED = "factual", "future", "removed"
"""Kinds of worlds; the future begins where the video ends. Any other kind is the word for what one object is: heavier,
lighter, or as was learned."""


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
class PairShare:
    """How often two bodies collide in a world.

    Parameters
    ----------
    bodies
        Their indices, the smaller one first.
    share
        Share of the draws that this world was simulated in: of all draws that answers come from where a question asks
        about it, else of those shown.
    time
        Median time in s.
    error
        Monte Carlo standard error of the share.
    """

    bodies: tuple[int, int]
    share: float
    time: float
    error: float


@dataclass(frozen=True)
class WorldContent:
    """Rollouts of some posterior draws in one world.

    Parameters
    ----------
    kind
        `factual`, `future`, or the word for what is done to one body: `removed`, `heavier`, a learned word.
    body
        Id of the body that it is done to, None for the factual world and its future.
    times
        Times in s.
    trajectory
        Position (m) and angle (rad, counter-clockwise) of each body.
    exists
        Whether a body is there: from one moment on, and until it leaves.
    collisions
        First contacts in these draws.
    pairs
        The pairs that collide, in the order of their times.

    Raises
    ------
    ValueError
        If a trajectory is not finite.
    """

    kind: str
    body: str | None
    times: Float[np.ndarray, "time"]
    trajectory: Float[np.ndarray, "draw time body 3"]
    exists: Bool[np.ndarray, "draw time body"]
    collisions: Collisions
    pairs: tuple[PairShare, ...]

    def __post_init__(self) -> None:
        if not np.isfinite(self.trajectory).all():
            raise ValueError(f"the trajectories of the world '{self.key}' are not finite")

    @property
    def key(self) -> str:
        """Name of the world within its report."""
        return self.kind if self.body is None else f"{self.kind}:{self.body}"

    @property
    def draws(self) -> int:
        """Number of posterior draws."""
        return int(self.trajectory.shape[0])


@dataclass(frozen=True)
class Footage:
    """What is shown of the video itself; channels are red, green, blue.

    Parameters
    ----------
    still, time
        One frame and its time in s.
    floor
        The same view without the objects.
    film, film_times
        Some frames in order and their times in s.
    """

    still: UInt8[np.ndarray, "height width 3"]
    time: float
    floor: UInt8[np.ndarray, "height width 3"]
    film: UInt8[np.ndarray, "frame height width 3"]
    film_times: Float[np.ndarray, "frame"]


@dataclass(frozen=True)
class ReportContent:
    """All that a report says.

    Parameters
    ----------
    tracks
        The measured positions, with the video's name and its camera.
    objects
        What was learned of each body, in the order of the tracks.
    mass_ratios, restitution_pairs
        What was learned of pairs.
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
    footage
        Pictures of the video, None where the input was no video.
    groups
        Which combinations of masses and restitutions the collisions determine.
    misfit
        How well the model explains the tracks.
    sensitivities
        How much quantities rest on the prior.
    """

    tracks: Tracks
    objects: tuple[ObjectSummary, ...]
    mass_ratios: tuple[PairSummary, ...]
    restitution_pairs: tuple[PairSummary, ...]
    convergence: Convergence
    warnings: tuple[str, ...]
    answers: tuple[AnswerContent, ...]
    worlds: tuple[WorldContent, ...]
    model: str
    effects: tuple[str, ...]
    seed: int
    version: str
    footage: Footage | None = None
    groups: tuple[CollisionGroup, ...] = ()
    misfit: Misfit | None = None
    sensitivities: tuple[Sensitivity, ...] = ()

    def world(self, kind: str) -> WorldContent | None:
        """The first world of a kind, None where there is none."""
        return next((world for world in self.worlds if world.kind == kind), None)

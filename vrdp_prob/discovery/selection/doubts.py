"""Reasons to doubt that what was found is the cause that it is called."""

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from vrdp_prob.discovery.candidates.scores import happens_once
from vrdp_prob.discovery.checks.bodies import REBOUND, friction_against
from vrdp_prob.discovery.checks.clock import LOST_FRAMES, SINGLE_FRAMES
from vrdp_prob.discovery.checks.contacts import DISTANCE, DURATION, REBOUND_AT_WALLS, RUBBING, RUBBING_AT_WALLS
from vrdp_prob.discovery.checks.kicks import KICK
from vrdp_prob.discovery.checks.measurement import DISTORTION
from vrdp_prob.discovery.finding import Check
from vrdp_prob.discovery.selection.estimates import has_sign_of_law, surprise
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.discovery.words import title
from vrdp_prob.models.effects.clock_error import ClockError
from vrdp_prob.models.effects.contact_friction import ContactFriction
from vrdp_prob.models.effects.contact_radius_error import ContactRadiusError
from vrdp_prob.models.effects.dropped_frames import DroppedFrames
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.external_impulse import ExternalImpulse
from vrdp_prob.models.effects.hidden_obstacle import HiddenObstacle
from vrdp_prob.models.effects.irregular_frames import IrregularFrames
from vrdp_prob.models.effects.lens_distortion import LensDistortion
from vrdp_prob.models.effects.mass_dependent_friction import MassDependentFriction
from vrdp_prob.models.effects.material_friction import MaterialFriction
from vrdp_prob.models.effects.speed_dependent_restitution import SpeedDependentRestitution
from vrdp_prob.models.effects.wall import Wall
from vrdp_prob.plain_words import listed

SURPRISING = 0.01
"""Probability below which parameters of a cause, or what is left of what it acts on, say that it is something else."""
NEARLY_ALL = 0.9
"""Share of what each of its own checks that fail tells without a cause (nats, by the p-value) that the cause must take
away for what is left to be details of its law: a strength that differs between bodies, say."""
OWN_CHECKS: Mapping[str, tuple[str, ...]] = {
    SpeedDependentRestitution.name: (REBOUND, REBOUND_AT_WALLS),
    ContactFriction.name: (RUBBING, RUBBING_AT_WALLS),
    ContactRadiusError.name: (DISTANCE, *DURATION.values()),
    ExternalImpulse.name: (KICK,),
    ClockError.name: (LOST_FRAMES,),
    DroppedFrames.name: (LOST_FRAMES,),
    IrregularFrames.name: (SINGLE_FRAMES,),
    LensDistortion.name: (DISTORTION,),
    MassDependentFriction.name: (friction_against("mass"),),
    MaterialFriction.name: (friction_against("material"),),
}
"""By the name of a cause: the checks that ask for what it does, and for nothing else."""
TURNED_ONCE = (Wall.name, HiddenObstacle.name, ExternalImpulse.name)
"""Causes that leave the same where but one body is turned, and but once."""
HELD_BY_BODIES = frozenset({SpeedDependentRestitution.name, MassDependentFriction.name, MaterialFriction.name})
"""Causes of which most lies in numbers that bodies have of their own anyway, so that residuals hardly show them."""


@dataclass(frozen=True)
class Doubt:
    """A reason to doubt that something is the cause that it is called.

    Parameters
    ----------
    credible
        Factor of the probability of the cause.
    sentence
        The reason, for a reader.
    """

    credible: float
    sentence: str


@dataclass(frozen=True)
class Without:
    """What a model leaves without a cause.

    Parameters
    ----------
    checks
        Its checks.
    noise
        The noise that the model with the cause believes in, in units of that of this one: residuals that no cause
        explains are noise to a model, in units of which they tell less.
    """

    checks: Sequence[Check] = ()
    noise: float = 1.0

    def tells(self) -> dict[str, float]:
        """Nats by the names of the checks, in units of the noise of the model with the cause."""
        return {one.name: one.nats_with_noise(self.noise) for one in self.checks}


def doubts(
    trial: Trial,
    cause: Effect,
    left: Sequence[Check] = (),
    *,
    without: Callable[[], Without] = Without,
) -> Iterator[Doubt]:
    """Reasons to doubt a cause of a model.

    Parameters
    ----------
    trial
        The model.
    cause
        One of its causes.
    left
        Checks of what the model leaves.
    without
        Finds what it leaves without the cause, which is asked for where a check fails of one that lasts. Without any of
        its checks what fails still is no detail.
    """
    of_parameters = surprise(trial.fit, cause)
    if of_parameters < SURPRISING:
        yield Doubt(
            of_parameters / SURPRISING,
            f"The parameters of '{title(cause.name)}' are far from what was expected of this cause: it may stand for "
            "something that it has as its limit, and its probability counts that.",
        )
    of_sign = has_sign_of_law(trial.fit, cause, trial.unexplained)
    if of_sign < SURPRISING:
        yield Doubt(
            of_sign / SURPRISING,
            f"The strength of '{title(cause.name)}' has the sign that its law does not have: something else acts as it "
            "would the other way about, and its probability counts that.",
        )
    own, by_chance = _own(cause, left)
    if by_chance < SURPRISING and (happens_once(cause) or not _nearly_explained(own, without())):
        otherwise = ", or it happened more often than was found" if happens_once(cause) else ""
        yield Doubt(
            by_chance / SURPRISING,
            f"With '{title(cause.name)}' the check of {own[0].name} fails still, which asks for just what this cause "
            f"does: its law is another one{otherwise}, and its probability counts that.",
        )


def unasked_turns(trial: Trial, asked: Collection[str]) -> Iterator[str]:
    """What else may have turned a body once, of which nobody asked, in sentences.

    Parameters
    ----------
    trial
        A model.
    asked
        Names of the causes that are looked for.
    """
    others = [f"'{title(name)}'" for name in TURNED_ONCE if name not in asked]
    for cause in trial.causes:
        if others and cause.cause_name() in TURNED_ONCE and trial.turns(cause) == 1:
            yield (
                f"'{title(cause.name)}' turns one body once, as another cause would that was not looked for: "
                f"{listed(others)}."
            )


def details_left(causes: Iterable[Effect], left: Sequence[Check]) -> Iterator[str]:
    """What the own checks still tell of causes that are not doubted, in sentences."""
    for cause in causes:
        own, by_chance = _own(cause, left)
        if by_chance < SURPRISING:
            yield (
                f"'{title(cause.name)}' explains nearly all that the check of {own[0].name} tells without it, and not "
                "all: its law may differ in details, as by a strength that differs between bodies, or be another one "
                "that is much like it."
            )


def _own(cause: Effect, left: Sequence[Check]) -> tuple[list[Check], float]:
    """The own checks of a cause, the worst first, and how probable the worst of so many is by chance."""
    own = sorted((one for one in left if one.name in OWN_CHECKS.get(cause.name, ())), key=lambda one: one.p_value)
    return own, len(own) * own[0].p_value if own else 1.0


def _nearly_explained(own: Sequence[Check], without: Without) -> bool:
    """Whether a cause takes away nearly all that each of its checks which fail still tells without it."""
    before = without.tells()
    failing = [one for one in own if len(own) * one.p_value < SURPRISING]
    return all(one.nats <= (1 - NEARLY_ALL) * before.get(one.name, 0.0) for one in failing)


def causes_with_own_check_failing(checks: Sequence[Check]) -> set[str]:
    """Names of causes whose very traces some checks have found."""
    failing = {check.name for check in checks if check.significant}
    return {name for name, own in OWN_CHECKS.items() if failing.intersection(own)}


def rivals_outside(causes: Iterable[str], checks: Sequence[Check]) -> list[str]:
    """What is not in the catalogue and would leave the same as some named causes do, in sentences.

    Parameters
    ----------
    causes
        Names of the effects.
    checks
        Checks of the model that was given.
    """
    own = {name for cause in causes for name in OWN_CHECKS.get(cause, ())}
    return [check.rival for check in checks if check.name in own and check.rival]


def with_doubts(
    shares: Float[np.ndarray, "model"], reasons: Mapping[int, Sequence[Doubt]]
) -> Float[np.ndarray, "model"]:
    """Probabilities of models of which some are doubted.

    Parameters
    ----------
    shares
        Probabilities without doubts, the first that of the best model.
    reasons
        Why some models are doubted, by their number.

    Returns
    -------
    What a doubted rival loses the others have; what the best model loses is that of something that was not compared, so
    that the probabilities then add up to less than 1.
    """
    believed = shares * [math.prod(one.credible for one in reasons.get(k, ())) for k in range(len(shares))]
    return believed if reasons.get(0) else believed / believed.sum()

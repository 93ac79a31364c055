"""The most probable values (MAP) of a video: local fits, a growing window, then everything that matters at once.

L-BFGS on the exact gradient and Levenberg-Marquardt on the residuals climb the same density; see
`docs/decisions/0020-map-by-growing-windows.md` for which is faster.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
import torch
from jaxtyping import Float

from vrdp_prob.errors import InputError
from vrdp_prob.inference.draws.mode import Mode
from vrdp_prob.inference.search.at_rest import Explained, with_bodies_at_rest
from vrdp_prob.inference.search.clues import Clues
from vrdp_prob.inference.search.descent import Descent
from vrdp_prob.inference.search.event_orders import with_other_orders
from vrdp_prob.inference.search.events import Pairs, first_contacts
from vrdp_prob.inference.search.growing_fit import GrowingFit, merged
from vrdp_prob.inference.search.misfit import Misfit, judge, shows_outliers, with_outliers
from vrdp_prob.inference.search.mode_search import ModeSearch, agree
from vrdp_prob.inference.search.model_error_fit import TURNS, next_model_error
from vrdp_prob.inference.search.modes import (
    HOPELESS,
    distinct_modes,
    restricted,
    structure_at,
    with_all_that_meet,
    without_idle,
)
from vrdp_prob.inference.search.plan import FitPlan
from vrdp_prob.inference.search.refinement import Refined, Searched, at_the_top, best_first, climb, refine
from vrdp_prob.inference.search.release_places import released_apart
from vrdp_prob.inference.search.yaw_search import with_other_yaws
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.noise import NoiseFamily
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.rollout import Rollout
from vrdp_prob.models.unknowns import MOTION, NOISE, Held, Structure, unknowns
from vrdp_prob.progress import ProgressDisplay, SilentProgress
from vrdp_prob.scene import Tracks

GOOD_COST = 1.15
"""A fit is plausible up to this factor on the cost that noise alone would make."""
LBFGS_ITERATIONS = 30
MAY_CATCH_UP = 15.0
"""Nats that a start may gain on the best one after the first turn of a refinement."""


class NoWorldError(InputError):
    """No world of the model is like the tracks, whatever its numbers."""


@dataclass(frozen=True)
class MapFit:
    """The most probable values and the Gaussian around them.

    Parameters
    ----------
    likelihood
        The density, reduced to the unknowns that the motion says something about.
    modes
        Its modes that were found, best first; the first is the MAP.
    converged
        Whether the last refinement ended by itself.
    search
        How far other modes were looked for.
    clues
        What the tracks show by themselves.
    misfit
        How the residuals compare with the noise.
    evaluations
        Number of worlds simulated.
    believed_at_rest
        Bodies that were hit before the tracks had shown whether they moved, and that rest explains better.
    """

    likelihood: Likelihood
    modes: tuple[Mode, ...]
    converged: bool
    search: ModeSearch
    clues: Clues
    misfit: Misfit
    evaluations: int
    believed_at_rest: frozenset[int] = frozenset()

    @property
    def point(self) -> Float[np.ndarray, "dimension"]:
        """The MAP."""
        return self.modes[0].point

    @property
    def precision(self) -> Float[np.ndarray, "dimension dimension"]:
        """Gauss-Newton curvature of the negative log posterior at the MAP."""
        return self.modes[0].precision

    @property
    def log_density(self) -> float:
        """Log posterior at the MAP."""
        return self.modes[0].log_density

    @cached_property
    def rollout(self) -> Rollout:
        """The world of the MAP, as a batch of one."""
        with torch.no_grad():
            return self.likelihood.rollout(torch.from_numpy(self.point[None]))

    @cached_property
    def contacts(self) -> Pairs:
        """Pairs of bodies that collide in the world of the MAP, in the order of their first contact."""
        return first_contacts(self.rollout, 0)

    def given_motion(self) -> "MapFit":
        """The fit of what remains unknown when the motion is held at its most probable values; of one mode."""
        held = self.likelihood.coordinates.held(MOTION, self.point)
        likelihood, modes = restricted(self.likelihood, self.modes[:1], held)
        return replace(self, likelihood=likelihood, modes=modes)


def fit_map(
    tracks: Tracks,
    model: PhysicsModel,
    generator: np.random.Generator,
    progress: ProgressDisplay | None = None,
    *,
    noise: NoiseFamily | None = None,
    plan: FitPlan | None = None,
    model_error: bool = True,
    held: Held | None = None,
) -> MapFit:
    """Find the most probable values of a video.

    Parameters
    ----------
    tracks
        What was seen.
    model
        The physics.
    generator
        Source of the candidate worlds.
    progress
        Told how many windows are done.
    noise
        Distribution of the measurement errors; where None, Student-t if the tracks or what the fit leaves show gross
        outliers, else Gaussian.
    plan
        Stages and optimiser; `FitPlan()` where None.
    model_error
        Whether what the model leaves unexplained is looked for, and widens the density.
    held
        Numbers that are not unknown though the model has them; none where None.

    Raises
    ------
    InputError
        If no object moves.
    NoWorldError
        If no world begins as the tracks do, in which bodies overlap, say; that is an `InputError`, too.
    """
    clues = Clues.of(tracks)
    if not clues.show_motion:
        raise InputError(f"{tracks.video}: no object moves, so nothing can be inferred; give tracks with motion.")
    family = clues.noise_family if noise is None else noise
    stages = FitPlan() if plan is None else plan
    known = Structure(moving=clues.moving, colliding=frozenset(), held=held or {})
    task = _Task(clues, model, family, stages, known)
    attempts = _attempts(task, generator, progress)
    everything = attempts[0].likelihood
    starts = [one.point for one in merged(everything, [one for fit in attempts for one in fit.hypotheses])]
    structure = structure_at(everything, starts, known)
    likelihood = Likelihood(tracks, model, unknowns(tracks, model, structure, family), family)
    refined = partial(_refined, plan=stages)
    found = _possible(tracks, refined(everything, starts, likelihood))
    evaluations = sum(one.evaluations for one in attempts) + sum(one.evaluations for one in found)
    if stages.alternatives and stages.yaws:
        turned = with_other_yaws(
            likelihood,
            found,
            refined,
            lambda one: judge(likelihood, one.point, clues).ratio < stages.like_noise,
            optimiser=stages.optimiser,
        )
        # A model error may explain what another yaw explains, too; so both are candidates under one.
        found = turned.found
        evaluations += turned.evaluations
    reordered = _reordered(likelihood, found, stages)
    found, evaluations, all_orders = reordered.found, evaluations + reordered.evaluations, reordered.complete
    explained = with_bodies_at_rest(Explained(likelihood, structure, found, evaluations), refined)
    likelihood, structure, found = explained.likelihood, explained.structure, explained.found
    evaluations = explained.evaluations
    believed_at_rest = clues.moving - structure.moving
    if noise is None and family is NoiseFamily.GAUSSIAN and shows_outliers(clues, likelihood, found[0].point):
        family = NoiseFamily.STUDENT_T
        heavy = Likelihood(tracks, model, unknowns(tracks, model, structure, family), family)
        tempered = refined(likelihood, [one.point for one in found], heavy)
        evaluations += sum(one.evaluations for one in tempered)
        if (further := with_outliers(clues, heavy, tempered[0].point)) is not clues:
            clues, likelihood, found = further, heavy, tempered
    misfit = judge(likelihood, found[0].point, clues)
    if model_error:
        explained = Explained(likelihood, structure, found, evaluations)
        explained, misfit, complete = _with_model_error(explained, clues, misfit, stages)
        likelihood, found, evaluations = explained.likelihood, explained.found, explained.evaluations
        all_orders &= complete
    climbed = _climbed(likelihood, _best(found))
    evaluations += sum(one.evaluations for one in climbed)
    while (wider := with_all_that_meet(likelihood, structure, [one.point for one in climbed])) is not None:
        structure, widened = wider
        found = refined(likelihood, [one.point for one in climbed], widened)
        climbed = _climbed(widened, found)
        likelihood = widened
        evaluations += sum(one.evaluations for one in (*found, *climbed))
    likelihood, modes = without_idle(likelihood, distinct_modes(likelihood, climbed), structure)
    converged = at_the_top(found, climbed)
    search = ModeSearch(stages.alternatives, len(attempts), not _in_doubt(attempts), all_orders)
    return MapFit(likelihood, modes, converged, search, clues, misfit, evaluations, believed_at_rest)


def _possible(tracks: Tracks, found: list[Refined]) -> list[Refined]:
    """What was found of some tracks, if any of it is possible."""
    if np.isfinite(found[0].log_density):
        return found
    overlaps = tracks.overlaps()
    why = f"{'; '.join(overlaps)}; check positions and radii" if overlaps else "check positions, radii and walls"
    raise NoWorldError(
        f"{tracks.video}: no world of the model begins as its bodies are first seen: {why}, or leave the video out."
    )


def _refined(
    source: Likelihood, starts: Sequence[Float[np.ndarray, "dimension"]], likelihood: Likelihood, *, plan: FitPlan
) -> list[Refined]:
    """What refinement makes of several starts, the best first; those without hope left out."""
    descent = Descent(likelihood, plan.optimiser)
    carried = [source.coordinates.carried(point, likelihood.coordinates) for point in starts]
    return _best(refine(descent, carried, hopeless=HOPELESS + MAY_CATCH_UP))


def _with_model_error(
    explained: Explained, clues: Clues, misfit: Misfit, plan: FitPlan
) -> tuple[Explained, Misfit, bool]:
    """The explanation under a density that allows for what the model lacks, where it lacks something.

    And whether all orders of contacts that this leaves open were tried. An error that a fit was to allow for, and of
    which its residuals then show nothing, is none, unless they were large without it.
    """
    likelihood, structure, found = explained.likelihood, explained.structure, explained.found
    evaluations, complete, before = explained.evaluations, True, misfit
    for turn in range(TURNS):
        error = next_model_error(likelihood, found[0].point, clues, misfit)
        if turn == 1 and error is likelihood.model_error and not before.large:
            return replace(explained, evaluations=evaluations), before, True
        if error is None or error is likelihood.model_error:
            break
        tracks, model = likelihood.tracks, likelihood.model
        widened = Likelihood(tracks, model, unknowns(tracks, model, structure, model_error=error), model_error=error)
        found = _refined(likelihood, [one.point for one in found], widened, plan=plan)
        likelihood = widened
        evaluations += sum(one.evaluations for one in found)
        misfit = misfit.with_error(error, likelihood.observations.position_reference)
    if likelihood.model_error is not None:  # it leaves open more orders of contacts than noise does
        reordered = _reordered(likelihood, found, plan)
        found, complete = reordered.found, reordered.complete
        evaluations += reordered.evaluations
    return Explained(likelihood, structure, found, evaluations), misfit, complete


def _reordered(likelihood: Likelihood, found: Sequence[Refined], plan: FitPlan) -> Searched:
    """Maxima with those in which close contacts have come in another order, where a plan has several starts."""
    if not plan.alternatives:
        return Searched(list(found), 0)
    searched = with_other_orders(likelihood, found, partial(_refined, plan=plan), optimiser=plan.optimiser)
    return replace(searched, found=_best(searched.found))


def _best(found: Sequence[Refined]) -> list[Refined]:
    """The best of some maxima and those that are not hopelessly worse, the best first."""
    ordered = best_first(found)
    return [one for one in ordered if one is ordered[0] or one.log_density > ordered[0].log_density - HOPELESS]


def _climbed(likelihood: Likelihood, found: Sequence[Refined]) -> list[Refined]:
    """The distinct ones of some maxima on the exact log posterior."""
    return [climb(likelihood, mode, LBFGS_ITERATIONS) for mode in distinct_modes(likelihood, found)]


@dataclass(frozen=True)
class _Task:
    """What is fitted, and how; `known` is which bodies move, and what is held."""

    clues: Clues
    model: PhysicsModel
    noise: NoiseFamily
    plan: FitPlan
    known: Structure


def _attempts(task: _Task, generator: np.random.Generator, progress: ProgressDisplay | None) -> list[GrowingFit]:
    """Fits that grow anew from other draws until no doubt is left."""
    attempts = [_grow(task, generator, progress)]
    while _in_doubt(attempts) and len(attempts) < task.plan.attempts:
        attempts.append(_grow(task, generator, progress))
    return attempts


def _in_doubt(attempts: Sequence[GrowingFit]) -> bool:
    """Whether a fit met what easily leads astray or explains too little, and no two agree on the best explanation."""
    costs = [one.hypotheses[0].cost for one in attempts]
    expected = attempts[0].expected_cost(len(attempts[0].likelihood.tracks.times))
    return not agree(costs, expected) and (any(one.doubtful for one in attempts) or min(costs) >= GOOD_COST * expected)


def _grow(task: _Task, generator: np.random.Generator, progress: ProgressDisplay | None) -> GrowingFit:
    """Fit windows that grow to the whole video, with everything that might matter among the unknowns.

    Under Student-t noise a course of events that is wrong from some time on hardly differs from many outliers, so
    windows grow with Gaussian noise, and without the outliers that the tracks show by themselves.
    """
    clues, tracks, plan = task.clues, task.clues.tracks, task.plan
    everything = frozenset(body for body, one in enumerate(tracks.bodies) if one.radius is not None)
    structure = replace(task.known, colliding=everything)
    left_out = clues.outliers if task.noise is NoiseFamily.STUDENT_T else None
    likelihood = Likelihood(tracks, task.model, unknowns(tracks, task.model, structure), left_out=left_out)
    growing = GrowingFit(likelihood, _start(likelihood, clues), clues, generator, plan)
    growing.trust_release_fits(
        {body: (clues.noise, clues.release(body).velocity_sd) for body in range(len(tracks.bodies))}
    )
    if plan.free_first:
        growing.fit_free_flight()
    ends = plan.ends(tracks)
    with (progress or SilentProgress()).stage("Fitting the motion (MAP)", total=len(ends)) as advance:
        previous = 0
        for end in ends:
            growing.grow(end, previous)
            previous = end
            advance(1)
    return growing


def _start(likelihood: Likelihood, clues: Clues) -> Float[np.ndarray, "dimension"]:
    """Release states of local fits, everything else at the mean of its prior."""
    coordinates = likelihood.coordinates
    start = coordinates.prior_mean.copy()
    for body in range(len(likelihood.tracks.bodies)):
        fit = clues.release(body)
        values = dict(zip(("x", "y", "velocity_x", "velocity_y"), (*fit.position, *fit.velocity), strict=True))
        values["spin"] = clues.release_spin(body)
        for field, value in values.items():
            place = coordinates.places.get((field, body))
            if place is not None:
                start[place] = value
    if (place := coordinates.places.get((NOISE, None))) is not None:
        start[place] = np.log(clues.noise / likelihood.observations.position_reference)
    return released_apart(likelihood, start, clues.noise)

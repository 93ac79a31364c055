"""From each video's own fit to a joint one: second looks, what all agree on, and the climb from there."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from jaxtyping import Float

from vrdp_prob.inference.map_fit import MapFit
from vrdp_prob.inference.runs.journal import kept
from vrdp_prob.inference.runs.parallel import in_processes
from vrdp_prob.inference.search.misfit import judge
from vrdp_prob.inference.search.plan import TURNING, FitPlan, Optimiser
from vrdp_prob.inference.search.yaw_search import tells_yaws_by_contacts
from vrdp_prob.inference.several_videos.agreement import first_guess
from vrdp_prob.inference.several_videos.ascent import climb
from vrdp_prob.inference.several_videos.climb_state import ImpossibleStartError
from vrdp_prob.inference.several_videos.gradient_ascent import climb_by_gradient
from vrdp_prob.inference.several_videos.joint_fit import JointFit
from vrdp_prob.inference.several_videos.linking import LinkedVideo, SharedNumbers
from vrdp_prob.inference.several_videos.parts import carried_starts, fit_alone, link_fits
from vrdp_prob.inference.several_videos.second_look import (
    FAR_WORSE,
    WORSE,
    doubtful,
    explained,
    look_again,
    most_astray,
    trusted,
)
from vrdp_prob.models.physics import PhysicsModel

Climb = Callable[
    [SharedNumbers, Sequence[LinkedVideo], Float[np.ndarray, "shared"], Sequence[Float[np.ndarray, "_"]]], JointFit
]
"""A way up the joint log posterior from some start."""

CLIMBS: Mapping[Optimiser, Climb] = {Optimiser.GAUSS_NEWTON: climb, Optimiser.LBFGS: climb_by_gradient}
"""How the joint log posterior is climbed by each optimiser."""


@kept
def joined(
    alone: Sequence[MapFit],
    model: PhysicsModel,
    shared: Sequence[str] | None,
    *,
    seed: int,
    plan: FitPlan,
) -> tuple[list[MapFit], JointFit]:
    """The videos' own fits, some of them searched anew, and the joint fit from what they agree on.

    Where a video strays in it though most are explained by themselves, cubes may be on wrong islands of yaw and spin.
    Then the cubes of all videos are turned, and where a video strays still, the videos are joined without what cubes
    say of the decay of spins; the most probable fit is taken.

    Parameters
    ----------
    alone
        The videos' own fits.
    model, shared, seed
        See `fit_together`.
    plan
        How the videos were fitted; one that has no several starts leaves their own fits as they are.
    """
    join = partial(_joined, model=model, shared=shared, seed=seed, plan=plan)
    found = [join(alone, islands=False)]
    may_be_turned = plan.alternatives and explained(alone) and any(_has_unseen_yaws(fit) for fit in alone)
    if not may_be_turned or not _strays(*found[0]):
        return found[0]
    turned = _turned(alone, model, seed=seed, optimiser=plan.optimiser)
    if any(one is not other for one, other in zip(turned, alone, strict=True)):
        found.append(join(turned, islands=False))
    if _strays(*found[-1]):
        found.append(join(turned, islands=True))
    return max(found, key=lambda one: one[1].log_density)


def _strays(fits: Sequence[MapFit], joint: JointFit) -> bool:
    """Whether some videos, but no more than half of them, are explained worse in a joint fit than by themselves.

    Where more are, it is the model that lacks something.
    """
    return 0 < int((_worsened(fits, joint) > WORSE).sum()) <= most_astray(len(fits))


def _has_unseen_yaws(fit: MapFit) -> bool:
    return tells_yaws_by_contacts(fit.likelihood, fit.point)


def _turned(alone: Sequence[MapFit], model: PhysicsModel, *, seed: int, optimiser: Optimiser) -> list[MapFit]:
    """The videos' own fits, with cubes whose yaw nobody measured turned where that explains a video better."""
    chosen = [index for index, fit in enumerate(alone) if _has_unseen_yaws(fit)]
    turn = partial(fit_alone, model=model, seed=seed, plan=replace(TURNING, optimiser=optimiser))
    again = in_processes(turn, [alone[index].clues.tracks for index in chosen])
    better = {
        index: fit for index, fit in zip(chosen, again, strict=True) if fit.log_density > alone[index].log_density
    }
    return [better.get(index, fit) for index, fit in enumerate(alone)]


def _joined(
    alone: Sequence[MapFit],
    *,
    model: PhysicsModel,
    shared: Sequence[str] | None,
    seed: int,
    plan: FitPlan,
    islands: bool,
) -> tuple[list[MapFit], JointFit]:
    look = partial(look_again, model=model, shared=shared, seed=seed, islands=islands, optimiser=plan.optimiser)
    fits = look(alone, doubtful(alone) if plan.alternatives else [])
    numbers, linked, guess = _guessed(fits, model, shared, islands=islands)
    seen = [_with_misfit(fit, video, guess[0], own) for fit, video, own in zip(fits, linked, guess[1], strict=True)]
    lost = [k for k, fit in enumerate(fits) if seen[k].misfit.residual_sd > WORSE * fit.misfit.residual_sd]
    found_again = look(seen, doubtful(seen, lost) if plan.alternatives else [])
    if any(one is not other for one, other in zip(found_again, seen, strict=True)):
        pairs = zip(found_again, seen, fits, strict=True)
        fits = [fit if one is other else one for one, other, fit in pairs]
        numbers, linked, guess = _guessed(fits, model, shared, islands=islands)
    climbed = CLIMBS[plan.optimiser](numbers, linked, *guess)
    return fits, _asking_dissenters(climbed, fits, CLIMBS[plan.optimiser])


def _worsened(fits: Sequence[MapFit], joint: JointFit) -> Float[np.ndarray, "video"]:
    """Residuals of each video in a joint fit, in units of those that it has by itself."""
    parts = zip(fits, joint.videos, joint.gaussian.locals, strict=True)
    seen = [_with_misfit(fit, video, joint.gaussian.mean, own.centre) for fit, video, own in parts]
    return np.array([one.misfit.residual_sd / fit.misfit.residual_sd for one, fit in zip(seen, fits, strict=True)])


def _guessed(
    fits: Sequence[MapFit], model: PhysicsModel, shared: Sequence[str] | None, *, islands: bool
) -> tuple[SharedNumbers, tuple[LinkedVideo, ...], tuple[Float[np.ndarray, "shared"], list[Float[np.ndarray, "_"]]]]:
    """The videos linked by what they share, and where their climb begins."""
    numbers, linked = link_fits(fits, model, shared)
    starts = carried_starts(fits, linked)
    return numbers, linked, first_guess(numbers, linked, starts, trusted(fits).tolist(), islands=islands)


def _with_misfit(
    fit: MapFit, video: LinkedVideo, shared: Float[np.ndarray, "shared"], own: Float[np.ndarray, "_"]
) -> MapFit:
    """A video's own fit with what its residuals are where it shares numbers with the others."""
    point = video.points(shared, own)
    return replace(fit, misfit=judge(video.likelihood, point, fit.clues))


def _asking_dissenters(joint: JointFit, fits: Sequence[MapFit], climbing: Climb) -> JointFit:
    """The joint fit, or a better one from what the video says alone that is explained far worse among the others.

    Several videos that are explained in the same wrong way outvote the one in which that shows.
    """
    if len(fits) == 1:
        return joint
    worse = _worsened(fits, joint)
    dissenter = int(np.argmax(worse))
    if worse[dissenter] < FAR_WORSE:
        return joint
    starts = carried_starts(fits, joint.videos)
    asked = [index == dissenter for index in range(len(fits))]
    try:
        other = climbing(joint.numbers, joint.videos, *first_guess(joint.numbers, joint.videos, starts, asked))
    except ImpossibleStartError:  # a video has no world at what the dissenter says
        return joint
    return max(joint, other, key=lambda one: one.log_density)

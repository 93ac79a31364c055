"""Causes that were tried on the best model and not established: what they gain, and what they would have to."""

from collections.abc import Collection

import numpy as np

from vrdp_prob.discovery.finding import TriedCause
from vrdp_prob.discovery.selection.gains import gain, weights
from vrdp_prob.discovery.selection.refits import ESTABLISHED
from vrdp_prob.discovery.selection.search import Search
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.models.effects.effect import Effect


def tried_causes(found: Search, told: Collection[str], *, seed: int) -> list[TriedCause]:
    """What further causes bring to the best model, those that bring most first.

    Parameters
    ----------
    found
        The search.
    told
        Names of effects that are told of otherwise.
    seed
        Of the drawing of videos.
    """
    best_of: dict[str, Trial] = {}
    for trial in found.refits.made(found.best):
        cause = _further(trial, found)
        if cause.name not in told:
            best_of.setdefault(cause.name if cause.follows else cause.cause_name(), trial)
    return sorted((_tried(found, trial, seed) for trial in best_of.values()), key=lambda one: -one.gain)


def _further(trial: Trial, found: Search) -> Effect:
    """The first cause that a model has beyond the best one."""
    return next(iter(trial.beyond(found.best)), trial.causes[-1])


def _tried(found: Search, trial: Trial, seed: int) -> TriedCause:
    difference, error = gain(trial, found.best, found.overdispersion)
    generator = np.random.default_rng(seed)
    shares = weights([trial, found.best], [0.0, found.needed], generator, overdispersion=found.overdispersion)
    probability = float(np.clip(shares[0], 0.0, 1.0))
    cause = _further(trial, found)
    if trial.patches(cause):
        why = "it mends videos and explains none of them"
    elif difference < found.needed:
        why = "it gains too little"
    elif probability < ESTABLISHED:
        why = "too few videos speak for it"
    elif trial.may_vanish(cause, found.overdispersion):
        why = "its strength may as well be nothing"
    else:
        why = "what it leaves unexplained outweighs its gain"
    return TriedCause(cause.cause_name(), difference, error, found.needed, probability, ESTABLISHED, why, cause.way())

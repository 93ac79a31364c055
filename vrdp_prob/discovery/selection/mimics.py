"""Causes that only follow what something outside the catalogue does.

Kicks, patches and jumps of the clock can be put where a law that the catalogue does not hold leaves most, and predict
left-out videos better than nothing does. What such a law does elsewhere remains then, and shows in the checks. So where
something remains, causes are compared with a law of no particular cause (`unlisted_law`), beside them and in the place
of each: of the motion, of the rebound, or of both, by what remains.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from vrdp_prob.discovery.candidates.scores import score_causes
from vrdp_prob.discovery.candidates.unlisted_law import UnlistedMotion, UnlistedRebound
from vrdp_prob.discovery.checks.bodies import REBOUND
from vrdp_prob.discovery.checks.contacts import REBOUND_AT_WALLS
from vrdp_prob.discovery.checks.measurement import GENERAL
from vrdp_prob.discovery.finding import Check
from vrdp_prob.discovery.selection.gains import gain, weights
from vrdp_prob.discovery.selection.search import FALSE_ALARM, Search
from vrdp_prob.discovery.selection.trials import EACH_PARAMETER, Trial
from vrdp_prob.inference.runs.parallel import in_processes
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.progress import ProgressDisplay, SilentProgress

BELIEVED = 0.5
"""Probability below which a cause is taken to follow something outside the catalogue."""
REBOUNDS = {REBOUND, REBOUND_AT_WALLS}
"""Checks of what the law of rebounds is about."""
UNLISTED = float(np.log(FALSE_ALARM))
"""Log prior odds of such a thing."""


@dataclass(frozen=True)
class Unlisted:
    """What a law of no particular cause explains of some videos.

    Parameters
    ----------
    laws
        The parts of it of which the videos say something.
    mimics
        Names of the causes that it explains away, in the order in which they were found.
    gain, error
        Gain (nats) in the predictive density of left-out videos over what the causes of the catalogue explain, and its
        standard error.
    """

    laws: tuple[Effect, ...]
    mimics: tuple[str, ...]
    gain: float
    error: float


def laws_of(left: Sequence[Check]) -> tuple[Effect, ...]:
    """Laws of no particular cause for what checks say is left."""
    failing = {check.name for check in left if check.significant}
    telling = failing - set(GENERAL) or failing
    motion = (UnlistedMotion(),) if telling - REBOUNDS else ()
    return (*motion, UnlistedRebound()) if telling & REBOUNDS else motion


def without_mimics(
    found: Search, laws: Sequence[Effect], *, seed: int, progress: ProgressDisplay | None = None
) -> tuple[Search, Unlisted | None]:
    """A search without the causes that a law of no particular cause explains away, and what that law explains.

    Parameters
    ----------
    found
        A search whose best model leaves something.
    laws
        What it is asked whether they explain it, at least one.
    seed
        Seed of all randomness.
    progress
        Told how far the work is.

    Returns
    -------
    The search with the best model of the other causes, and None where that law explains hardly more than the causes.
    """
    best = found.best
    with_laws = partial(_with_laws, laws=tuple(laws), seed=seed)
    with (progress or SilentProgress()).stage("Looking outside the catalogue", total=None) as advance:
        beside = with_laws(best)
        advance(1)
        if beside is None or _merit(beside, best, found) < found.needed:
            return found, None
        alone = with_laws(found.base)
        advance(1)
        if alone is not None and _merit(alone, best, found) > 0:
            gained = gain(alone, best, found.overdispersion)
            return found.without(best.causes), Unlisted(_of(alone, laws), _names(best.causes), *gained)
        others = [lesser for lesser in found.lesser if lesser is not found.base]
        refitted = in_processes(with_laws, others, advance=advance)
    instead = {found.base: alone, **dict(zip(others, refitted, strict=True))}
    mimics = [
        cause
        for cause, lesser in zip(best.causes, found.lesser, strict=True)
        if _believed(found, beside, lesser, instead[lesser], seed) < BELIEVED
    ]
    explained = Unlisted(_of(beside, laws), _names(mimics), *gain(beside, best, found.overdispersion))
    return found.without(mimics), explained


def _with_laws(trial: Trial, laws: Sequence[Effect], seed: int) -> Trial | None:
    """A model with laws beside its causes; None where no law promises to bring what it costs, or none can begin."""
    found = trial
    for law in laws:
        scores = score_causes(found.fit, found.unexplained.plain, [law], seed=seed)
        promising = [one for one in scores if one.size / 2 > EACH_PARAMETER * len(law.parameters) - UNLISTED]
        found = (found.with_cause(promising[0]) if promising else None) or found
    return None if found is trial else found.continued()


def _names(causes: Sequence[Effect]) -> tuple[str, ...]:
    return tuple(cause.cause_name() for cause in causes)


def _of(trial: Trial, laws: Sequence[Effect]) -> tuple[Effect, ...]:
    """The laws that are part of a model."""
    return tuple(law for law in laws if law.name in trial.names)


def _merit(trial: Trial, other: Trial, found: Search) -> float:
    """By how much (nats) a model with the law is more probable than one without."""
    return gain(trial, other, found.overdispersion)[0] + trial.log_prior - other.log_prior + UNLISTED


def _believed(found: Search, beside: Trial, lesser: Trial, instead: Trial | None, seed: int) -> float:
    """Probability of a cause, with the law beside it or not, against models without it."""
    compared = [(found.best, 0.0), (beside, UNLISTED), (lesser, found.needed)]
    if instead is not None:
        compared.append((instead, found.needed + UNLISTED))
    trials = [trial for trial, _ in compared]
    log_prior = [trial.log_prior + odds for trial, odds in compared]
    shares = weights(trials, log_prior, np.random.default_rng(seed), overdispersion=found.overdispersion)
    return float(shares[:2].sum())

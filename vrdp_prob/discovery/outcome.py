"""What a search for causes has found, and what is believed of it: doubts, probabilities and the verdict."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from jaxtyping import Float

from vrdp_prob.discovery.checks.false_discovery import something_left
from vrdp_prob.discovery.finding import Check, FoundCause, Gain, Verdict
from vrdp_prob.discovery.selection.doubts import Doubt, Without, doubts, unasked_turns, with_doubts
from vrdp_prob.discovery.selection.estimates import cause_sentence, estimates
from vrdp_prob.discovery.selection.forecast import error_ratios
from vrdp_prob.discovery.selection.gains import gain, gains, weights
from vrdp_prob.discovery.selection.mimics import Unlisted, laws_of, without_mimics
from vrdp_prob.discovery.selection.search import Search
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.progress import ProgressDisplay

MIMIC = 0.5
"""Probability that a cause only follows something outside the catalogue, where something outside it is at work."""
SHARE_EXPLAINED, SHARE_MENDED = 0.5, 0.6
"""Share of what the model left unexplained beyond the noise, and of the checks that failed, that the named causes must
explain for them to be the verdict where something is left."""
LEAST_SHARE = 0.01
"""Probability from which a cause is told of that could take the place of a named one."""


@dataclass(frozen=True)
class Outcome:
    """What a search has found, and what is believed of it.

    Parameters
    ----------
    found
        The search, doubted causes taken out.
    checks, after
        Checks of the model that was given, and of the best one.
    verdict
        What is said of the videos.
    causes
        Causes that are told of.
    gain
        Of the best model over the one that was given; None where it has no causes.
    reasons, unlisted
        Why causes are doubted, in sentences, and what outside the catalogue explains others away.
    """

    found: Search
    checks: tuple[Check, ...]
    after: tuple[Check, ...]
    verdict: Verdict
    causes: tuple[FoundCause, ...]
    gain: Gain | None
    reasons: tuple[str, ...]
    unlisted: tuple[Unlisted, ...]


def outcome_of(found: Search, *, asked: Collection[str], seed: int, progress: ProgressDisplay | None) -> Outcome:
    """Put the causes that a search has found in doubt, and say what is believed of them.

    Parameters
    ----------
    found
        The search.
    asked
        Names of the causes that are looked for, in some videos at least.
    seed
        Seed of all randomness.
    progress
        Told how far the work is.
    """
    checks = found.refits.leavings.checks(found.base)
    found, after, unlisted = _without_mimics(found, seed=seed, progress=progress)
    not_named: list[FoundCause] = []
    reasons: list[str] = []
    cleared: set[Effect] = set()
    while doubted := {cause: some for cause, some in _doubted(found).items() if cause not in cleared}:
        other = next((one for cause in doubted if (one := found.with_rival(cause, _credible)) is not None), None)
        left = found.without(list(doubted)) if other is None else other
        left, after_left, further = _without_mimics(left, seed=seed, progress=progress)
        if other is None:
            if details := _leaving_details(found, doubted, left.best):
                cleared.update(details)
                continue
            reasons += [one.sentence for some in doubted.values() for one in some]
        not_named += [one for one in _causes(found, doubted, seed) if not one.named]
        found, after = left, after_left
        unlisted += further
    reasons += unasked_turns(found.best, asked)
    verdict = Verdict.UNKNOWN if unlisted or reasons else _verdict(found, checks, after)
    causes = _in_order([*_causes(found, {}, seed), *not_named])
    if verdict is Verdict.UNKNOWN:
        causes = [replace(one, probability=(1 - MIMIC) * one.probability) for one in causes]
    without = found.lesser[0] if len(found.best.causes) == 1 else found.base
    gained = _gain(without, found.best, found.overdispersion) if found.best.causes else None
    return Outcome(found, checks, after, verdict, tuple(causes), gained, tuple(reasons), unlisted)


def _checks_after(found: Search) -> tuple[Check, ...]:
    """The checks of the best model, which is the base model where it has no causes."""
    return found.refits.leavings.checks(found.best)


def _without_mimics(
    found: Search, *, seed: int, progress: ProgressDisplay | None
) -> tuple[Search, tuple[Check, ...], tuple[Unlisted, ...]]:
    """A search without the causes that a law of no particular cause explains away, its checks, and what that does."""
    after = _checks_after(found)
    laws = laws_of(after)
    if not found.best.causes or not laws:
        return found, after, ()
    left, unlisted = without_mimics(found, laws, seed=seed, progress=progress)
    told = () if unlisted is None else (unlisted,)
    return left, after if left is found else _checks_after(left), told


def _doubted(found: Search) -> dict[Effect, tuple[Doubt, ...]]:
    """The causes of the best model that are doubted, and why."""
    leavings, best = found.refits.leavings, found.best
    reasons = {}
    for cause, lesser in zip(best.causes, found.lesser, strict=True):
        without = partial(_without, found, lesser, cause)
        reasons[cause] = tuple(doubts(best, cause, leavings.own(best, cause), without=without))
    return {cause: some for cause, some in reasons.items() if some}


def _leaving_details(found: Search, doubted: Iterable[Effect], without: Trial) -> list[Effect]:
    """The causes of the best model that are cleared by the checks of the model without all that are doubted.

    The one without a cause is fitted roughly when that is doubted, and sees little through what lost videos leave.
    """
    leavings, best = found.refits.leavings, found.best
    return [
        cause
        for cause in doubted
        if not any(doubts(best, cause, leavings.own(best, cause), without=partial(_without, found, without, cause)))
    ]


def _without(found: Search, lesser: Trial, cause: Effect) -> Without:
    """What the best model leaves without a cause, of what that does."""
    leavings = found.refits.leavings
    ended = leavings.at_the_end(lesser)
    return Without(leavings.own(ended, cause), found.best.noise / ended.noise)


def _credible(trial: Trial) -> bool:
    """Whether nobody doubts the last cause of a model by its parameters."""
    return not any(doubts(trial, trial.causes[-1]))


def _verdict(found: Search, before: Sequence[Check], after: Sequence[Check]) -> Verdict:
    """What is said of a model whose causes nobody doubts, by the checks before and after."""
    left = something_left(after)
    if not found.best.causes:
        return Verdict.UNKNOWN if left or _loses_any(found.base) else Verdict.NONE
    explained = _excess(found.best) <= (1 - SHARE_EXPLAINED) * _excess(found.base)
    mended = _failing(after) <= (1 - SHARE_MENDED) * _failing(before)
    return Verdict.UNKNOWN if left and not (explained and mended) else Verdict.NAMED


def _loses_any(trial: Trial) -> bool:
    """Whether some video is not explained at all: checks count what it leaves as chance, however much that is."""
    return any(part.misfit.large for part in trial.fit.fits)


def _failing(checks: Sequence[Check]) -> int:
    return sum(check.significant for check in checks)


def _excess(trial: Trial) -> float:
    """Variance of the residuals beyond that of the noise, in units of the noise."""
    return max(float(np.mean([part.misfit.chi_square for part in trial.fit.fits])) - 1.0, 0.0)


def _causes(found: Search, doubted: Mapping[Effect, Sequence[Doubt]], seed: int) -> list[FoundCause]:
    """The causes of the best model, and those that could take the place of one.

    What another way of a cause has for it, that cause has.
    """
    causes: list[FoundCause] = []
    for number, (lesser, rivals) in enumerate(zip(found.lesser, found.rivals, strict=True)):
        best_of = {one.causes[-1].name: one for one in reversed(rivals)}
        trials = [found.best, lesser, *best_of.values()]
        simplest = max(one.log_prior for one in (found.best, *best_of.values()))
        log_prior = [one.log_prior - simplest - found.needed for one in (found.best, *best_of.values())]
        log_prior.insert(1, 0.0)
        shares = weights(trials, log_prior, np.random.default_rng(seed), overdispersion=found.overdispersion)
        cause = found.best.causes[number]
        reasons = doubted.get(cause, ())
        told = {2 + k: rival for k, rival in enumerate(best_of.values()) if shares[2 + k] >= LEAST_SHARE}
        why = {0: reasons} | {k: tuple(doubts(rival, rival.causes[-1])) for k, rival in told.items()}
        believed = with_doubts(shares, why)
        ways: dict[str, list[int]] = {cause.cause_name(): [0]}
        for k in sorted(told, key=lambda k: -believed[k]):
            ways.setdefault(told[k].causes[-1].cause_name(), []).append(k)
        for first, *others in ways.values():
            trial = told.get(first, found.best)
            effect = trial.causes[-1] if first else cause
            probability = float(believed[[first, *others]].sum())
            named = not first and not reasons
            causes.append(_cause(trial, effect, lesser, found.overdispersion, probability, named=named))
    return causes


def _in_order(causes: Sequence[FoundCause]) -> list[FoundCause]:
    """Named causes first, each group by probability; one that may take the place of several stands there once."""
    first: dict[str, FoundCause] = {}
    for cause in sorted(causes, key=lambda one: (not one.named, -one.probability)):
        first.setdefault(cause.effect, cause)
    return list(first.values())


def _cause(
    trial: Trial,
    effect: Effect,
    lesser: Trial,
    overdispersion: Float[np.ndarray, "video"],
    probability: float,
    *,
    named: bool,
) -> FoundCause:
    values = estimates(trial.fit, effect, unexplained=trial.unexplained, overdispersion=overdispersion)
    return FoundCause(
        name=effect.cause_name(),
        probability=min(max(probability, 0.0), 1.0),
        sentence=cause_sentence(effect, values),
        parameters=values,
        gain=_gain(lesser, trial, overdispersion),
        named=named,
        way=effect.way(),
    )


def noise_of(trial: Trial) -> float:
    """Noise (m) of the video in the middle."""
    return float(np.median([part.clues.noise for part in trial.fit.fits]))


def _gain(before: Trial, after: Trial, overdispersion: Float[np.ndarray, "video"]) -> Gain:
    difference, error = gain(after, before, overdispersion)
    videos = after.fit.videos
    return Gain(
        before=before.held_out,
        after=after.held_out,
        noise=noise_of(after),
        elpd_difference=difference,
        elpd_se=error,
        by_video=dict(zip(videos, gains(after, before, overdispersion).tolist(), strict=True)),
        error_ratios=error_ratios(before.held_out, after.held_out),
    )

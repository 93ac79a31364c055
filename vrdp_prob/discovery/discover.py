"""The search for what a model lacks."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from vrdp_prob.discovery.believed import extended_model, models_of_the_others
from vrdp_prob.discovery.checking import check_video_count
from vrdp_prob.discovery.checks import run_checks
from vrdp_prob.discovery.describe import describe
from vrdp_prob.discovery.doubts import Doubt, doubts, with_doubts
from vrdp_prob.discovery.estimates import cause_sentence, estimates, mass_scale_notes, upper_bounds
from vrdp_prob.discovery.figures import residual_figures
from vrdp_prob.discovery.finding import Check, Finding, FoundCause, Gain, UpperBound, Verdict
from vrdp_prob.discovery.free_flight import NORMAL_95
from vrdp_prob.discovery.mimics import Unlisted, laws_of, without_mimics
from vrdp_prob.discovery.search import Search, search
from vrdp_prob.discovery.trials import Trial, gain, gains, weights
from vrdp_prob.discovery.tried import tried_causes
from vrdp_prob.inference import default_model
from vrdp_prob.inference.checkpoint import Checkpoint, model_facts, program_facts, tracks_facts
from vrdp_prob.inference.infer import check_model
from vrdp_prob.inference.journal import journal
from vrdp_prob.inference.parallel import linear_algebra_in_one_thread, several_processes
from vrdp_prob.inference.several_videos.fitting import fit_together
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.model_file import known_effects
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.rollout import compile_model
from vrdp_prob.progress import ProgressDisplay
from vrdp_prob.report.wording import listed
from vrdp_prob.scene import Tracks

MIMIC = 0.5
"""Probability that a cause only follows something outside the catalogue, where something outside it is at work."""
EXPLAINED = 0.5
"""Share of what the model left unexplained beyond the noise, and of the checks that failed, that the named causes must
explain for them to be the verdict where something is left."""

LEFT_LEVEL = 0.005
"""Probability, over all checks, with which a model that explains everything is taken to leave something."""
TELLING = 2.0
"""Overdispersion of a video that is told of."""
LEAST_SHARE = 0.01
"""Probability from which a cause is told of that could take the place of a named one."""


@linear_algebra_in_one_thread
def discover(
    videos: Sequence[Tracks],
    *,
    model: PhysicsModel | None = None,
    seed: int = 0,
    catalogue: Sequence[Effect] | None = None,
    processes: int | None = None,
    progress: ProgressDisplay | None = None,
    checkpoint: Path | str | None = None,
) -> Finding:
    """Say whether a model explains some videos, and if not, which causes it lacks.

    Parameters
    ----------
    videos
        What was seen, at least three videos of one table.
    model
        The physics that is put to the test.
    seed
        Seed of all randomness: the same seed gives the same finding.
    catalogue
        Causes that are looked for; all that the package knows and the model has not where None.
    processes
        Number of processes that fit videos and try causes side by side; as many as there are cores where None.
    progress
        Told how far the work is.
    checkpoint
        Folder that keeps what is done, so that the same call after a kill goes on from there and says the same. It
        holds pickles: one that somebody else made may hold any program.

    Raises
    ------
    InputError
        If there are fewer than three videos, two have one name, a video shows no motion, the model is none, the videos
        have no common world, or the checkpoint belongs to another run.
    """
    check_video_count(videos)
    check_model(model)
    physics = default_model() if model is None else model
    looked_for = _catalogue(physics, catalogue)
    own = None if checkpoint is None else Checkpoint(checkpoint, _facts(videos, physics, looked_for, seed))
    compile_model(physics)
    with several_processes(processes), journal(own):
        fit = fit_together(videos, model=physics, seed=seed, model_error=False, progress=progress)
        found = search(fit, looked_for, seed=seed, progress=progress)
        checks = run_checks(found.base.fit, seed=seed)
        after = _checks_after(found, checks, seed)
        found, after, unlisted = _without_mimics(found, checks, after, seed=seed, progress=progress)
        not_named: list[FoundCause] = []
        reasons: list[Doubt] = []
        while doubted := _doubted(found, after):
            not_named += [one for one in _causes(found, doubted, seed) if not one.named]
            other = next((one for cause in doubted if (one := found.with_rival(cause, _credible)) is not None), None)
            if other is None:
                reasons += [one for some in doubted.values() for one in some]
            found = found.without(list(doubted)) if other is None else other
            after = _checks_after(found, checks, seed)
            found, after, further = _without_mimics(found, checks, after, seed=seed, progress=progress)
            unlisted += further
        verdict = Verdict.UNKNOWN if unlisted or reasons else _verdict(found, checks, after)
        causes = _in_order([*_causes(found, {}, seed), *not_named])
        if verdict is Verdict.UNKNOWN:
            causes = [replace(one, probability=(1 - MIMIC) * one.probability) for one in causes]
        tried = tried_causes(found, {cause.name for cause in causes}, seed=seed)
    return Finding(
        verdict=verdict,
        causes=tuple(causes),
        checks=checks,
        checks_after=after,
        upper_bounds=tuple(_bounds(found, causes)),
        model=physics,
        extended=extended_model(found.best, found.overdispersion),
        videos=tuple(tracks.video for tracks in videos),
        description=describe(found.best.fit, after) if verdict is Verdict.UNKNOWN else None,
        notes=(
            *_notes(found, reasons, unlisted, doubtful=verdict is Verdict.UNKNOWN and bool(causes)),
            *mass_scale_notes(_told(found, causes), videos),
        ),
        figures=residual_figures(
            found.base.fit,
            found.best.fit if found.best.causes else None,
            failing={check.name for check in (*checks, *after) if check.significant},
        ),
        fit=found.best.fit,
        left_out=models_of_the_others(found.base, found.best, found.overdispersion),
        tried=tuple(tried),
    )


def _facts(videos: Sequence[Tracks], model: PhysicsModel, catalogue: Sequence[Effect], seed: int) -> dict[str, str]:
    """What a search depends on, in short texts by name."""
    seen = {f"video {tracks.video}": tracks_facts(tracks)["tracks"] for tracks in videos}
    names = ", ".join(sorted(effect.name for effect in catalogue))
    return {**seen, **model_facts(model), **program_facts(seed=seed, catalogue=names)}


def _catalogue(model: PhysicsModel, catalogue: Sequence[Effect] | None) -> list[Effect]:
    present = {effect.name for effect in model.effects}
    known = [effect() for effect in known_effects().values()] if catalogue is None else catalogue
    return [effect for effect in known if effect.name not in present]


def _checks_after(found: Search, checks: tuple[Check, ...], seed: int) -> tuple[Check, ...]:
    """The checks of the best model; those of the base model where it has no causes."""
    return run_checks(found.best.fit, seed=seed) if found.best.causes else checks


def _without_mimics(
    found: Search, before: tuple[Check, ...], after: tuple[Check, ...], *, seed: int, progress: ProgressDisplay | None
) -> tuple[Search, tuple[Check, ...], tuple[Unlisted, ...]]:
    """A search without the causes that a law of no particular cause explains away, its checks, and what that does."""
    laws = laws_of(after)
    if not found.best.causes or not laws:
        return found, after, ()
    left, unlisted = without_mimics(found, laws, seed=seed, progress=progress)
    told = () if unlisted is None else (unlisted,)
    return left, after if left is found else _checks_after(left, before, seed), told


def _doubted(found: Search, after: Sequence[Check]) -> dict[Effect, tuple[Doubt, ...]]:
    """The causes of the best model that are doubted, and why."""
    reasons = {cause: tuple(doubts(found.best, cause, after)) for cause in found.best.causes}
    return {cause: some for cause, some in reasons.items() if some}


def _credible(trial: Trial) -> bool:
    """Whether nobody doubts the last cause of a model by its parameters."""
    return not any(doubts(trial, trial.causes[-1]))


def _verdict(found: Search, before: Sequence[Check], after: Sequence[Check]) -> Verdict:
    """What is said of a model whose causes nobody doubts, by the checks before and after."""
    left = min((check.p_value for check in after), default=1.0) * len(after) < LEFT_LEVEL
    if not found.best.causes:
        return Verdict.UNKNOWN if left else Verdict.NONE
    most = 1 - EXPLAINED
    explained = _excess(found.best) <= most * _excess(found.base) and _failing(after) <= most * _failing(before)
    return Verdict.UNKNOWN if left and not explained else Verdict.NAMED


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


def _gain(before: Trial, after: Trial, overdispersion: Float[np.ndarray, "video"]) -> Gain:
    difference, error = gain(after, before, overdispersion)
    videos = after.fit.videos
    return Gain(
        before=before.held_out,
        after=after.held_out,
        noise=float(np.median([part.clues.noise for part in after.fit.fits])),
        elpd_difference=difference,
        elpd_se=error,
        by_video=dict(zip(videos, gains(after, before, overdispersion).tolist(), strict=True)),
    )


def _told(found: Search, causes: Sequence[FoundCause]) -> list[Effect]:
    """The effects of some causes."""
    names = {cause.name for cause in causes}
    return [effect for effect in found.refits.catalogue if effect.cause_name() in names]


def _bounds(found: Search, told: Sequence[FoundCause]) -> list[UpperBound]:
    """Bounds of the causes that are not told of, which have estimates instead."""
    estimated = {cause.name for cause in told}
    scores = {score.effect.name: score for score in found.left.beside_chance}
    left = sorted(found.refits.catalogue, key=lambda effect: effect.name not in scores)
    return [
        bound
        for effect in left
        if effect.cause_name() not in estimated
        for bound in upper_bounds(effect, scores.get(effect.name), widening=float(np.sqrt(found.overdispersion.mean())))
    ]


def _notes(found: Search, doubted: Sequence[Doubt], unlisted: Sequence[Unlisted], *, doubtful: bool) -> list[str]:
    notes = []
    if doubtful:
        notes.append(
            "Something outside the catalogue is at work. Causes may only follow it, as likely as not, which their "
            "probabilities count."
        )
    notes += [_unlisted_note(one) for one in unlisted]
    if not found.best.fit.joint.converged:
        notes.append(
            "The joint fit ended before it had converged: some video is at the edge between two courses of events."
        )
    notes += [one.sentence for one in doubted]
    largest = found.best.unexplained.accelerated
    if largest:
        sizes = [f"{one.size:.2g}" for one in sorted(largest, key=lambda one: one.size)]
        duration = float(np.median([one.duration for one in largest]))
        notes.append(
            f"Something that no cause explains accelerates the bodies in {len(largest)} of the "
            f"{len(found.best.fit.videos)} videos at random, by {' to '.join(dict.fromkeys((sizes[0], sizes[-1])))} "
            f"m/s² for about {duration:.1g} s at a time. A cause has to explain more than such chance does, and "
            "intervals allow for it."
        )
    worst = int(np.argmax(found.overdispersion))
    if found.overdispersion[worst] > TELLING:
        notes.append(
            "More than noise is left unexplained: its sums over neighbouring frames are "
            f"{np.sqrt(found.overdispersion[worst]):.2g} times as large as noise would leave them in video "
            f"{found.base.fit.videos[worst]}. Gains are divided by the squares of such factors, and intervals "
            "are that much wider."
        )
    return notes


def _unlisted_note(unlisted: Unlisted) -> str:
    rest = ""
    if unlisted.mimics:
        than = listed(f"'{name}'" for name in unlisted.mimics)
        rest = f"; {than} may only follow it, and {'are' if len(unlisted.mimics) > 1 else 'is'} not named"
    laws = listed(f"{law.sentence[0].lower()}{law.sentence[1:].rstrip('.')}" for law in unlisted.laws)
    better = "better" if unlisted.gain > NORMAL_95 * unlisted.error else "at least as well, as far as they can tell,"
    size = f"{unlisted.gain:.0f} ± {unlisted.error:.0f} nats"
    return f"A model in which {laws} predicts left-out videos {better} ({size}){rest}."

"""From the tracks of several videos to one posterior: the joint fit first, then draws of everything together."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from vrdp_prob.errors import InputError
from vrdp_prob.inference.assembly import posterior_from
from vrdp_prob.inference.draws.diagnostics import Reported, Statistics
from vrdp_prob.inference.draws.samples import ESS_GOAL, PARETO_K_GOAL, Convergence, ModeWeight, Samples, assess
from vrdp_prob.inference.emcee_sampler import sample_emcee
from vrdp_prob.inference.infer import check_counts, check_model, check_plan, default_model
from vrdp_prob.inference.map_fit import MapFit
from vrdp_prob.inference.nuts_sampler import sample_nuts
from vrdp_prob.inference.posterior import Posterior
from vrdp_prob.inference.runs.checkpoint import Checkpoint, model_facts, program_facts, videos_facts
from vrdp_prob.inference.runs.journal import journal
from vrdp_prob.inference.runs.parallel import linear_algebra_in_one_thread
from vrdp_prob.inference.samplers.mode_weights import UNSURE, doubts
from vrdp_prob.inference.samplers.proposals import proposals
from vrdp_prob.inference.samplers.rate_steps import RateSteps
from vrdp_prob.inference.search.plan import FitPlan
from vrdp_prob.inference.search.yaw_search import unseen_yaws
from vrdp_prob.inference.several_videos.fitting import SharedFit, check_videos, fit_together
from vrdp_prob.inference.several_videos.gibbs import sample_gibbs
from vrdp_prob.inference.several_videos.importance import sample_by_importance
from vrdp_prob.inference.several_videos.parts import stream
from vrdp_prob.inference.several_videos.posterior import SharedPosterior, VideoPosteriors
from vrdp_prob.inference.several_videos.whole_vector import WholeVector
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.progress import ProgressDisplay
from vrdp_prob.scene import Tracks

OF_WHOLE_VECTOR: Mapping[str, Callable[..., Samples]] = {"emcee": sample_emcee, "nuts": sample_nuts}
"""Samplers of the vector of all numbers."""
WORK_LIMIT = 40_000_000
"""Work for each video after which they stop (see `work.py` of the simulator)."""
SAMPLERS = ("gibbs", "laplace", *OF_WHOLE_VECTOR)


@dataclass(frozen=True)
class _Drawn:
    """Draws of the shared numbers, and of each video's vector in the same order."""

    shared: Samples
    videos: tuple[Samples, ...]
    log_evidence: float


@linear_algebra_in_one_thread
def infer_together(
    videos: Sequence[Tracks],
    *,
    shared: Sequence[str] | None = None,
    model: PhysicsModel | None = None,
    sampler: str = "gibbs",
    seed: int = 0,
    draws: int = 1000,
    model_error: bool = True,
    hand_on: bool = True,
    plan: FitPlan | None = None,
    checkpoint: Path | str | None = None,
    progress: ProgressDisplay | None = None,
) -> SharedPosterior:
    """Infer what several videos share, and each video's motion, masses and restitutions with it.

    Parameters
    ----------
    videos
        What was seen.
    shared
        Names of the quantities with one value for all videos; where None all that have one value per video (the
        model's shared parameters and the noise), and the restitutions of walls at the same place.
    model
        The physics; `default_model()` where None.
    sampler
        `gibbs` (chains that move the shared numbers and each video's own in turn), `laplace` (fast: the Gaussian of
        the joint fit, corrected by importance sampling), or, for a few videos, `emcee` or `nuts` (all numbers at once).
    seed
        Seed of all randomness: the same seed gives the same posterior.
    draws
        Number of draws to keep.
    model_error
        Whether what the model leaves unexplained in a video is looked for, and widens its part of the density.
    hand_on
        Whether `gibbs` goes on where `laplace` finds that it cannot be trusted.
    plan
        Stages and optimiser of the fit (see `fit_together`); the default ones where None.
    checkpoint
        Folder that keeps what was done: the fits of the single videos, and what the sampler has drawn. A run that was
        killed and is started again with the same arguments goes on from there and ends with the same numbers. Its files
        can hold programs (pickles): go on with folders of your own only.
    progress
        Told how far the work is.

    Raises
    ------
    InputError
        If there is no video, two have one name, a name is none that videos can share, a video shows no motion, the
        model or the plan is none, the sampler is unknown, fewer than 4 draws are asked for, the seed is negative, the
        videos have no common world, or the checkpoint belongs to another run.
    """
    _check(sampler, draws, seed)
    check_model(model)
    check_plan(plan)
    check_videos(videos)
    physics = default_model() if model is None else model
    own = None
    if checkpoint is not None:
        names = None if shared is None else tuple(shared)
        settings: dict[str, object] = {"shared": names, "sampler": sampler, "seed": seed, "draws": draws, "plan": plan}
        settings |= {"model_error": model_error, "hand_on": hand_on}
        own = Checkpoint(checkpoint, {**videos_facts(videos), **model_facts(physics), **program_facts(**settings)})
        own.claim()
    with journal(own):
        fit = fit_together(
            videos,
            model=physics,
            shared=shared,
            seed=seed,
            model_error=model_error,
            plan=plan,
            progress=progress,
        )
    return _sampled(fit, sampler, seed=seed, draws=draws, hand_on=hand_on, checkpoint=own, progress=progress)


def sample_together(
    fit: SharedFit,
    *,
    sampler: str = "gibbs",
    seed: int = 0,
    draws: int = 1000,
    hand_on: bool = True,
    progress: ProgressDisplay | None = None,
) -> SharedPosterior:
    """The posterior around a joint fit; parameters as in `infer_together`."""
    _check(sampler, draws, seed)
    return _sampled(fit, sampler, seed=seed, draws=draws, hand_on=hand_on, checkpoint=None, progress=progress)


def _sampled(
    fit: SharedFit,
    sampler: str,
    *,
    seed: int,
    draws: int,
    hand_on: bool,
    checkpoint: Checkpoint | None,
    progress: ProgressDisplay | None,
) -> SharedPosterior:
    """The posterior around a joint fit, with what its sampler has drawn kept in a checkpoint."""
    generator = np.random.default_rng(seed)
    names = [part.likelihood.tracks.video for part in fit.fits]
    reported = [
        Reported.of(part.likelihood.coordinates, part.contacts, part.likelihood.tracks.bodies) for part in fit.fits
    ]
    if sampler == "gibbs":
        drawn = _by_gibbs(fit, reported, generator, progress, checkpoint=checkpoint)
    elif sampler in OF_WHOLE_VECTOR:
        options = {"draws": draws, "generator": generator, "progress": progress, "checkpoint": checkpoint}
        drawn = _by_whole_vector(fit, OF_WHOLE_VECTOR[sampler], reported, **options)
    else:
        drawn = _by_importance(fit, draws, generator, progress)
        if hand_on and (reason := _distrust(drawn.shared, draws)):
            drawn = _by_gibbs(fit, reported, generator, progress, checkpoint=checkpoint, reason=reason)
    each = {
        name: assess(sampler, samples, shown)
        for name, samples, shown in zip(names, drawn.videos, reported, strict=True)
    }
    convergence = _of_shared(sampler, fit, drawn.shared) if len(fit.joint.numbers) else _nothing_shared(sampler, each)
    return SharedPosterior(
        model=fit.model,
        seed=seed,
        numbers=fit.joint.numbers,
        points=drawn.shared.thinned(draws).points,
        most_probable=fit.joint.gaussian.mean,
        log_evidence=drawn.log_evidence,
        convergence=convergence,
        warnings=tuple(_warnings(fit, convergence, each)),
        videos=VideoPosteriors(
            {
                name: _maker(part, samples.thinned(draws), each[name], seed)
                for name, part, samples in zip(names, fit.fits, drawn.videos, strict=True)
            }
        ),
    )


def _check(sampler: str, draws: int, seed: int) -> None:
    if sampler not in SAMPLERS:
        raise InputError(f"sampler '{sampler}' is not known for several videos; use one of {', '.join(SAMPLERS)}.")
    check_counts(draws, seed)


def _by_gibbs(
    fit: SharedFit,
    reported: Sequence[Reported],
    generator: np.random.Generator,
    progress: ProgressDisplay | None,
    *,
    checkpoint: Checkpoint | None,
    reason: str | None = None,
) -> _Drawn:
    """Draws of chains, which go on for a reason where they were not asked for."""
    found = sample_gibbs(fit.joint, generator=generator, progress=progress, reported=reported, checkpoint=checkpoint)
    shape = found.shared.shape
    flat = found.shared.reshape(shape[0] * shape[1], shape[2])
    log_prior = fit.joint.numbers.log_prior(flat).reshape(shape[:2])
    notes = found.notes if reason is None else (reason, *found.notes)

    def samples(
        points: Float[np.ndarray, "chain draw dimension"],
        values: Float[np.ndarray, "chain draw"],
        modes: tuple[ModeWeight, ...] = (),
    ) -> Samples:
        return Samples(
            points, values, r_hat=found.drift, notes=notes, modes=modes, doubts=doubts(modes), sampler="gibbs"
        )

    shared = samples(found.shared, log_prior + np.sum(found.log_density, axis=0))
    parts = zip(fit.joint.videos, found.locals, found.log_density, found.modes, strict=True)
    videos = tuple(
        samples(video.points(found.shared, own), log_prior + value, modes) for video, own, value, modes in parts
    )
    return _Drawn(shared, videos, fit.log_evidence)


def _by_whole_vector(
    fit: SharedFit, sample: Callable[..., Samples], reported: Sequence[Reported], **options: Any
) -> _Drawn:
    """Draws of all numbers at once, by a sampler of one video."""
    joint = fit.joint
    vector, work = WholeVector(joint), len(fit.videos) * WORK_LIMIT
    mode = vector.mode
    if sample is sample_nuts:
        options["courses"] = vector.courses
    found = sample(
        vector,
        proposals([mode], vector.residuals, vector.rates),
        reported=vector.reported(reported),
        rate_steps=RateSteps.of(mode, vector.rates),
        work_limit=work,
        **options,
    )
    shared = found.points[..., : len(joint.numbers)]
    chains, length, count = shared.shape
    flat = shared.reshape(chains * length, count)
    log_prior = joint.numbers.log_prior(flat)
    doubtful = [tuple(_further_modes(fit, index)) for index in range(len(joint.videos))]

    def of_video(index: int) -> Samples:
        video, own = joint.videos[index], found.points[..., vector.own_places[index]]
        value = log_prior + video.log_density(flat, own.reshape(len(flat), own.shape[-1]))
        return replace(
            found,
            points=video.points(shared, own),
            log_density=value.reshape(chains, length),
            doubts=(*found.doubts, *doubtful[index]),
        )

    together = replace(found, points=shared, doubts=(*found.doubts, *(one for some in doubtful for one in some)))
    return _Drawn(together, tuple(map(of_video, range(len(joint.videos)))), fit.log_evidence)


def _further_modes(fit: SharedFit, index: int) -> Iterator[str]:
    """A sentence for a video that has modes with a weight beside the one that is set out from."""
    weights = np.exp([mode.log_weight for mode in fit.joint.modes(index)])
    if (left_out := float(weights[1:].sum() / weights.sum())) > UNSURE:
        yield (
            f"Further modes in {fit.videos[index]} hold {left_out:.2f} of what it says, from which only gibbs sets out."
        )


def _by_importance(
    fit: SharedFit, draws: int, generator: np.random.Generator, progress: ProgressDisplay | None
) -> _Drawn:
    found = sample_by_importance(fit.joint, draws=draws, generator=generator, progress=progress)

    def samples(points: Float[np.ndarray, "draw dimension"], values: Float[np.ndarray, "draw"]) -> Samples:
        known = Statistics(1.0, found.effective, found.effective, "every number alike")
        return Samples(points[None], values[None], pareto_k=found.pareto_k, known=known)

    log_prior = fit.joint.numbers.log_prior(found.shared)
    shared = samples(found.shared, log_prior + np.sum(found.log_density, axis=0))
    parts = zip(fit.joint.videos, found.locals, found.log_density, strict=True)
    videos = tuple(samples(video.points(found.shared, own), log_prior + value) for video, own, value in parts)
    return _Drawn(shared, videos, found.log_evidence)


def _distrust(shared: Samples, draws: int) -> str | None:
    """Why importance weights cannot be trusted, if so; half of the draws are enough where these are few."""
    if shared.pareto_k is None or shared.known is None:
        return None
    worth = shared.known.ess_bulk
    if shared.pareto_k <= PARETO_K_GOAL and worth >= min(ESS_GOAL, draws / 2):
        return None
    return (
        f"The fast way could not be trusted (Pareto k {shared.pareto_k:.2f}, {worth:.0f} effective draws), so gibbs "
        "was run."
    )


def _of_shared(sampler: str, fit: SharedFit, samples: Samples) -> Convergence:
    """Convergence of the shared numbers."""
    names = tuple(f"the {name.replace('_', ' ')}" for name in fit.joint.numbers.names)
    return assess(sampler, samples, Reported(names, np.eye(len(names))))


def _maker(part: MapFit, samples: Samples, convergence: Convergence, seed: int) -> Callable[[], Posterior]:
    def make() -> Posterior:
        generator = stream(seed, part.likelihood.tracks.video)
        return posterior_from(part, samples, convergence, seed=seed, generator=generator)

    return make


def _nothing_shared(sampler: str, each: Mapping[str, Convergence]) -> Convergence:
    """Convergence of draws of nothing: that of all videos."""
    converged = all(one.converged for one in each.values())
    return Convergence(sampler, converged, r_hat=None, ess_bulk=None, divergences=None, pareto_k=None)


def _warnings(fit: SharedFit, convergence: Convergence, each: Mapping[str, Convergence]) -> list[str]:
    """What limits the result."""
    sentences = []
    if not fit.joint.converged:
        sentences.append("The search for the most probable values of all videos ended before it had converged.")
    if len(fit.joint.numbers):
        sentences += convergence.notes if convergence.converged else (convergence.sentence,)
    for part in fit.fits:
        name = part.likelihood.tracks.video
        about = [*part.misfit.sentences, part.search.sentence, _yaws_by_contacts(part)]
        sentences += [f"{name}: {sentence}" for sentence in about if sentence]
        if not each[name].converged:
            sentences.append(f"{name}: {each[name].sentence}")
    return sentences


def _yaws_by_contacts(part: MapFit) -> str:
    """A sentence about cubes whose yaw only contacts tell; empty where there are none."""
    bodies = part.likelihood.tracks.bodies
    cubes = [bodies[body].id for body, _ in unseen_yaws(part.likelihood, part.point)]
    if not cubes:
        return ""
    yaws = f"The yaw of cube {cubes[0]} was" if len(cubes) == 1 else f"The yaws of the cubes {', '.join(cubes)} were"
    return f"{yaws} not measured: contacts tell of it on islands of which the draws may leave some out."

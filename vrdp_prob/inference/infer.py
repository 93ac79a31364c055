"""From tracks to posterior: the most probable values first, then a sampler that sets out from them."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from vrdp_prob.errors import InputError, check_whole_number
from vrdp_prob.inference.assembly import posterior_from
from vrdp_prob.inference.draws.diagnostics import Reported
from vrdp_prob.inference.draws.samples import Samples, assess
from vrdp_prob.inference.emcee_sampler import sample_emcee
from vrdp_prob.inference.laplace import sample_laplace
from vrdp_prob.inference.map_fit import MapFit, fit_map
from vrdp_prob.inference.nuts_sampler import sample_nuts
from vrdp_prob.inference.posterior import Posterior
from vrdp_prob.inference.runs.checkpoint import Checkpoint, fingerprint
from vrdp_prob.inference.runs.parallel import linear_algebra_in_one_thread
from vrdp_prob.inference.samplers.contact_ridges import contact_ridges
from vrdp_prob.inference.samplers.mode_weights import UNSURE
from vrdp_prob.inference.samplers.proposals import proposals, share_left_out
from vrdp_prob.inference.samplers.rate_steps import RateSteps
from vrdp_prob.inference.samplers.straightening import Rates
from vrdp_prob.inference.samplers.yaw_tiles import yaw_jumps, yaws_left_out
from vrdp_prob.inference.search.events import courses_at
from vrdp_prob.inference.search.plan import FitPlan
from vrdp_prob.models.effects.body_friction import BodyFriction
from vrdp_prob.models.noise import NoiseFamily
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.progress import ProgressDisplay
from vrdp_prob.scene import Tracks

SAMPLERS: Mapping[str, Callable[..., Samples]] = {
    "emcee": sample_emcee,
    "nuts": sample_nuts,
    "laplace": sample_laplace,
}
"""The samplers by name; all take the log density and what its modes propose."""
FEWEST_DRAWS = 4
OPTIONS = {
    "sampler": tuple(SAMPLERS),
    "noise": ("auto", *NoiseFamily),
    "defaults": ("fixed", "prior"),
    "motion": ("sampled", "fixed"),
}
"""What options of `infer` may be."""


def default_model() -> PhysicsModel:
    """The base model with a friction of its own for every body, which real tables and practice scenes need."""
    return PhysicsModel.base().with_effect(BodyFriction())


@linear_algebra_in_one_thread
def infer(
    tracks: Tracks,
    *,
    sampler: str = "emcee",
    model: PhysicsModel | None = None,
    seed: int = 0,
    draws: int = 1000,
    progress: ProgressDisplay | None = None,
    noise: str = "auto",
    defaults: str = "fixed",
    motion: str = "sampled",
    checkpoint: Path | str | None = None,
    hand_on: bool = True,
    plan: FitPlan | None = None,
) -> Posterior:
    """Infer masses, restitutions and motion from the tracks of one video.

    Parameters
    ----------
    tracks
        What was seen.
    sampler
        `emcee` (ensembles of walkers), `nuts` (Hamiltonian, with gradients) or `laplace` (fast: clouds around the
        modes, corrected by importance sampling).
    model
        The physics; `default_model()` where None.
    seed
        Seed of all randomness: the same seed gives the same posterior.
    draws
        Number of draws to keep, evenly spaced among all that were made; `convergence` judges these.
    progress
        Told how far the work is.
    noise
        Distribution of the measurement errors: `gaussian`, `student_t`, or `auto`: Student-t where the tracks show
        gross outliers.
    defaults
        What becomes of masses and restitutions that the data say nothing about: `fixed` (default values) or `prior`
        (drawn from their prior).
    motion
        `sampled`, or `fixed`: release states are held at their most probable values, and what remains is the posterior
        given that motion.
    checkpoint
        Folder that keeps what the sampler has done. A run that was killed and is started again with the same
        arguments goes on from there and ends with the same numbers.
    hand_on
        Whether emcee goes on where `laplace` finds that it cannot be trusted.
    plan
        Stages and optimiser of the search for the most probable values; `FitPlan()` where None.

    Returns
    -------
    The posterior; its warnings say what limits it.

    Raises
    ------
    InputError
        If the tracks, the model or the plan are none, the sampler or an option is unknown, fewer than 4 draws are asked
        for, the seed is negative, no object moves, or the checkpoint belongs to another run.
    """
    if not isinstance(tracks, Tracks):
        raise InputError(f"tracks is {_given(tracks)}; give the tracks of one video, which vrdp_prob.load reads.")
    check_options(sampler=sampler, noise=noise, defaults=defaults, motion=motion)
    check_counts(draws, seed)
    check_model(model)
    check_plan(plan)
    physics = default_model() if model is None else model
    stages = FitPlan() if plan is None else plan
    kept = None
    if checkpoint is not None:
        settings = {"sampler": sampler, "draws": draws, "noise": noise, "motion": motion, "hand_on": hand_on}
        settings["plan"] = stages
        kept = Checkpoint(checkpoint, fingerprint(tracks, physics, seed=seed, **settings))
        kept.claim()
    generator = np.random.default_rng(seed)
    family = None if noise == "auto" else NoiseFamily(noise)
    fit = fit_map(tracks, physics, generator, progress, noise=family, plan=stages)
    if motion == "fixed":
        fit = fit.given_motion()
    reported = Reported.of(fit.likelihood.coordinates, fit.contacts, tracks.bodies)
    samples = sampled(
        fit,
        sampler,
        draws=draws,
        generator=generator,
        progress=progress,
        checkpoint=kept,
        reported=reported,
        **({"hand_on": hand_on} if sampler == "laplace" else {}),
    )
    convergence = assess(sampler, samples, reported)
    return posterior_from(
        fit,
        samples.thinned(draws),
        convergence,
        seed=seed,
        generator=generator,
        draw_defaults=defaults == "prior",
    )


def sampled(fit: MapFit, sampler: str, *, generator: np.random.Generator, **options: Any) -> Samples:
    """Draws of a sampler that sets out from what a fit has found.

    Parameters
    ----------
    fit
        The fit.
    sampler
        Name of the sampler.
    generator
        Source of randomness.
    options
        What else the sampler takes.
    """
    likelihood, rates = fit.likelihood, Rates.of(fit.likelihood.tracks, fit.likelihood.coordinates)
    start = proposals(fit.modes, likelihood.residuals, rates, partial(contact_ridges, likelihood))
    ways = {
        "jumps": yaw_jumps(likelihood, fit.point, rates, generator),
        "rate_steps": RateSteps.of(fit.modes[0], rates),
    }
    if sampler == "nuts":
        options = {"courses": partial(courses_at, likelihood), **options}
    samples = SAMPLERS[sampler](likelihood.log_density, start, generator=generator, **ways, **options)
    return replace(samples, doubts=(*samples.doubts, *_unexplored(fit)))


def _unexplored(fit: MapFit) -> Iterator[str]:
    """A sentence for what samplers do not look for, and chains that agree do not show to be missing."""
    bodies = fit.likelihood.tracks.bodies
    if cubes := yaws_left_out(fit.likelihood, fit.point):
        names = ", ".join(bodies[cube].id for cube in cubes)
        yield (
            f"The yaws of the cubes {names} were not measured, and all of them are hit: what the contacts tell of so "
            "many lies on islands of which the draws may leave some out."
        )
    if (share := share_left_out(fit.modes)) > UNSURE:
        yield f"There are too many modes to explore all: those that are left out hold {share:.2f} of the evidence."


def check_counts(draws: int, seed: int) -> None:
    """Refuse numbers of draws and seeds that are none.

    Raises
    ------
    InputError
        If one is no whole number, fewer than 4 draws are asked for, or the seed is negative.
    """
    check_whole_number("draws", draws, least=FEWEST_DRAWS)
    check_whole_number("seed", seed, least=0)


def check_plan(plan: object) -> None:
    """Refuse what is no plan of a search.

    Raises
    ------
    InputError
        If it is neither a `FitPlan` nor None.
    """
    if not isinstance(plan, FitPlan | None):
        raise InputError(f"plan is {_given(plan)}; give a FitPlan of vrdp_prob.inference.")


def check_model(model: object) -> None:
    """Refuse what is neither a model nor None, such as the name of its file.

    Raises
    ------
    InputError
        In that case.
    """
    if not isinstance(model, PhysicsModel | None):
        raise InputError(f"model is {_given(model)}; give a PhysicsModel, which PhysicsModel.read reads from a file.")


def _given(value: object) -> str:
    """What was given in place of tracks: a text as it stands, anything else by its kind."""
    return f"'{value}'" if isinstance(value, str | Path) else f"a {type(value).__name__}"


def check_options(**options: str) -> None:
    """Refuse values that options of `infer` cannot have.

    Raises
    ------
    InputError
        If there is such a value.
    """
    for name, value in options.items():
        if value not in OPTIONS[name]:
            raise InputError(f"{name} '{value}' is not known; use one of {', '.join(OPTIONS[name])}.")

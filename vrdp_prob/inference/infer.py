"""From tracks to posterior: the most probable values first, then a sampler that sets out from them."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float

from vrdp_prob.errors import InputError
from vrdp_prob.inference.checkpoint import Checkpoint, fingerprint
from vrdp_prob.inference.diagnostics import Reported
from vrdp_prob.inference.emcee_sampler import sample_emcee
from vrdp_prob.inference.events import collision_sequences, first_contacts, wall_contacts
from vrdp_prob.inference.identifiability import BodyStatus, Status, identifiability
from vrdp_prob.inference.laplace import sample_laplace
from vrdp_prob.inference.map_fit import MapFit, fit_map
from vrdp_prob.inference.nuts_sampler import sample_nuts
from vrdp_prob.inference.posterior import Posterior
from vrdp_prob.inference.proposals import proposals
from vrdp_prob.inference.samples import Convergence, Samples, assess
from vrdp_prob.inference.tree import posterior_tree
from vrdp_prob.models.effects.body_friction import BodyFriction
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.progress import ProgressDisplay
from vrdp_prob.scene import Tracks

SAMPLERS: Mapping[str, Callable[..., Samples]] = {
    "emcee": sample_emcee,
    "nuts": sample_nuts,
    "laplace": sample_laplace,
}
"""The samplers by name; all take the log density and what its modes propose."""
BATCH = 500
"""Worlds simulated at once when the draws are looked at again."""


def default_model() -> PhysicsModel:
    """The base model with a friction of its own for every body, which real tables and practice scenes need."""
    return PhysicsModel.base().with_effect(BodyFriction())


def infer(
    tracks: Tracks,
    *,
    sampler: str = "emcee",
    model: PhysicsModel | None = None,
    seed: int = 0,
    draws: int = 1000,
    progress: ProgressDisplay | None = None,
    checkpoint: Path | str | None = None,
    hand_on: bool = True,
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
        Number of draws to keep.
    progress
        Told how far the work is.
    checkpoint
        Folder that keeps what the sampler has done. A run that was killed and is started again with the same
        arguments goes on from there and ends with the same numbers.
    hand_on
        Whether emcee goes on where `laplace` finds that it cannot be trusted.

    Returns
    -------
    The posterior; its warnings say what limits it.

    Raises
    ------
    InputError
        If the sampler is unknown, fewer than 4 draws are asked for, the seed is negative, no object moves, or the
        checkpoint belongs to another run.
    """
    check_sampler(sampler)
    if draws < 4:
        raise InputError(f"draws is {draws}; ask for at least 4.")
    if seed < 0:
        raise InputError(f"seed is {seed}; give a number that is not negative.")
    physics = default_model() if model is None else model
    kept = None
    if checkpoint is not None:
        facts = fingerprint(tracks, physics, seed=seed, sampler=sampler, draws=draws, hand_on=hand_on)
        kept = Checkpoint(checkpoint, facts)
    generator = np.random.default_rng(seed)
    fit = fit_map(tracks, physics, generator, progress)
    reported = _reported(fit)
    samples = SAMPLERS[sampler](
        fit.likelihood.log_density,
        proposals(fit.modes, fit.likelihood.residuals),
        draws=draws,
        generator=generator,
        progress=progress,
        checkpoint=kept,
        reported=reported,
        **({"hand_on": hand_on} if sampler == "laplace" else {}),
    )
    convergence = assess(sampler, samples, reported)
    return posterior_from(fit, samples.thinned(draws), convergence, seed=seed, generator=generator)


def _reported(fit: MapFit) -> Reported:
    """What is read off the draws of a fit: all unknowns, and the ratios and products of pairs that collide."""
    with torch.no_grad():
        rollout = fit.likelihood.rollout(torch.from_numpy(fit.point[None]))
    return Reported.of(fit.likelihood.coordinates, first_contacts(rollout, 0))


def check_sampler(name: str) -> None:
    """Refuse a sampler that does not exist.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    if name not in SAMPLERS:
        raise InputError(f"sampler '{name}' is not known; use one of {', '.join(SAMPLERS)}.")


def posterior_from(
    fit: MapFit, samples: Samples, convergence: Convergence, *, seed: int, generator: np.random.Generator
) -> Posterior:
    """The posterior that draws of a fit make.

    Parameters
    ----------
    fit
        The most probable values and the density around them.
    samples
        The draws to keep.
    convergence
        Whether all draws can be trusted.
    seed
        Seed that is noted in the posterior.
    generator
        Draws the prior and the noise of predicted measurements.
    """
    tracks = fit.likelihood.tracks
    with torch.no_grad():
        rollout = fit.likelihood.rollout(torch.from_numpy(fit.point[None]))
    contacts = first_contacts(rollout, 0)
    status = identifiability(tracks, contacts, wall_contacts(rollout, 0))
    changed = _changed_order(fit, samples.points, contacts)
    convergence = replace(convergence, collision_order_changes=float(changed.mean()))
    names = [body.id for body in tracks.bodies]
    return Posterior(
        tracks=tracks,
        model=fit.likelihood.model,
        seed=seed,
        data=posterior_tree(fit, samples, changed, generator),
        status=status,
        convergence=convergence,
        warnings=tuple(_warnings(fit, convergence, status, contacts)),
        pairs=tuple((names[i], names[j]) for i, j in contacts),
    )


def _changed_order(
    fit: MapFit, points: Float[np.ndarray, "chain draw dimension"], contacts: tuple[tuple[int, int], ...]
) -> Float[np.ndarray, "chain draw"]:
    """1 for a draw in which other pairs collide, or in another order, than in the MAP; else 0."""
    flat = torch.from_numpy(np.ascontiguousarray(points.reshape(-1, points.shape[-1])))
    changed: list[bool] = []
    with torch.no_grad():
        for begin in range(0, len(flat), BATCH):
            rollout = fit.likelihood.rollout(flat[begin : begin + BATCH])
            changed += [sequence != contacts for sequence in collision_sequences(rollout)]
    return np.array(changed, dtype=float).reshape(points.shape[:2])


def _warnings(
    fit: MapFit, convergence: Convergence, status: dict[str, BodyStatus], contacts: tuple[tuple[int, int], ...]
) -> list[str]:
    """What limits the result, the model's misfit first."""
    names = [body.id for body in fit.likelihood.tracks.bodies]
    sentences = list(fit.misfit.sentences)
    if not fit.converged:
        sentences.append("The search for the most probable values ended before it had converged.")
    found = {frozenset(pair) for pair in contacts}
    missed = {(seen.first, seen.second) for seen in fit.contacts if frozenset((seen.first, seen.second)) not in found}
    for first, second in sorted(missed):
        sentences.append(
            f"The tracks look as if objects {names[first]} and {names[second]} collided, but the best fit does without."
        )
    if not convergence.converged:
        sentences.append(convergence.sentence)
    else:
        sentences += convergence.notes
    default = [name for name, one in status.items() if one.mass.status is Status.DEFAULT]
    if default:
        subject = (
            f"Objects {', '.join(default)} never collide" if len(default) > 1 else f"Object {default[0]} never collides"
        )
        sentences.append(f"{subject} in view: mass and restitution are default values, not measured.")
    return sentences

"""Which maxima of a posterior are modes of their own and count, in the unknowns that matter in at least one of them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Float

from vrdp_prob.inference.draws.mode import Mode
from vrdp_prob.inference.draws.samples import evaluate
from vrdp_prob.inference.identifiability.information import Information
from vrdp_prob.inference.identifiability.status import uninformed
from vrdp_prob.inference.search.events import collision_sequences, contacts_with_fixed_things, first_contacts
from vrdp_prob.inference.search.hypothesis import distances
from vrdp_prob.inference.search.passing import close_passes
from vrdp_prob.inference.search.refinement import Refined, best_first, mode_at
from vrdp_prob.models.coordinates import Coordinates
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.unknowns import Structure, felt_masses, unknowns

LEAST_EVIDENCE = 7.0
"""A mode whose Laplace evidence is more nats below the best one's is left out."""
HOPELESS = LEAST_EVIDENCE + 8.0
"""A maximum that is so many nats below the best one has no chance to get there by its volume."""
APART = 2.0
"""Maxima that are not further apart (standard deviations) are one mode."""


def distinct_modes(likelihood: Likelihood, found: Sequence[Refined]) -> tuple[Mode, ...]:
    """The modes among some maxima, best first."""
    left = [mode_at(likelihood, one) for one in best_first(found)]
    kept: list[Mode] = []
    while left:
        kept.append(left[0])
        points = np.array([mode.point for mode in left])
        apart = distances(likelihood, kept[-1].point, kept[-1].precision, points) > APART
        left = [mode for mode, far in zip(left[1:], apart[1:].tolist(), strict=True) if far]
    best = max(mode.log_evidence for mode in kept)
    return tuple(mode for index, mode in enumerate(kept) if not index or mode.log_evidence > best - LEAST_EVIDENCE)


def with_all_that_meet(
    likelihood: Likelihood, structure: Structure, points: Sequence[Float[np.ndarray, "dimension"]]
) -> tuple[Structure, Likelihood] | None:
    """The density with the unknowns of bodies that meet others, or just pass them, at the points and have none yet.

    None where none do.
    """
    met = structure_at(likelihood, points, structure)
    wider = replace(
        structure,
        colliding=structure.colliding | met.colliding,
        bouncing=structure.bouncing | met.bouncing,
        passing=structure.passing | met.passing,
    )
    if wider == structure:
        return None
    return wider, in_unknowns_of(likelihood, wider)


def in_unknowns_of(likelihood: Likelihood, structure: Structure) -> Likelihood:
    """The density in other unknowns of the same bodies."""
    coordinates = unknowns(
        likelihood.tracks, likelihood.model, structure, likelihood.noise, model_error=likelihood.model_error
    )
    return replace(likelihood, coordinates=coordinates)


def without_idle(
    likelihood: Likelihood, modes: Sequence[Mode], known: Structure
) -> tuple[Likelihood, tuple[Mode, ...]]:
    """The same modes without the unknowns of bodies that meet nobody in any of them, or too late to tell."""
    structure = structure_at(likelihood, [mode.point for mode in modes], known)
    idle = _uninformed(likelihood, modes, known.moving)
    structure = replace(structure, colliding=structure.colliding - idle, bouncing=structure.bouncing - idle)
    coordinates = in_unknowns_of(likelihood, structure).coordinates
    if len(coordinates) == len(likelihood.coordinates):
        return likelihood, tuple(modes)
    return restricted(likelihood, modes, coordinates)


def restricted(
    likelihood: Likelihood, modes: Sequence[Mode], coordinates: Coordinates
) -> tuple[Likelihood, tuple[Mode, ...]]:
    """The same modes in some of their unknowns; the others have the values that the coordinates hold them at."""
    reduced = replace(likelihood, coordinates=coordinates)
    places = [likelihood.coordinates.places[key] for key in coordinates.places]
    points = np.array([mode.point[places] for mode in modes])
    values = evaluate(reduced.log_density, points)
    return reduced, tuple(
        Mode(point, mode.precision[np.ix_(places, places)], float(value))
        for mode, point, value in zip(modes, points, values, strict=True)
    )


def _uninformed(likelihood: Likelihood, modes: Sequence[Mode], moving: frozenset[int]) -> frozenset[int]:
    """Bodies of whose mass and restitution no mode says anything."""
    with torch.no_grad():
        rollout = likelihood.rollout(torch.from_numpy(np.array([mode.point for mode in modes])))
    found = [
        uninformed(
            likelihood.tracks,
            first_contacts(rollout, world),
            contacts_with_fixed_things(rollout, world, len(likelihood.tracks.walls)),
            Information(likelihood.coordinates, mode),
            felt=felt_masses(likelihood.model, moving),
            obstacles=likelihood.model.obstacle_restitutions,
        )
        for world, mode in enumerate(modes)
    ]
    return frozenset.intersection(*found)


def structure_at(
    likelihood: Likelihood, points: Sequence[Float[np.ndarray, "dimension"]], known: Structure
) -> Structure:
    """Bodies that meet another one or a fixed thing, and cubes that just pass one, at some of the points.

    Which bodies move, and what is held, is `known`.
    """
    with torch.no_grad():
        rollout = likelihood.rollout(torch.from_numpy(np.array(points)))
    colliding = frozenset(body for pairs in collision_sequences(rollout) for pair in pairs for body in pair)
    walls = len(likelihood.tracks.walls)
    bouncing = frozenset(
        body for world in range(len(points)) for body, _ in contacts_with_fixed_things(rollout, world, walls)
    )
    passing = close_passes(likelihood.tracks, rollout.trajectory.numpy())
    return replace(known, colliding=colliding, bouncing=bouncing, passing=passing - colliding - bouncing)

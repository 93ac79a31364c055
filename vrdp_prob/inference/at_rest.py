"""Bodies that are hit so soon that only a comparison of explanations tells whether they were at rest.

A body at rest has no release velocity. Where too few frames show it before it is hit it might as well have crawled, and
then friction may have stopped it, or not, before the contact: a kink in the middle of the posterior, for velocities to
which the prior gives a chance of one in a thousand. Bodies at rest are common, so a body rests where that explains the
video, as the evidence of both explanations says.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Float

from vrdp_prob.inference.mode import Mode
from vrdp_prob.inference.refinement import Refined, mode_at
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.simulator.events import RolloutEventKind
from vrdp_prob.models.unknowns import Structure, unknowns

BELIEVED = math.log(20.0)
"""Nats by which the evidence of rest has to exceed that of motion."""
SLOW = 10.0
"""A body may rest if its release velocity is no more standard deviations from none, or if it stops before it is hit."""

Refine = Callable[[Likelihood, Sequence[Float[np.ndarray, "dimension"]], Likelihood], list[Refined]]
"""Refines starts in the unknowns of one density in those of another one; the best first."""


def with_bodies_at_rest(
    likelihood: Likelihood, structure: Structure, found: list[Refined], refined: Refine
) -> tuple[Likelihood, Structure, list[Refined]]:
    """The explanations of a video in which bodies rest until they are hit, where these are the better ones.

    Parameters
    ----------
    likelihood
        The density.
    structure
        Which bodies have which of its unknowns.
    found
        Its maxima, best first.
    refined
        How to go on from them in other unknowns.
    """
    mode = mode_at(likelihood, found[0])
    for body in _slow(likelihood, mode):
        still = replace(structure, moving=structure.moving - {body})
        coordinates = unknowns(
            likelihood.tracks, likelihood.model, still, likelihood.noise, model_error=likelihood.model_error
        )
        without = replace(likelihood, coordinates=coordinates)
        starts = [one.point for one in found]
        others = refined(likelihood, [*starts, _stopped(likelihood, mode, body)], without)
        rests = mode_at(without, others[0])
        moves = mode.log_evidence + _log_prior_at_rest(likelihood, body)
        if rests.log_evidence > moves + BELIEVED:
            likelihood, structure, found, mode = without, still, others, rests
    return likelihood, structure, found


def _motion(likelihood: Likelihood, body: int) -> list[int]:
    """Coordinates of a body's release velocity and spin."""
    found = [likelihood.coordinates.places.get((name, body)) for name in ("velocity_x", "velocity_y", "spin")]
    return [place for place in found if place is not None]


def _stopped(likelihood: Likelihood, mode: Mode, body: int) -> Float[np.ndarray, "dimension"]:
    """The values that are most probable, to first order at a mode, where a body rests."""
    own = _motion(likelihood, body)
    covariance = np.linalg.inv(mode.precision)
    following = covariance[:, own] @ np.linalg.inv(covariance[np.ix_(own, own)])
    return np.asarray(mode.point - following @ mode.point[own])


def _log_prior_at_rest(likelihood: Likelihood, body: int) -> float:
    """Log prior density of no motion, which the log density of the tracks leaves out."""
    sd = likelihood.coordinates.prior_sd[_motion(likelihood, body)]
    return float(-np.log(np.sqrt(2 * np.pi) * sd).sum())


def _slow(likelihood: Likelihood, mode: Mode) -> list[int]:
    """Bodies that are hit and may have been at rest until then, the slowest first."""
    with torch.no_grad():
        events = likelihood.rollout(torch.from_numpy(mode.point[None])).events
    places = likelihood.coordinates.places
    covariance = np.linalg.inv(mode.precision)
    speeds: dict[int, float] = {}
    for body in range(len(likelihood.tracks.bodies)):
        of_body = [places.get((name, body)) for name in ("velocity_x", "velocity_y")]
        own = [place for place in of_body if place is not None]
        hits = events.where(
            (events.kind == RolloutEventKind.COLLISION) & ((events.first == body) | (events.second == body))
        )
        if not own or not len(hits):
            continue
        stops = events.where((events.kind == RolloutEventKind.STOP) & (events.first == body))
        speed = float(np.sqrt(mode.point[own] @ np.linalg.solve(covariance[np.ix_(own, own)], mode.point[own])))
        if speed < SLOW or (stops.time < hits.time[0]).any():
            speeds[body] = speed
    return sorted(speeds, key=lambda body: speeds[body])

"""Bodies that are hit so soon that only a comparison of explanations tells whether they were at rest.

A body at rest has no release velocity. Where too few frames show it before it is hit it might as well have crawled, and
then friction may have stopped it, or not, before the contact: a kink in the middle of the posterior, for velocities to
which the prior gives a chance of one in a thousand. Bodies at rest are common, so a body rests where that explains the
video, as the evidence of both explanations says.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Float

from vrdp_prob.inference.draws.mode import Mode
from vrdp_prob.inference.draws.samples import Gaussian, evaluate
from vrdp_prob.inference.search.clues import REST_LOOK
from vrdp_prob.inference.search.modes import in_unknowns_of
from vrdp_prob.inference.search.prior_mass import log_prior_constant
from vrdp_prob.inference.search.refinement import Refine, Refined, mode_at
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.simulator.events import RolloutEventKind
from vrdp_prob.models.unknowns import Structure

BELIEVED = math.log(20.0)
"""Nats by which the evidence of rest has to exceed that of motion."""
WORSE = 6.0
"""Nats by which rest may explain the video worse; by chance it is more once in a hundred times."""
SLOW = 10.0
"""A body may rest if its release velocity is no more standard deviations from none; friction makes these too small."""


@dataclass(frozen=True)
class Explained:
    """How a video is explained.

    Parameters
    ----------
    likelihood
        The density.
    structure
        Which bodies have which of its unknowns.
    found
        Its maxima, best first.
    evaluations
        Worlds simulated on the way.
    """

    likelihood: Likelihood
    structure: Structure
    found: list[Refined]
    evaluations: int = 0

    @cached_property
    def modes(self) -> list[Mode]:
        """The maxima with the curvature around them."""
        return [mode_at(self.likelihood, one) for one in self.found]

    def log_evidence(self, chosen: Sequence[bool] | None = None) -> float:
        """Evidence (nats) of the heaviest of some modes, with the constants of the priors; -inf where there is none."""
        kept = self.modes if chosen is None else [mode for mode, used in zip(self.modes, chosen, strict=True) if used]
        constants = log_prior_constant(self.likelihood.coordinates.entries)
        return max((mode.log_evidence + constants for mode in kept), default=-math.inf)


def with_bodies_at_rest(explained: Explained, refined: Refine) -> Explained:
    """The explanation of a video in which bodies rest until they are hit, where it is the better one.

    Parameters
    ----------
    explained
        The explanation in which they move.
    refined
        How to go on in other unknowns.
    """
    evaluations = explained.evaluations
    for body in _slow(explained):
        rests = _at_rest(explained, body, refined)
        falls = explained.found[0].log_density - rests.found[0].log_density
        evidence = rests.log_evidence()
        # Where friction stops it before it is hit, its velocity may be anything to the curvature, and is next to none.
        in_motion = explained.log_evidence(_in_motion_when_hit(explained, body))
        better = math.isfinite(evidence) and evidence > in_motion + BELIEVED
        evaluations += sum(one.evaluations for one in rests.found)
        explained = rests if better and falls < WORSE else explained
    return replace(explained, evaluations=evaluations)


def _at_rest(explained: Explained, body: int, refined: Refine) -> Explained:
    """The best explanation in which a body rests."""
    likelihood, structure = explained.likelihood, explained.structure
    still = replace(structure, moving=structure.moving - {body})
    without = in_unknowns_of(likelihood, still)
    starts = [one.point for one in explained.found]
    stopped = _stopped(likelihood, explained.modes[0], body)
    carried = likelihood.coordinates.carried(stopped, without.coordinates)
    if np.isfinite(evaluate(without.log_density, carried[None])[0]):
        starts.append(stopped)
    return Explained(without, still, refined(likelihood, starts, without))


def _in_motion_when_hit(explained: Explained, body: int) -> list[bool]:
    """Whether a body moves at its first contact, at each of the maxima."""
    points = torch.from_numpy(np.array([one.point for one in explained.found]))
    with torch.no_grad():
        events = explained.likelihood.rollout(points).events
    events = events.where(events.concerns([body]))
    moving = []
    for world in range(len(points)):
        own = events.of_world(world)
        hits, stops = (own.of_kind(kind).time for kind in (RolloutEventKind.COLLISION, RolloutEventKind.STOP))
        moving.append(not (len(hits) and (stops < hits[0]).any()))
    return moving


def _stopped(likelihood: Likelihood, mode: Mode, body: int) -> Float[np.ndarray, "dimension"]:
    """The values that are most probable, to first order at a mode, where a body rests."""
    places = likelihood.coordinates.places
    own = [places[key] for name in ("velocity_x", "velocity_y", "spin") if (key := (name, body)) in places]
    covariance = _covariance(mode)
    following = covariance[:, own] @ np.linalg.inv(covariance[np.ix_(own, own)])
    return np.asarray(mode.point - following @ mode.point[own])


def _slow(explained: Explained) -> list[int]:
    """Bodies that are hit soon and may have been at rest until then, the slowest first."""
    likelihood = explained.likelihood
    with torch.no_grad():
        hits = likelihood.rollout(torch.from_numpy(explained.found[0].point[None])).events
    hits = hits.of_kind(RolloutEventKind.COLLISION)
    places, first_seen = likelihood.coordinates.places, likelihood.tracks.first_seen
    soon = [
        body
        for time, *pair in zip(hits.time.tolist(), hits.first.tolist(), hits.second.tolist(), strict=True)
        for body in pair
        if ("velocity_x", body) in places and time < first_seen[body] + REST_LOOK
    ]
    if not soon:
        return []
    covariance = _covariance(explained.modes[0])
    speeds: dict[int, float] = {}
    for body in soon:
        own = [places[name, body] for name in ("velocity_x", "velocity_y")]
        velocity = explained.modes[0].point[own]
        speeds[body] = float(np.sqrt(velocity @ np.linalg.solve(covariance[np.ix_(own, own)], velocity)))
    return sorted((body for body, speed in speeds.items() if speed < SLOW), key=lambda body: speeds[body])


def _covariance(mode: Mode) -> Float[np.ndarray, "dimension dimension"]:
    root = Gaussian.from_precision(mode.point, mode.precision).root
    return np.asarray(root @ root.T)

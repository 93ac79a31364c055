"""Worlds at the edge of another course of events, where two bodies just meet, or just miss each other.

A graze deflects by as much as the square root of its depth, so that among worlds drawn at random hardly one has a graze
as light as one that was seen, and where the tracks tell much of the paths none has any. The straight way from an
explanation to a world of another course, in which bodies meet deeply, leads through all depths.
"""

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Float

from vrdp_prob.inference.search.events import courses_at
from vrdp_prob.inference.search.free_flight import Approach, contact_distances
from vrdp_prob.inference.search.hypothesis import Hypothesis
from vrdp_prob.inference.search.least_squares import robust_cost
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.simulator.events import RolloutEventKind

ROUNDS, PLACES = 4, 12
"""Times that the place where the course changes is narrowed down, and worlds between whose places it is each time."""
BEYOND = np.append(0.0, np.logspace(-4, 0, 13))
"""Shares of the way that is left beyond that place, at which the other course is tried."""

AROUND = 3
"""Frames around an approach among which the nearest one is that of an explanation."""
DEEP = 0.5
"""Share of the distance at which two bodies touch, down to which they are brought for them to meet."""
PATH = ("x", "y", "velocity_x", "velocity_y")
"""What is changed of bodies: what else bends their paths is known too little for them to be brought far by it."""
STEP = 0.05
"""Step for derivatives, in standard deviations."""


def made_to_meet(
    likelihood: Likelihood,
    hypothesis: Hypothesis,
    approaches: Sequence[Approach],
    places: np.ndarray,
    frame_count: int,
) -> Float[np.ndarray, "world dimension"]:
    """Worlds in which bodies meet that come near each other, as little different from an explanation as can be.

    Parameters
    ----------
    likelihood
        The density.
    hypothesis
        The explanation; those that meet in it are left as they are.
    approaches
        When which bodies come near each other.
    places
        Places of the coordinates that may change.
    frame_count
        Number of the frames that are simulated.
    """
    entries = likelihood.coordinates.entries
    places = np.array([place for place in places if entries[place].field in PATH], dtype=int)
    gaussian = hypothesis.around(places)
    steps = np.zeros((1 + len(places), len(hypothesis.point)))
    steps[1:, places] = STEP * gaussian.root.T
    with torch.no_grad():
        rollout = likelihood.rollout(torch.from_numpy(hypothesis.point + steps), frame_count)
    contacts = rollout.events.of_world(0).of_kind(RolloutEventKind.COLLISION)
    paths, times = rollout.trajectory[..., :2].numpy(), likelihood.tracks.times[:frame_count]
    nearest: dict[tuple[int, int], tuple[float, Float[np.ndarray, "dimension"]]] = {}
    for approach in approaches:
        pair = (approach.first, approach.second)
        touching = contact_distances(*(likelihood.tracks.bodies[body] for body in pair))
        middle = int(np.searchsorted(times, approach.time))
        frames = np.arange(max(middle - AROUND, 0), min(middle + AROUND + 1, frame_count))
        between = paths[:, frames, approach.first] - paths[:, frames, approach.second]
        if touching is None or len(frames) < 2 or not np.isfinite(between).all():
            continue
        of_pair = contacts.where(contacts.concerns([approach.first]) & contacts.concerns([approach.second]))
        if ((of_pair.time >= times[frames[0]]) & (of_pair.time <= times[frames[-1]])).any():
            continue
        distances = np.linalg.norm(between[0], axis=-1)
        frame = int(distances.argmin())
        depth = DEEP * touching[0]
        across = _across(between[0], frame, depth)
        slopes = (between[1:, frame] - between[0, frame]) @ across / STEP
        if slopes.any() and distances[frame] < nearest.get(pair, (np.inf,))[0]:
            world = hypothesis.point.copy()
            world[places] -= (between[0, frame] @ across - depth) * gaussian.root @ slopes / (slopes @ slopes)
            nearest[pair] = float(distances[frame]), world
    return np.array([world for _, world in nearest.values()]).reshape(-1, len(hypothesis.point))


def _across(between: Float[np.ndarray, "frame 2"], frame: int, depth: float) -> Float[np.ndarray, "2"]:
    """Unit vector along which the way between two bodies at a frame is made shorter, so that they come as near as that.

    That is square to their relative motion, along which they would only meet later; but where they come so near by
    themselves, and have not met yet, along the way between them.
    """
    x, y = np.gradient(between, axis=0)[frame]
    square = np.array([-y, x]) / max(float(np.hypot(x, y)), 1e-12)
    square *= np.sign(between[frame] @ square)
    return square if between[frame] @ square > depth else between[frame] / np.linalg.norm(between[frame])


def best_beyond_edges(
    likelihood: Likelihood,
    point: Float[np.ndarray, "dimension"],
    others: Float[np.ndarray, "other dimension"],
    frame_count: int,
    *,
    threshold: float,
) -> Float[np.ndarray, "other dimension"]:
    """For each of some worlds of other courses: the best on the straight way to it, from where the course changes on.

    Parameters
    ----------
    likelihood
        The density.
    point
        An explanation of the first frames, from which the ways lead.
    others
        Worlds in which other pairs meet, or in another order.
    frame_count
        Number of the first frames.
    threshold
        Residuals beyond it, in units of the noise, pull less.
    """
    if not len(others):
        return others
    own = courses_at(likelihood, torch.from_numpy(point[None]), frame_count)[0]
    nearer, farther = np.zeros(len(others)), np.ones(len(others))
    for _ in range(ROUNDS):
        shares = np.linspace(nearer, farther, PLACES + 2, axis=1)
        found = courses_at(likelihood, torch.from_numpy(_on_the_way(point, others, shares[:, 1:-1])), frame_count)
        is_other = np.array([course != own for course in found]).reshape(len(others), PLACES)
        is_other = np.column_stack([np.zeros(len(others), dtype=bool), is_other, np.ones(len(others), dtype=bool)])
        first = is_other.argmax(axis=1)
        rows = np.arange(len(others))
        nearer, farther = shares[rows, first - 1], shares[rows, first]
    shares = farther[:, None] + (1 - farther[:, None]) * BEYOND
    worlds = _on_the_way(point, others, shares)
    costs = robust_cost(likelihood.residuals(worlds, frame_count), threshold).reshape(shares.shape)
    return worlds.reshape(*shares.shape, -1)[np.arange(len(others)), np.nan_to_num(costs, nan=np.inf).argmin(axis=1)]


def _on_the_way(
    point: Float[np.ndarray, "dimension"],
    others: Float[np.ndarray, "other dimension"],
    shares: Float[np.ndarray, "other place"],
) -> Float[np.ndarray, "world dimension"]:
    """Worlds at some shares of the straight ways to others."""
    return (point + shares[..., None] * (others - point)[:, None]).reshape(-1, len(point))

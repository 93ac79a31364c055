"""Places at which bodies begin without overlap, where noise has put them a little into a wall or into each other."""

from itertools import combinations

import numpy as np
from jaxtyping import Float

from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.scene import Body, Shape, Tracks

ROUNDS = 8
"""Times that each two things are moved apart; what is moved from one may overlap another then."""
MOST_MOVED = 6.0
"""Standard deviations of a position by which a body is moved at most."""
APART = 1e-5
"""Share of the radius of a body that is left between it and what it would overlap."""


def released_apart(
    likelihood: Likelihood, start: Float[np.ndarray, "dimension"], noise: float
) -> Float[np.ndarray, "dimension"]:
    """A world with its bodies moved apart where they overlap walls or each other as they are released.

    A world in which they do is impossible, and no descent leads out of it.

    Parameters
    ----------
    likelihood
        The density.
    start
        The world; its cubes lie with no yaw. It is left as it is where some body would have to be moved by far more
        than the noise: then radii, walls or positions are wrong.
    noise
        Measurement noise in m.
    """
    tracks, places = likelihood.tracks, likelihood.coordinates.places
    result = start.copy()
    owned = {
        body: np.array([places["x", body], places["y", body]])
        for body, one in enumerate(tracks.bodies)
        if one.radius is not None  # the others meet nothing
    }
    for _ in range(ROUNDS):
        for body, own in owned.items():
            result[own] += _out_of_walls(tracks, body, result[own])
        for (one, own), (other, others) in combinations(owned.items(), 2):
            if tracks.first_seen[one] == tracks.first_seen[other]:
                away = _apart(tracks.bodies[one], tracks.bodies[other], result[own] - result[others])
                result[own] += away / 2
                result[others] -= away / 2
    farthest = max((float(np.linalg.norm(result[own] - start[own])) for own in owned.values()), default=0.0)
    return result if farthest < MOST_MOVED * noise else start


def _out_of_walls(tracks: Tracks, body: int, place: Float[np.ndarray, "2"]) -> Float[np.ndarray, "2"]:
    """By how much (m) a body is moved so that it overlaps no wall."""
    away = np.zeros(2)
    for wall in tracks.walls:
        between = place + away - wall.nearest(place + away)
        away += _missing(between, _extent(tracks.bodies[body], between))
    return away


def _apart(first: Body, second: Body, between: Float[np.ndarray, "2"]) -> Float[np.ndarray, "2"]:
    """By how much (m) the way from one body to another must grow for them not to overlap."""
    return _missing(between, _extent(first, between) + _extent(second, between))


def _missing(between: Float[np.ndarray, "2"], reach: float) -> Float[np.ndarray, "2"]:
    distance = float(np.linalg.norm(between))
    if distance >= reach or distance == 0:
        return np.zeros(2)
    return (reach * (1 + APART) - distance) * between / distance


def _extent(body: Body, direction: Float[np.ndarray, "2"]) -> float:
    """How far (m) a body reaches along a direction; a cube as it lies with no yaw. 0 where its radius is not stated."""
    radius = body.radius or 0.0
    if body.shape is not Shape.CUBE:
        return radius
    return radius * float(np.abs(direction).sum() / max(np.linalg.norm(direction), 1e-12))

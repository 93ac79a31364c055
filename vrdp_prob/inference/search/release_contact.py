"""Worlds in which two bodies meet right after their release, before the tracks tell how fast they came."""

import numpy as np
from jaxtyping import Float

from vrdp_prob.models.likelihood import Likelihood

FASTEST = 3.0
"""Bodies come at each other at most so many times as fast as the prior's standard deviation of a speed."""
ASKEW = 0.3
"""Standard deviation (rad) of the angle between the impulse and the line between the bodies at their release."""


def strike_before(
    draws: Float[np.ndarray, "draw dimension"],
    pair: tuple[int, int],
    likelihood: Likelihood,
    generator: np.random.Generator,
) -> None:
    """Give two bodies the velocities from before an impulse that led to those that they have, in place.

    What the tracks show is the motion after it. Momentum says how the impulse divides; its size is open.
    """
    places, tracks = likelihood.coordinates.places, likelihood.tracks
    keys = [[(name, body) for name in ("x", "y", "velocity_x", "velocity_y", "mass")] for body in pair]
    if any(key not in places for part in keys for key in part):
        return
    first, second = (np.array([places[key] for key in part]) for part in keys)
    frame = int(np.argmax(tracks.seen[:, pair].all(axis=1)))
    for body, own in zip(pair, (first, second), strict=True):
        if frame == int(np.argmax(tracks.seen[:, body])):
            draws[:, own[:2]] = tracks.positions[frame, body]
    line = draws[:, first[:2]] - draws[:, second[:2]]
    direction = np.arctan2(line[:, 1], line[:, 0]) + ASKEW * generator.standard_normal(len(draws))
    closing = FASTEST * likelihood.coordinates.prior_sd[first[2]] * generator.random(len(draws))
    share = 1 / (1 + np.exp(draws[:, first[4]] - draws[:, second[4]]))
    step = closing[:, None] * np.column_stack([np.cos(direction), np.sin(direction)])
    draws[:, first[2:4]] -= share[:, None] * step
    draws[:, second[2:4]] += (1 - share)[:, None] * step

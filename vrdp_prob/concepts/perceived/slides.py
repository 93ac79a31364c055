"""How a body slows down while nothing touches it, in fixed numbers: what is made of another stuff slides otherwise."""

from itertools import pairwise

import numpy as np
from jaxtyping import Float

from vrdp_prob.reasoning.sight import Sight

_DECELERATIONS = np.arange(-0.15, 2.0, 0.15)
"""Middles in m/s^2 of the bins that decelerations are gathered in."""
_BIN_SPREAD = 0.12
_PAUSE = 0.04
"""Time in s after and before a contact that is left out."""
_SLOWEST = 0.15
_FEWEST_FRAMES = 6
_LIKELY = -1.0
"""Log odds from which a doubtful contact ends a slide."""
_ENOUGH = 0.3
"""Sum over frames of squared times (s^2, from their mean) at which a slide tells half of what it can."""

SLIDE_STATISTICS = len(_DECELERATIONS) + 1


def slide_statistics(sight: Sight) -> Float[np.ndarray, "body statistic"]:
    """Histogram of each body's decelerations, weighted by how well its slides tell them, and how well they do in all.

    Parameters
    ----------
    sight
        The tracks with their contacts.
    """
    return np.stack([_gathered(_slides(sight, body)) for body in range(len(sight.tracks.bodies))])


def _slides(sight: Sight, body: int) -> Float[np.ndarray, "slide 2"]:
    """Deceleration (m/s^2) in each stretch without a contact, and its weight (s^2)."""
    seen = sight.tracks.times[sight.tracks.seen[:, body]]
    contacts = [
        contact.time
        for contact in sight.contacts
        if body in (contact.first, contact.second) and contact.log_odds > _LIKELY
    ]
    _, velocity = sight.seen.smoothers[body].state(seen)
    speed = np.linalg.norm(velocity, axis=1)
    found = []
    for begin, end in pairwise([float(seen[0]), *contacts, float(seen[-1])]):
        free = (seen > begin + _PAUSE) & (seen < end - _PAUSE) & (speed > _SLOWEST)
        if free.sum() >= _FEWEST_FRAMES:
            time = seen[free] - seen[free].mean()
            weight = float((time**2).sum())
            found.append((-float((time * speed[free]).sum()) / weight, weight))
    return np.array(found).reshape(-1, 2)


def _gathered(slides: Float[np.ndarray, "slide 2"]) -> Float[np.ndarray, "statistic"]:
    deceleration, weight = slides[:, :1], slides[:, 1]
    known = weight.sum() / (weight.sum() + _ENOUGH)
    shares = weight / max(weight.sum(), 1e-9)
    near = np.exp(-(((deceleration - _DECELERATIONS) / _BIN_SPREAD) ** 2) / 2)
    return np.append(known * (shares @ near), known)

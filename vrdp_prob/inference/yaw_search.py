"""Other yaws and spins with which a cube may have met others, looked for over the whole plane of both.

How a cube lies when it is hit, and how fast it turns then, is told by that contact alone, if by anything: many pairs of
them explain it, on islands that no descent crosses between.
"""

from collections.abc import Iterator

import numpy as np
import torch
from jaxtyping import Float

from vrdp_prob.inference.descent import Descent
from vrdp_prob.inference.events import first_contacts
from vrdp_prob.inference.hypothesis import QUARTER, different, frames_before_contact, least_turn, owned, yaw_places
from vrdp_prob.inference.least_squares import Minimum
from vrdp_prob.inference.noise_fit import NOISE_FIELDS
from vrdp_prob.inference.plan import Optimiser
from vrdp_prob.models.likelihood import Likelihood

YAWS, SPINS = 16, 6
"""Yaws over a quarter turn and spins over the prior that are tried together."""
REACH = 2.0
"""Prior standard deviations on either side over which spins are spread."""
AFTER = 16
"""Frames from the first contact on that count at first; later contacts would follow only after a while."""
FIRST_ITERATIONS, HOPELESS = 3, 40.0
"""Steps in the coordinates of the bodies that meet, and nats by which a result may be worse than the best one then."""
THEN_ITERATIONS, NEARLY = 5, 10.0
"""Further steps on all frames, and nats by which a result may be worse after them."""
MOST_KEPT = 16, 8
"""Results that are kept after either."""


def other_yaws(likelihood: Likelihood, point: Float[np.ndarray, "dimension"]) -> list[Minimum]:
    """What is near other maxima of the log posterior, in which a cube has met others with another yaw and spin.

    Parameters
    ----------
    likelihood
        The density.
    point
        A maximum. Every cube that meets something there, and whose yaw nobody measured, is turned by itself.
    """
    descent = Descent(likelihood, Optimiser.GAUSS_NEWTON)
    known = ~likelihood.coordinates.mask(NOISE_FIELDS)
    found: list[Minimum] = []
    for body, frame in unseen_yaws(likelihood, point):
        local = owned(likelihood.coordinates, bodies_met(likelihood, point, body)) & known
        until = min(frame + AFTER, len(likelihood.tracks.times))
        starts = turned_worlds(likelihood, point, body, frame, spins=SPINS, yaws=YAWS)
        first = descent(starts, local, frame_count=until, iterations=FIRST_ITERATIONS)
        kept = different(likelihood, first, worse=HOPELESS, most=MOST_KEPT[0], frame_count=until)
        then = descent(np.array([one.point for one in kept]), local, iterations=THEN_ITERATIONS)
        found += different(likelihood, then, worse=NEARLY, most=MOST_KEPT[1])
    return found


def unseen_yaws(likelihood: Likelihood, point: Float[np.ndarray, "dimension"]) -> Iterator[tuple[int, int]]:
    """Cubes whose yaw only contacts tell and that have some at a point, and the frame before the first of each."""
    before = frames_before_contact(likelihood, point)
    for place in yaw_places(likelihood):
        body = likelihood.coordinates.entries[place].owner
        if body is not None and body in before:
            yield body, before[body]


def tells_yaws_by_contacts(likelihood: Likelihood, point: Float[np.ndarray, "dimension"]) -> bool:
    """Whether there is a cube whose yaw nothing but contacts tells."""
    return next(unseen_yaws(likelihood, point), None) is not None


def bodies_met(likelihood: Likelihood, point: Float[np.ndarray, "dimension"], body: int) -> frozenset[int]:
    """A body and all that it collides with at a point."""
    with torch.no_grad():
        pairs = first_contacts(likelihood.rollout(torch.from_numpy(point[None])), 0)
    return frozenset({body}).union(*(pair for pair in pairs if body in pair))


def turned_worlds(
    likelihood: Likelihood, point: Float[np.ndarray, "dimension"], body: int, frame: int, *, spins: int, yaws: int
) -> Float[np.ndarray, "start dimension"]:
    """Worlds in which a body has other spins and, in a frame, other yaws; all yaws of one spin after one another.

    Spins are spread over their prior, yaws over a quarter turn. A body that rests before its first contact has one
    spin.
    """
    coordinates = likelihood.coordinates
    yaw, spin = coordinates.places["angle", body], coordinates.places.get(("spin", body))
    spinning = np.tile(point, (1 if spin is None else spins, 1))
    if spin is not None:
        spinning[:, spin] = coordinates.prior_mean[spin] + coordinates.prior_sd[spin] * np.linspace(
            -REACH, REACH, spins
        )
    with torch.no_grad():
        angles = likelihood.rollout(torch.from_numpy(spinning)).trajectory[:, frame, body, 2].numpy()
    starts = np.repeat(spinning, yaws, axis=0)
    turn = np.tile((np.arange(yaws) + 0.5) / yaws * QUARTER, len(spinning)) - np.repeat(angles, yaws)
    starts[:, yaw] += least_turn(turn)
    return starts

"""Other yaws and spins with which a cube may have met others, looked for over the whole plane of both.

How a cube lies when it is hit, and how fast it turns then, is told by that contact alone, if by anything: many pairs of
them explain it, on islands that no descent crosses between. At a later contact it lies as the spin since the first one
has turned it, so fast that a spread of spins over the prior misses most of these yaws: there, the yaw at the first
contact is kept, and the spin is changed by as little as turns the cube otherwise at the later one.
"""

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise

import numpy as np
import torch
from jaxtyping import Float

from vrdp_prob.inference.search.descent import Descent
from vrdp_prob.inference.search.events import first_contacts
from vrdp_prob.inference.search.hypothesis import (
    QUARTER,
    different,
    frames_before_contact,
    least_turn,
    owned,
    turn,
    yaw_places,
)
from vrdp_prob.inference.search.least_squares import Minimum
from vrdp_prob.inference.search.noise_fit import NOISE_FIELDS
from vrdp_prob.inference.search.plan import Optimiser
from vrdp_prob.inference.search.refinement import Refine, Refined, Searched, best_first
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.parameters import ANGULAR_DRAG
from vrdp_prob.models.simulator.events import CONTACTS

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
ODD = 1.0
"""Prior standard deviations from the middle at which a decay of spins is an odd one."""
QUARTERS = 3
"""Quarter turns over which yaws at a later contact are spread: with each the spin is another one."""
CLOSE = 0.15
"""Contacts (s) after another one that get no yaws of their own."""
MOST_LOOKS = 6
"""Looks for other yaws, at first contacts and at later ones by turns, until a fit leaves no more than noise..."""
ENOUGH = 1.0
"""...or two in a row bring less than so many nats."""


def with_other_yaws(
    likelihood: Likelihood,
    found: Sequence[Refined],
    refined: Refine,
    explained: Callable[[Refined], bool],
    *,
    optimiser: Optimiser,
) -> Searched:
    """Maxima with those of other yaws and spins of cubes, looked for at least once.

    Parameters
    ----------
    likelihood
        The density.
    found
        Its maxima, best first.
    refined
        How what may be near other maxima is refined.
    explained
        Whether a maximum is about as good as noise would make it.
    optimiser
        How worlds with other yaws are refined before that.
    """
    descent = Descent(likelihood, optimiser)
    searched, idle = Searched(best_first(found), 0), 0
    for look in range(MOST_LOOKS):
        before = searched.found[0]
        starts = (other_later_yaws if look % 2 else other_yaws)(descent, before.point)
        others = refined(likelihood, [one.point for one in starts], likelihood)
        searched = searched.beside(others, sum(one.evaluations for one in starts))
        best = searched.found[0]
        idle = 0 if best.log_density - before.log_density > ENOUGH else idle + 1
        if idle > 1 or explained(best):
            break
    return searched


def other_yaws(descent: Descent, point: Float[np.ndarray, "dimension"]) -> list[Minimum]:
    """What is near other maxima of the log posterior, in which a cube has met others with another yaw and spin.

    Parameters
    ----------
    descent
        Refines worlds of the density.
    point
        A maximum. Every cube that meets something there is turned by itself.
    """
    likelihood = descent.likelihood
    found: list[Minimum] = []
    for body, frame in _cubes_that_meet(likelihood, point):
        met = bodies_met(likelihood, point, body)
        for one in _with_usual_decay(likelihood, point):
            starts = turned_worlds(likelihood, one, body, frame, spins=SPINS, yaws=YAWS)
            found += _descended(descent, starts, met, frame)
    return found


def other_later_yaws(descent: Descent, point: Float[np.ndarray, "dimension"]) -> list[Minimum]:
    """The same where a cube has met something again with another yaw, which the spin since its first contact gave it.

    Parameters
    ----------
    descent, point
        See `other_yaws`.
    """
    likelihood = descent.likelihood
    tracks, places = likelihood.tracks, likelihood.coordinates.places
    found: list[Minimum] = []
    for body, _ in unseen_yaws(likelihood, point):
        if (spin := places.get(("spin", body))) is None:
            continue
        first, *later = _contact_times(likelihood, point, body)
        met = bodies_met(likelihood, point, body)
        for before, time in pairwise([first, *later]):
            if time - before < CLOSE:
                continue
            change = QUARTER * ((np.arange(QUARTERS * YAWS) + 0.5) / YAWS - QUARTERS / 2) / (time - first)
            starts = np.tile(point, (len(change), 1))
            starts[:, spin] += change
            starts[:, places["angle", body]] -= change * (first - float(tracks.first_seen[body]))
            frame = int(np.searchsorted(tracks.times, time))
            found += _descended(descent, starts, met, frame)
    return found


def _with_usual_decay(likelihood: Likelihood, point: Float[np.ndarray, "dimension"]) -> list[np.ndarray]:
    """A point, and where spins decay oddly in it the same with the usual decay: wrong yaws ask for odd ones."""
    coordinates = likelihood.coordinates
    place = coordinates.places.get((ANGULAR_DRAG.name, None))
    if place is None or abs(point[place] - coordinates.prior_mean[place]) < ODD * coordinates.prior_sd[place]:
        return [point]
    usual = point.copy()
    usual[place] = coordinates.prior_mean[place]
    return [point, usual]


def _descended(
    descent: Descent, starts: Float[np.ndarray, "start dimension"], bodies: frozenset[int], frame: int
) -> list[Minimum]:
    """The best of what becomes of starts in the coordinates of some bodies that meet around a frame."""
    likelihood = descent.likelihood
    local = owned(likelihood.coordinates, bodies) & ~likelihood.coordinates.mask(NOISE_FIELDS)
    until = min(frame + AFTER, len(likelihood.tracks.times))
    first = descent(starts, local, frame_count=until, iterations=FIRST_ITERATIONS)
    kept = different(likelihood, first, worse=HOPELESS, most=MOST_KEPT[0], frame_count=until)
    if not kept:
        return []
    then = descent(np.array([one.point for one in kept]), local, iterations=THEN_ITERATIONS)
    return different(likelihood, then, worse=NEARLY, most=MOST_KEPT[1])


def _contact_times(likelihood: Likelihood, point: Float[np.ndarray, "dimension"], body: int) -> list[float]:
    """Times (s) at which a body meets others or walls at a point."""
    with torch.no_grad():
        events = likelihood.rollout(torch.from_numpy(point[None])).events
    return sorted(events.time[np.isin(events.kind, CONTACTS) & events.concerns([body])].tolist())


def unseen_yaws(likelihood: Likelihood, point: Float[np.ndarray, "dimension"]) -> Iterator[tuple[int, int]]:
    """Cubes whose angles nobody measured and that have contacts at a point, and the frame before the first of each."""
    for body, frame in _cubes_that_meet(likelihood, point):
        if body not in likelihood.observations.angle_bodies:
            yield body, frame


def _cubes_that_meet(likelihood: Likelihood, point: Float[np.ndarray, "dimension"]) -> Iterator[tuple[int, int]]:
    """Cubes that have contacts at a point, which alone tell how they lie, and the frame before the first of each."""
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
    spin, and so has one whose angles were measured.
    """
    coordinates = likelihood.coordinates
    yaw, spin = coordinates.places["angle", body], coordinates.places.get(("spin", body))
    spin = None if body in likelihood.observations.angle_bodies else spin
    spinning = np.tile(point, (1 if spin is None else spins, 1))
    if spin is not None:
        spinning[:, spin] = coordinates.prior_mean[spin] + coordinates.prior_sd[spin] * np.linspace(
            -REACH, REACH, spins
        )
    with torch.no_grad():
        angles = likelihood.rollout(torch.from_numpy(spinning)).trajectory[:, frame, body, 2].numpy()
    starts = np.repeat(spinning, yaws, axis=0)
    change = np.tile((np.arange(yaws) + 0.5) / yaws * QUARTER, len(spinning)) - np.repeat(angles, yaws)
    turn(starts, likelihood, yaw, least_turn(change))
    return starts

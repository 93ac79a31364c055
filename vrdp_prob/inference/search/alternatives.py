"""Other explanations of contacts: other yaws of cubes that nobody measured, and hits in place of misses.

Where bodies have met and a few frames after it are known, the states of these bodies alone are drawn anew, every yaw
that only the contact can tell over a whole quarter turn. The best are refined in the coordinates of these bodies, then
the best and most different of those in all.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float

from vrdp_prob.inference.search.course_edges import best_beyond_edges, made_to_meet
from vrdp_prob.inference.search.descent import Descent
from vrdp_prob.inference.search.events import Pairs, courses_at
from vrdp_prob.inference.search.free_flight import Approach, SeenContact
from vrdp_prob.inference.search.hypothesis import (
    QUARTER,
    Hypothesis,
    different,
    least_turn,
    owned,
    turn,
    yaw_places,
    zero_place,
)
from vrdp_prob.inference.search.least_squares import Minimum, robust_cost
from vrdp_prob.inference.search.release_contact import strike_before
from vrdp_prob.models.likelihood import Likelihood

DRAWS = (96, 256)
"""Worlds drawn where at most one yaw is open, and where more are."""
FEW_DRAWS = 64
"""...and where nothing is puzzling."""
SPREADS = (0.1, 0.5, 1.0, 2.0, 4.0)
"""States are drawn from the Gaussian of the fit so far, wider by these factors."""
WIDEST = 2.0
"""...but no coordinate wanders further than so many prior standard deviations."""
FIRST_REFINED, FIRST_ITERATIONS = 10, 3
"""Draws that are refined in the coordinates of the bodies that meet, and in how many steps."""
OTHER_COURSES = 5
"""...of which so many are the best of other courses of events."""
THEN_REFINED, THEN_ITERATIONS = 4, 5
"""Results that are refined in all coordinates."""
HOPELESS = 40.0
"""A first result that is so much worse (nats) than the best one is not refined further."""
DIFFERENT = 0.12
"""Yaws (rad) further apart than this are different starts."""


@dataclass(frozen=True)
class Encounter:
    """Bodies that may have met around one time.

    Parameters
    ----------
    bodies
        The bodies.
    approaches
        When which of them came near each other.
    contacts
        What local fits say about contacts among them.
    first_contact
        Time (s) of the first contact that each body is known to have had, where it has met something before.
    puzzling
        Whether a yaw is open or what followed is not explained; where not, only other courses of events are tried.
    at_release
        Pairs that may have met before their motion was seen.
    """

    bodies: frozenset[int]
    approaches: tuple[Approach, ...]
    contacts: tuple[SeenContact, ...]
    first_contact: dict[int, float]
    puzzling: bool
    at_release: tuple[tuple[int, int], ...]

    @property
    def begin(self) -> float:
        """Time (s) of the first approach."""
        return min(one.time for one in self.approaches)


def alternatives(
    descent: Descent,
    hypothesis: Hypothesis,
    encounter: Encounter,
    frame_count: int,
    active: Bool[np.ndarray, "dimension"],
    *,
    threshold: float,
    generator: np.random.Generator,
) -> list[Minimum]:
    """Refined explanations of the first frames that differ in what happened in an encounter."""
    likelihood = descent.likelihood
    local = owned(likelihood.coordinates, encounter.bodies) & active
    yaws = [place for place in yaw_places(likelihood, encounter.bodies) if active[place]]
    places = np.flatnonzero(local)
    drawn = _drawn(likelihood, hypothesis, encounter, places, generator)
    may_be_graze = encounter.puzzling and hypothesis.explained_before(encounter.begin)
    if may_be_graze:
        bases = (hypothesis, hypothesis.before(encounter.begin))
        met = [made_to_meet(likelihood, base, encounter.approaches, places, frame_count) for base in bases]
        drawn = np.concatenate([drawn, *met])
    drawn = drawn[np.argsort(robust_cost(likelihood.residuals(drawn, frame_count), threshold))]
    found = courses_at(likelihood, torch.from_numpy(np.stack([hypothesis.point, *drawn])), frame_count)
    chosen = _spread(drawn, yaws, found[1:]) if encounter.puzzling else _other_courses(found)
    if not chosen:
        return []
    starts = drawn[chosen]
    if may_be_graze:
        others = drawn[[index for index in chosen if found[1 + index] != found[0]]]
        edges = best_beyond_edges(likelihood, hypothesis.point, others, frame_count, threshold=threshold)
        starts = np.concatenate([starts, edges])
    first = descent(starts, local, frame_count=frame_count, iterations=FIRST_ITERATIONS, threshold=threshold)
    hopeless = HOPELESS if encounter.puzzling else HOPELESS / 2
    hopeful = [one for one in first if one.cost < hypothesis.cost + hopeless]
    kept = different(likelihood, hopeful, worse=HOPELESS, most=THEN_REFINED, frame_count=frame_count)
    if not kept:
        return []
    return descent(
        np.array([one.point for one in kept]),
        active,
        frame_count=frame_count,
        iterations=THEN_ITERATIONS,
        tolerance=0.05,
        threshold=threshold,
    )


def _drawn(
    likelihood: Likelihood,
    hypothesis: Hypothesis,
    encounter: Encounter,
    places: np.ndarray,
    generator: np.random.Generator,
) -> Float[np.ndarray, "draw dimension"]:
    """Worlds in which the bodies of an encounter have other states, half of them from before the encounter."""
    coordinates = likelihood.coordinates
    yaws = [place for place in yaw_places(likelihood, encounter.bodies) if place in places]
    zeros = [zero for yaw in yaws if (zero := zero_place(likelihood, yaw)) is not None]
    count = DRAWS[len(yaws) > 1] if encounter.puzzling else FEW_DRAWS
    draws = np.tile(hypothesis.point, (count, 1))
    spreads = np.resize(np.repeat(SPREADS, 2), count)[:, None]
    widest = WIDEST * coordinates.prior_sd[places]
    for parity, base in enumerate((hypothesis, hypothesis.before(encounter.begin))):
        gaussian = base.around(places)
        chosen = spreads[parity::2]
        moves = chosen * (generator.standard_normal((len(chosen), len(places))) @ gaussian.root.T)
        moves[:, np.isin(places, [*yaws, *zeros])] = 0.0
        draws[parity::2, places] = base.point[places] + np.clip(moves, -widest, widest)
    for contact in encounter.contacts:
        suggest(draws[::3], contact, likelihood, 1 / np.diag(hypothesis.precision))
    _turn(draws, likelihood, encounter, yaws, generator)
    for pair in encounter.at_release:
        strike_before(draws[1::2], pair, likelihood, generator)
    return draws


def _turn(
    draws: Float[np.ndarray, "draw dimension"],
    likelihood: Likelihood,
    encounter: Encounter,
    yaws: Sequence[int],
    generator: np.random.Generator,
) -> None:
    """Draw yaws anew, in place; of a cube that has met something before, in half the draws, keep its yaw there.

    With that its spin changes, unless it was measured.
    """
    coordinates = likelihood.coordinates
    places = coordinates.places
    count = len(draws)
    for place in yaws:
        body = coordinates.entries[place].owner
        spin = places.get(("spin", body))
        even = QUARTER * (generator.permutation(count) + generator.random(count)) / count
        known = encounter.first_contact.get(-1 if body is None else body)
        if known is None or spin is None:
            turn(draws, likelihood, place, even)
            continue
        turn(draws[::2], likelihood, place, even[::2])
        if zero_place(likelihood, place) is None:
            since = known - float(likelihood.tracks.first_seen[body])
            change = (even[1::2] - QUARTER / 2) * 2 / max(encounter.begin - known, 0.2)
            draws[1::2, spin] += change
            draws[1::2, place] -= change * since


def suggest(
    draws: Float[np.ndarray, "draw dimension"],
    contact: SeenContact,
    likelihood: Likelihood,
    variance: Float[np.ndarray, "dimension"],
) -> None:
    """Move masses and restitutions towards what momentum balance says of a contact, in place."""
    for name, sign, target in (
        ("mass", -1.0, np.log(contact.mass_ratio)),
        ("restitution", 1.0, np.log(contact.restitution)),
    ):
        first, second = (likelihood.coordinates.places.get((name, body)) for body in (contact.first, contact.second))
        if first is None or second is None:
            continue
        missing = target - (draws[:, first] + sign * draws[:, second])
        share = variance[first] / (variance[first] + variance[second])
        draws[:, first] += share * missing
        draws[:, second] += sign * (1 - share) * missing


def _spread(
    ordered: Float[np.ndarray, "draw dimension"], yaws: Sequence[int], drawn_courses: Sequence[Pairs]
) -> list[int]:
    """Indices of draws to refine: the best whose yaws differ, the best of every other course of events, then the next.

    The draw that leaves all as it is bends to what it does not explain, and so is better than any draw in which what
    really happened does, before these are refined; what differs from it in its events must not compete with it.
    """
    by_yaw: list[int] = []
    for rank in range(len(ordered) if yaws else 1):
        if all(_apart(ordered[rank], ordered[other], yaws) for other in by_yaw):
            by_yaw.append(rank)
    by_course = [drawn_courses.index(course) for course in dict.fromkeys(drawn_courses)]
    rest = range(len(ordered))
    chosen = dict.fromkeys([*by_yaw[: FIRST_REFINED - OTHER_COURSES], *by_course[:OTHER_COURSES], *by_yaw, *rest])
    return list(chosen)[:FIRST_REFINED]


def _other_courses(found: Sequence[Pairs]) -> list[int]:
    """Indices of the best draws of courses of events other than the first one, which is that of the explanation."""
    own, drawn = found[0], found[1:]
    return [drawn.index(course) for course in dict.fromkeys(drawn) if course != own][:OTHER_COURSES]


def _apart(first: Float[np.ndarray, "dimension"], second: Float[np.ndarray, "dimension"], yaws: Sequence[int]) -> bool:
    turn = first[list(yaws)] - second[list(yaws)]
    return bool((np.abs(least_turn(turn)) > DIFFERENT).any())

"""What happens at contacts, one by one: how bodies rebound, rub and turn, what momentum they gain, and kicks."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np
from jaxtyping import Float

from vrdp_prob.discovery.checks.contacts import DURATION, MOMENTUM, REBOUND_AT_WALLS, RUBBING_OF, TURNING
from vrdp_prob.discovery.checks.kicks import KICK, KickScan
from vrdp_prob.discovery.checks.own_values import Rebounds
from vrdp_prob.discovery.page.scatter import Banded, Points, with_bands, with_bars
from vrdp_prob.discovery.page.seen import Figure, Seen, shortened
from vrdp_prob.discovery.residuals.contact_patterns import AT_CONTACTS, AT_WALLS, WHERE, ContactScore, unbalanced
from vrdp_prob.discovery.residuals.fitted_contacts import FittedContacts

NOTHING = Points(np.zeros(0), np.zeros(0), np.zeros(0))
PUSHED = ("along the tangent", "along the normal")
"""Directions in which momentum can be seen to be lost, the second one only where masses are known."""


def restitution_of_pairs(seen: Sequence[Seen]) -> str:
    """Fitted restitution of pairs of bodies against the speed at which they met."""

    def points(one: Seen) -> Points:
        rebounds = Rebounds.of(one.fit, one.contacts)
        factor = np.exp(rebounds.logarithm)
        return Points(rebounds.closing_speed, factor, factor * rebounds.sd)

    return with_bars(
        seen,
        {"": [points(one) for one in seen]},
        ("approach speed (m/s)", "restitution, r₁ r₂"),
        "Fitted restitution of pairs of bodies against the speed at which they met.",
        level=1.0,
    )


def tangential_impulses(seen: Sequence[Seen], where: str) -> str:
    """Tangential against normal impulse at each contact."""

    def points(contacts: ContactScore) -> Points:
        normal = _each(contacts, where, lambda one: one.events.impulse)
        score = contacts.tangential("rub", where)
        return Points(normal, normal * score.estimate, normal * score.sd)

    return with_bars(
        seen,
        {"": _at_contacts(seen, where, points)},
        ("normal impulse (kg m/s)", "tangential (kg m/s)"),
        f"Tangential impulse that the model misses {where}, to the left of the normal, against the normal one.",
    )


def _spins(seen: Sequence[Seen], where: str) -> str:
    """Tangential impulse as spins tell it, against the slip."""

    def points(contacts: ContactScore) -> Points:
        score = contacts.tangential("turn each", where)
        return Points(_each(contacts, where, lambda one: one.slip), score.estimate, score.sd)

    return with_bars(
        seen,
        {"": _at_contacts(seen, where, points)},
        ("slip before the contact (m/s)", "tangential / normal impulse"),
        f"Spin that bodies gain {where} and the model misses, as the tangential impulse (over the normal one) that "
        "makes it, against the slip. Rubbing acts against the slip.",
    )


def _rebounds_from_walls(seen: Sequence[Seen]) -> str:
    """Restitution at walls in units of the model's, contact by contact."""

    def points(contacts: ContactScore) -> Points:
        speed = _each(contacts, AT_WALLS, lambda one: np.exp(one.log_speed))
        return Points(speed, 1 + contacts.rebounds.estimate, contacts.rebounds.sd)

    return with_bars(
        seen,
        {"": _at_contacts(seen, AT_WALLS, points)},
        ("approach speed (m/s)", "restitution / the model's"),
        "Restitution at contacts with walls over that of the model, about 1 on average, against the approach speed.",
        level=1.0,
    )


def _durations(seen: Sequence[Seen], where: str) -> str:
    """How long bodies touch, contact by contact."""

    def points(contacts: ContactScore) -> Points:
        speed = _each(contacts, where, lambda one: np.exp(one.log_speed))
        score = contacts.durations("last each", where)
        return Points(speed, score.estimate, score.sd)

    return with_bars(
        seen,
        {"": _at_contacts(seen, where, points)},
        ("approach speed (m/s)", "duration (s)"),
        f"How long bodies would have to touch {where} to part as late as they do, against the approach speed. What is "
        "soft touches as long at all speeds; where radii are wrong the duration falls as one over the speed.",
        level=0.0,
    )


def _momentum(seen: Sequence[Seen]) -> str:
    """Velocity that both bodies gain at each contact."""
    found = zip(*(_gained(one.at_contacts) for one in seen), strict=True)
    return with_bars(
        seen,
        {title: points for title, points in zip(PUSHED, found, strict=True) if any(map(len, points))},
        ("approach speed (m/s)", "common velocity gained (m/s)"),
        "Velocity that both bodies of a contact gain together, which keeps no momentum, against the approach speed.",
    )


def _gained(contacts: ContactScore | None) -> tuple[Points, Points]:
    """What is gained along the tangent, and along the normal where that can be seen."""
    if contacts is None or AT_CONTACTS not in contacts.clear:
        return NOTHING, NOTHING
    score, first = contacts.normal("together"), 0
    found: tuple[list[Points], list[Points]] = [], []
    for one in contacts.clear[AT_CONTACTS]:
        for side in found[: len(unbalanced(one))]:
            mine = slice(first, first + len(one))
            side.append(Points(np.exp(one.log_speed), score.estimate[mine], score.sd[mine]))
            first += len(one)
    tangent, normal = (_together(side) for side in found)
    return tangent, normal


def _kick(seen: Sequence[Seen]) -> str:
    """How the velocity of the body that a kick explains best would have to change at each frame."""

    def changes(one: Seen) -> Banded | None:
        scan = KickScan.of(one.flight.beside)
        if scan is None:
            return None
        video = one.model.videos[scan.video]
        against = f"time (s), object {video.motion.tracks.bodies[scan.body].id} of {shortened(video.linear.name)}"
        return Banded.about_nothing(scan.times, scan.change, scan.sd, against)

    return with_bands(
        seen,
        [changes(one) for one in seen],
        ("", "change of velocity (m/s)"),
        "Sudden change of velocity that would explain best what the model misses, if it happened at each single frame.",
    )


def _at_contacts(seen: Sequence[Seen], where: str, points: Callable[[ContactScore], Points]) -> list[Points]:
    """Points of each fit; none where it has no such contacts."""
    known = (one.at_contacts for one in seen)
    return [NOTHING if one is None or where not in one.clear else points(one) for one in known]


def _each(
    contacts: ContactScore, where: str, value: Callable[[FittedContacts], Float[np.ndarray, "_"]]
) -> Float[np.ndarray, "contact"]:
    """Something of all contacts of which the normal is known, video by video."""
    return np.concatenate([value(one) for one in contacts.clear[where]])


def _together(points: Sequence[Points]) -> Points:
    if not points:
        return NOTHING
    return Points(*(np.concatenate(parts) for parts in zip(*((p.at, p.value, p.sd) for p in points), strict=True)))


CONTACT_FIGURES: Mapping[str, Figure] = {
    RUBBING_OF[AT_WALLS]: partial(tangential_impulses, where=AT_WALLS),
    REBOUND_AT_WALLS: _rebounds_from_walls,
    **{TURNING[where]: partial(_spins, where=where) for where in WHERE},
    **{DURATION[where]: partial(_durations, where=where) for where in WHERE},
    MOMENTUM: _momentum,
    KICK: _kick,
}
"""How what a check of contacts is about is shown, by its name."""

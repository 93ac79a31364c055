"""Whether contacts follow the model: how they rub and turn, at which distance, and kicks without a partner.

How bodies rebound from each other shows in their fitted restitutions (see `body_checks`); how they rebound from walls
is asked here, since one body meets walls at many speeds.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy.special import expit
from scipy.stats import norm

from vrdp_prob.discovery.checks.bodies import REBOUND
from vrdp_prob.discovery.checks.false_discovery import SEEN
from vrdp_prob.discovery.checks.kicks import kick_check
from vrdp_prob.discovery.finding import Check
from vrdp_prob.discovery.normal import BELOW_95, WITHIN_95
from vrdp_prob.discovery.residuals.contact_patterns import AT_CONTACTS, AT_WALLS, GROW, WHERE, ContactScore
from vrdp_prob.discovery.residuals.free_flight import FreeFlight
from vrdp_prob.discovery.residuals.linear import Score
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.discovery.words import number, opposite
from vrdp_prob.plain_words import several

RUBBING = "tangential against normal impulse"
DISTANCE = "centre distance at contact"
MOMENTUM = "momentum at contacts"
RUBBING_AT_WALLS = f"{RUBBING} {AT_WALLS}"
REBOUND_AT_WALLS = f"{REBOUND} {AT_WALLS}"
RUBBING_OF = {AT_CONTACTS: RUBBING, AT_WALLS: RUBBING_AT_WALLS}
TURNING = {where: f"spin change {where}" for where in WHERE}
DURATION = {where: f"duration of touch {where}" for where in WHERE}
"""Names of the checks of tangential impulses, of spins and of how long bodies touch, by where they do."""
APART = 0.01
"""Probability below which of two explanations one is told from the other."""


def contact_checks(
    model: ResidualModel, flight: FreeFlight, replicas: Sequence[Float[np.ndarray, "_ replica"]]
) -> Iterator[Check]:
    """All checks of contacts that these videos allow.

    Parameters
    ----------
    model
        The residuals.
    flight
        The patterns of free flight, which may show beside those of contacts.
    replicas
        What noise leaves of each video beside them, for the kick that is looked for everywhere.
    """
    contacts = ContactScore.of(model, flight)
    if contacts is not None:
        yield from _patterns(contacts)
    yield from kick_check(flight.beside, replicas)


def _patterns(contacts: ContactScore) -> Iterator[Check]:
    """What acts at contacts, by where they are; what may act elsewhere is beside it."""
    for where in contacts.clear:
        if contacts.turning:
            yield from _slip_check(contacts.tangential("slip", where), where)
            yield from _turn_check(contacts.tangential("turn", where), where)
        else:
            yield from _rub_check(contacts.tangential("rub", where), where)
        yield from _duration_check(contacts.durations("last", where, GROW), where)
    if AT_CONTACTS in contacts.clear:
        yield from _distance_check(contacts.part(GROW, *contacts.rubbing), contacts)
        yield from _momentum_check(contacts.normal("together"), sum(map(len, contacts.clear[AT_CONTACTS])))
    if AT_WALLS in contacts.clear:
        yield from _bounce_check(contacts.normal("bounce"))


def _slip_check(score: Score, where: str) -> Iterator[Check]:
    """Rubbing where the spins, and so the directions in which bodies slip, are measured."""
    if not score.degrees:
        return
    alone = score.of([0])
    size, sd = float(alone.estimate[0]), float(alone.sd[0])
    word = opposite(size, "along", "against")
    found = f"{where.capitalize()} a tangential impulse acts {word} the slip, {number(abs(size))} of the normal one."
    yield _check(RUBBING_OF[where], size, score.log_p_value, found, f"{number(WITHIN_95 * sd)} of the normal one")


def _rub_check(score: Score, where: str) -> Iterator[Check]:
    """Rubbing where nobody knows in which direction bodies slip, because nobody saw them turn."""
    if not score.degrees:
        return
    known = score.sd > 0
    variance = score.sd[known] ** 2
    visible = WITHIN_95 * float((1 / variance).sum() ** -0.5)
    excess = float((score.estimate[known] ** 2 / variance - 1).sum() / (1 / variance).sum())
    size = float(np.sqrt(max(excess, 0.0)))
    found = f"{where.capitalize()} tangential impulses act, {number(size)} of the normal ones (root mean square)."
    yield _check(RUBBING_OF[where], size, score.log_p_value, found, f"{number(visible)} of the normal ones")


def _turn_check(score: Score, where: str) -> Iterator[Check]:
    if not score.degrees:
        return
    size = float(score.estimate[0])
    found = (
        f"{where.capitalize()} the spin of bodies changes as if the tangential impulse were {number(abs(size))} of the "
        f"normal one, {opposite(size, 'along', 'against')} the slip."
    )
    visible = f"{number(WITHIN_95 * float(score.sd[0]))} of the normal impulse"
    yield _check(TURNING[where], size, score.log_p_value, found, visible)


def _bounce_check(score: Score) -> Iterator[Check]:
    """Restitution at walls against the approach speed, whatever it is on average."""
    power = score.of([0], [1])
    if not power.degrees:
        return
    size, sd = float(power.estimate[0]), float(power.sd[0])
    found = (
        f"{AT_WALLS.capitalize()} restitution {opposite(size, 'falls', 'grows')} with the approach speed, to the power "
        f"{number(size)}."
    )
    visible = f"a power of {number(WITHIN_95 * sd)} of the approach speed"
    yield _check(REBOUND_AT_WALLS, size, power.log_p_value, found, visible)


def _distance_check(score: Score, contacts: ContactScore) -> Iterator[Check]:
    if not score.degrees:
        return
    share = float(score.estimate[0])
    sums = [
        sum(one.motion.tracks.bodies[k].radius or 0.0 for k in pair)
        for some in (contacts.clear, contacts.vague)
        for one in some[AT_CONTACTS]
        for pair in one.bodies
    ]
    size, sd = (float(np.mean(sums)) * one for one in (share, float(score.sd[0])))
    found = (
        f"Bodies touch {number(abs(size))} m {opposite(size, 'nearer', 'farther apart')} than the sum of their radii, "
        f"{number(100 * abs(share))} % of it."
    )
    check = _check(DISTANCE, size, score.log_p_value, found, f"{number(WITHIN_95 * sd)} m")
    yield replace(check, rival=_lasting_instead(score, contacts.durations("last", AT_CONTACTS)))


def _duration_check(score: Score, where: str) -> Iterator[Check]:
    """How long bodies touch, whatever their size; no contact lasts less than no time, so it is asked to one side."""
    if not score.degrees:
        return
    size, sd = float(score.estimate[0]), float(score.sd[0])
    found = f"{where.capitalize()} bodies touch for {number(size)} s, and give way meanwhile."
    yield _check(DURATION[where], size, float(norm.logsf(size / sd)), found, f"{number(BELOW_95 * sd)} s")


def _lasting_instead(distance: Score, duration: Score) -> str:
    """What contacts that last explain of a wrong distance at which bodies touch, where that may be as well."""
    if not duration.degrees or duration.estimate[0] <= 0 or distance.p_value > SEEN:
        return ""
    share = float(expit((duration.chi_square - distance.chi_square) / 2))
    lasting = f"Contacts that last {number(float(duration.estimate[0]))} s"
    if share <= APART:
        return ""
    if share >= 1 - APART:
        return f"{lasting} explain it better."
    return (
        f"{lasting} would look like that, with a probability of {100 * share:.0f} % by these videos: faster and slower "
        "contacts would tell."
    )


def _momentum_check(score: Score, contacts: int) -> Iterator[Check]:
    if not score.degrees:
        return
    excess = score.chi_square / score.degrees
    found = (
        f"Momentum is not kept at contacts: velocities that bodies have in common change {excess**0.5:.1f} times as "
        "much as noise lets them."
    )
    sentence = found if score.p_value < SEEN else f"Nothing seen at {several(contacts, 'contact')}."
    yield Check(MOMENTUM, excess, score.p_value, False, sentence)


def _check(name: str, size: float, log_p_value: float, found: str, visible: str) -> Check:
    p_value = math.exp(log_p_value)
    sentence = found if p_value < SEEN else f"Nothing seen; {visible} would have shown."
    return Check(name, size, p_value, False, sentence, log_p_value=log_p_value)

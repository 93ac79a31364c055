"""Whether contacts follow the model: how they rub and turn, at which distance, and kicks without a partner.

Contacts of bodies with each other and with stated walls are asked alike, each kind beside the other. How bodies rebound
from each other shows in their fitted restitutions (see `body_checks`); how they rebound from walls is asked here, since
one body meets walls at many speeds.

What could act at contacts is carried through the rest of the motion like any other small change, beside all patterns
of free flight and all that the fit can absorb. Where a cube's yaw is not measured its contacts may do anything: the
direction of their impulse is known from the motion after them alone.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.stats import chi2

from vrdp_prob.discovery.checks.bodies import REBOUND
from vrdp_prob.discovery.checks.flight import SEEN
from vrdp_prob.discovery.checks.replications import anywhere, independent_places
from vrdp_prob.discovery.finding import Check
from vrdp_prob.discovery.residuals.fitted_contacts import FittedContacts
from vrdp_prob.discovery.residuals.fitted_motion import REACH, FittedMotion, Kicks
from vrdp_prob.discovery.residuals.free_flight import NORMAL_95, FreeFlight
from vrdp_prob.discovery.residuals.linear import Score
from vrdp_prob.discovery.residuals.residual_model import ResidualModel, joined
from vrdp_prob.discovery.words import number, opposite
from vrdp_prob.models.simulator.events import RolloutEventKind

RUBBING = "tangential against normal impulse"
DISTANCE = "centre distance at contact"
KICK = "sudden change of velocity without a partner"
AT_CONTACTS, AT_WALLS = "at contacts", "at walls"
RUBBING_AT_WALLS = f"{RUBBING} {AT_WALLS}"
REBOUND_AT_WALLS = f"{REBOUND} {AT_WALLS}"
WHERE = {AT_CONTACTS: RolloutEventKind.COLLISION, AT_WALLS: RolloutEventKind.WALL}
"""Where bodies touch each other, and stated walls."""
FEWEST_FRAMES = 4
"""Frames of a body before and after a kick without which it does not show."""
PLACES_AT_ONCE = 256
"""Frames of bodies at which kicks are looked for in one go: each needs room for all residuals of its video."""


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
    contacts = {
        where: found
        for where, kind in WHERE.items()
        if any(map(len, found := [FittedContacts.of(video.motion, kind) for video in model.videos]))
    }
    if contacts:
        yield from _patterns(model, flight, contacts)
    yield from _kick_without_partner(flight.beside, replicas)


def _patterns(
    model: ResidualModel, flight: FreeFlight, contacts: Mapping[str, Sequence[FittedContacts]]
) -> Iterator[Check]:
    """What acts at contacts, by where they are; what may act elsewhere is beside it."""
    motions = [video.motion for video in model.videos]
    changes = {"grow": [motion.growth[..., None] for motion in motions]}
    for where, some in contacts.items():
        clear = [one.where(one.known_normal) for one in some]
        changes |= {
            f"anything {where}": _anything_where_vague(some),
            f"rub {where}": _one_after_another([_rubbing_each(one) for one in clear]),
            f"slip {where}": [_slipping(one) for one in clear],
            f"turn {where}": [_slipping(one, moving=False) for one in clear],
        }
        if where == AT_CONTACTS:
            changes["together"] = _one_after_another([one.pushed_together(_unbalanced(one)) for one in clear])
        else:
            changes["bounce"] = [_bouncing(one) for one in clear]
    score, places = joined(model.sharing(flight.rows), _rows(model, changes))

    def columns(*names: str) -> list[int]:
        return [k for name in names for k in places[name]]

    def part(name: str, *given: str) -> Score:
        return score.of(places[name], columns(*(f"anything {where}" for where in contacts), *given))

    turning = all(motion.tracks.turning_told for motion in motions)
    rub = [f"rub {where}" for where in contacts]
    for where in contacts:
        beside = ("grow", *(f"{'slip' if turning else 'rub'} {other}" for other in contacts if other != where))
        if turning:
            yield from _slip_check(part(f"slip {where}", *beside), where)
            yield from _turn_check(part(f"turn {where}", *beside), where)
        else:
            yield from _rub_check(part(f"rub {where}", *beside), where)
    if AT_CONTACTS in contacts:
        yield from _distance_check(part("grow", *rub), contacts[AT_CONTACTS])
        clear = [one.where(one.known_normal) for one in contacts[AT_CONTACTS]]
        yield from _momentum_check(part("together", *rub, "grow"), sum(map(len, clear)))
    if AT_WALLS in contacts:
        yield from _bounce_check(part("bounce", *rub, "grow"))


def _anything_where_vague(contacts: Sequence[FittedContacts]) -> list[Float[np.ndarray, "_ _ 3 column"]]:
    """Kicks of all bodies at contacts of which nobody knows the direction."""
    return _one_after_another([one.where(~one.known_normal).pushed_anyhow() for one in contacts])


def _rows(
    model: ResidualModel, changes: Mapping[str, Sequence[Float[np.ndarray, "_ _ 3 _"]]]
) -> dict[str, list[Float[np.ndarray, "_ _"]]]:
    """What patterns do to the residuals of each video."""
    return {
        name: [video.rows(one) for video, one in zip(model.videos, parts, strict=True)]
        for name, parts in changes.items()
    }


@dataclass(frozen=True)
class Rubbing:
    """Tangential impulses that a model misses.

    Parameters
    ----------
    normal
        Normal impulse in kg m/s of each contact of which the direction is known.
    ratio, sd
        Missing tangential impulse (to the left of the normal) over the normal one, and its standard deviation.
    """

    normal: Float[np.ndarray, "contact"]
    ratio: Float[np.ndarray, "contact"]
    sd: Float[np.ndarray, "contact"]


def rubbing(model: ResidualModel, flight: FreeFlight, contacts: Sequence[FittedContacts]) -> Rubbing:
    """Tangential impulses, each by itself, beside all patterns of free flight."""
    clear = [one.where(one.known_normal) for one in contacts]
    changes = {
        "rub": _one_after_another([_rubbing_each(one) for one in clear]),
        "anything": _anything_where_vague(contacts),
    }
    score, places = joined(model.sharing(flight.rows), _rows(model, changes))
    part = score.of(places["rub"], places["anything"])
    return Rubbing(np.concatenate([one.events.impulse for one in clear]), part.estimate, part.sd)


def _slipping(contacts: FittedContacts, *, moving: bool = True) -> Float[np.ndarray, "time body 3 column"]:
    """Impulses against the slip, as large as the normal ones, and such as stop the slip of what does not turn."""
    sizes = np.stack([contacts.rubbing * contacts.events.impulse, -contacts.slip * contacts.common_mass], axis=1)
    chosen = sizes if moving else sizes[:, :1]
    return contacts.pushed_apart(contacts.tangent[:, :, None] * chosen[:, None], moving=moving)


def _bouncing(contacts: FittedContacts) -> Float[np.ndarray, "time body 3 column"]:
    """Impulses along the normal of a restitution that goes with a power of the approach speed, and of a larger one."""
    sizes = contacts.bounce[:, None] * np.stack([contacts.log_speed, np.ones(len(contacts))], axis=1)
    return contacts.pushed_apart(contacts.events.normal[:, :, None] * sizes[:, None])


def _rubbing_each(contacts: FittedContacts) -> Float[np.ndarray, "time body 3 column"]:
    """Impulses to the left of the normal, as large as the normal one, at each contact by itself."""
    return contacts.pushed_apart(
        contacts.tangent[:, :, None] * (np.eye(len(contacts)) * contacts.events.impulse)[:, None]
    )


def _unbalanced(contacts: FittedContacts) -> list[Float[np.ndarray, "contact 2"]]:
    """Directions in which momentum can be seen to be lost: along the normal only where the masses are known."""
    weighed = all(body.mass is not None for body in contacts.motion.tracks.bodies)
    return [contacts.tangent, contacts.events.normal] if weighed else [contacts.tangent]


def _one_after_another(
    changes: Sequence[Float[np.ndarray, "_ _ 3 _"]],
) -> list[Float[np.ndarray, "_ _ 3 column"]]:
    """Patterns of single videos side by side, so that each has an amplitude of its own."""
    widths = [one.shape[-1] for one in changes]
    total, result, first = sum(widths), [], 0
    for one, width in zip(changes, widths, strict=True):
        wide = np.zeros((*one.shape[:-1], total))
        wide[..., first : first + width] = one
        result.append(wide)
        first += width
    return result


def _slip_check(score: Score, where: str) -> Iterator[Check]:
    """Rubbing where the spins, and so the directions in which bodies slip, are measured."""
    if not score.degrees:
        return
    alone = score.of([0])
    size, sd = float(alone.estimate[0]), float(alone.sd[0])
    word = opposite(size, "along", "against")
    found = f"{where.capitalize()} a tangential impulse acts {word} the slip, {number(abs(size))} of the normal one."
    yield _check(_rubbing_name(where), size, score.p_value, found, f"{number(NORMAL_95 * sd)} of the normal one")


def _rub_check(score: Score, where: str) -> Iterator[Check]:
    """Rubbing where nobody knows in which direction bodies slip, because nobody saw them turn."""
    if not score.degrees:
        return
    known = score.sd > 0
    variance = score.sd[known] ** 2
    visible = NORMAL_95 * float((1 / variance).sum() ** -0.5)
    excess = float((score.estimate[known] ** 2 / variance - 1).sum() / (1 / variance).sum())
    size = float(np.sqrt(max(excess, 0.0)))
    found = f"{where.capitalize()} tangential impulses act, {number(size)} of the normal ones (root mean square)."
    yield _check(_rubbing_name(where), size, score.p_value, found, f"{number(visible)} of the normal ones")


def _rubbing_name(where: str) -> str:
    return RUBBING_AT_WALLS if where == AT_WALLS else RUBBING


def _turn_check(score: Score, where: str) -> Iterator[Check]:
    if not score.degrees:
        return
    size = float(score.estimate[0])
    found = (
        f"{where.capitalize()} the spin of bodies changes as if the tangential impulse were {number(abs(size))} of the "
        f"normal one, {opposite(size, 'along', 'against')} the slip."
    )
    visible = f"{number(NORMAL_95 * float(score.sd[0]))} of the normal impulse"
    yield _check(f"spin change {where}", size, score.p_value, found, visible)


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
    visible = f"a power of {number(NORMAL_95 * sd)} of the approach speed"
    yield _check(REBOUND_AT_WALLS, size, power.p_value, found, visible)


def _distance_check(score: Score, contacts: Sequence[FittedContacts]) -> Iterator[Check]:
    if not score.degrees:
        return
    share = float(score.estimate[0])
    sums = np.concatenate(
        [[sum(one.motion.tracks.bodies[k].radius or 0.0 for k in pair) for pair in one.bodies] for one in contacts]
    )
    size, sd = (float(np.mean(sums)) * one for one in (share, float(score.sd[0])))
    found = (
        f"Bodies touch {number(abs(size))} m {opposite(size, 'nearer', 'farther apart')} than the sum of their radii, "
        f"{number(100 * abs(share))} % of it."
    )
    yield _check(DISTANCE, size, score.p_value, found, f"{number(NORMAL_95 * sd)} m")


def _momentum_check(score: Score, contacts: int) -> Iterator[Check]:
    if not score.degrees:
        return
    excess = score.chi_square / score.degrees
    found = (
        f"Momentum is not kept at contacts: velocities that bodies have in common change {excess**0.5:.1f} times as "
        "much as noise lets them."
    )
    sentence = found if score.p_value < SEEN else f"Nothing seen at {contacts} contacts."
    yield Check("momentum at contacts", excess, score.p_value, False, sentence)


def _kick_without_partner(model: ResidualModel, replicas: Sequence[Float[np.ndarray, "_ replica"]]) -> Iterator[Check]:
    """The strongest sudden change of a velocity away from contacts."""
    best: tuple[float, int, int, int, Score] | None = None
    largest = np.zeros(replicas[0].shape[1])
    places = 0
    for index, (video, noise) in enumerate(zip(model.videos, replicas, strict=True)):
        frames, bodies = _kick_places(video.motion)
        if not len(frames):
            continue
        for some in np.array_split(np.arange(len(frames)), math.ceil(len(frames) / PLACES_AT_ONCE)):
            kicks = Kicks.single(video.motion.times[frames[some]], bodies[some])
            rows = video.rows(video.motion.kicked(kicks)).reshape(video.linear.data, -1, 2)
            scores, blocks = model.linear.scores_in(index, rows)
            shown = [k for k, score in enumerate(scores) if score.degrees == 2 and _shows(score, rows[:, k])]
            if not shown:
                continue
            places += len(shown)
            for k in shown:
                statistic = scores[k].chi_square / model.dispersion
                if best is None or statistic > best[0]:
                    best = (statistic, index, int(frames[some[k]]), int(bodies[some[k]]), scores[k])
            pulls = (blocks[:, shown].reshape(len(noise), -1).T @ noise).reshape(len(shown), 2, -1)
            inverse = np.array([np.linalg.inv(scores[k].information) for k in shown])
            found = (pulls * (inverse @ pulls)).sum(axis=1)
            largest = np.maximum(largest, found.max(axis=0))
    if best is None:
        return
    statistic, index, frame, body, score = best
    p_value = anywhere(float(chi2.sf(statistic, 2)), independent_places(largest, 2, places))
    video = model.videos[index]
    size = float(np.linalg.norm(score.estimate))
    name = video.motion.tracks.bodies[body].id
    where = f"at {video.motion.times[frame]:.2f} s object {name} of video {video.linear.name}"
    sentence = (
        f"Without a partner in reach, {where} changes its velocity by {number(size)} m/s."
        if p_value < SEEN
        else f"Nothing seen; the strongest was {number(size)} m/s {where}."
    )
    yield Check(KICK, size, p_value, False, sentence)


def _kick_places(motion: FittedMotion) -> tuple[np.ndarray, np.ndarray]:
    """Frames and bodies at which a kick would show apart from contacts."""
    allowed = motion.moving & motion.tracks.seen & motion.restart[:, None]
    for body in range(allowed.shape[1]):
        seen = np.cumsum(motion.tracks.seen[:, body])
        allowed[:, body] &= (seen > FEWEST_FRAMES) & (seen <= seen[-1] - FEWEST_FRAMES)
        for time in motion.contact_times(body):
            allowed[np.abs(motion.times - time) < REACH * motion.frame_time, body] = False
    frames, bodies = np.nonzero(allowed)
    return frames, bodies


def _shows(score: Score, rows: Float[np.ndarray, "data 2"]) -> bool:
    """Whether a kick is not all but the same as something that the fit absorbs."""
    return bool(np.trace(score.information) > 1e-3 * float((rows**2).sum()))


def _check(name: str, size: float, p_value: float, found: str, visible: str) -> Check:
    sentence = found if p_value < SEEN else f"Nothing seen; {visible} would have shown."
    return Check(name, size, p_value, False, sentence)

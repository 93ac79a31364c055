"""Motion that deviates from the law of the model as the motion that was seen does.

A contact that is simulated takes the deviation that was seen, as far as the same pair meets in the same way; what is
left is drawn anew with the scale of this table:

    deviation = rho (seen deviation) + sqrt(1 - rho^2) s z,

rho = exp(-d^2 / 2), where d is the distance of the two contacts: their normals and directions of approach in units of
`SAME_ANGLE`, the logarithms of their speeds in units of `SAME_SPEED`. A pair that was not seen to meet has rho = 0. Of
an unbroken series of contacts of one pair only the first deviates.

Between contacts a white acceleration acts (see `wander`), in kicks every `LONGEST_PIECE`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.reasoning.deviations import Deviation, turned
from vrdp_prob.reasoning.stretch import Meeting, Moments, State, Stretch, advance, around

SAME_ANGLE, SAME_SPEED = 0.35, 0.7
"""Angle (rad) and logarithm of a speed ratio over which a deviation changes."""
LONGEST_PIECE = 0.4
"""Time in s between two kicks of the white acceleration, at most."""
INSTANT, INSTANTS = 0.05, 256
"""Time in s for which a kick has random numbers of its own, and number of such times after which they come again."""
SLOWEST = 0.02
"""Speed in m/s below which a body is held by friction and not kicked."""
MOST_CONTACTS = 12
"""Contacts of one draw in one stretch that deviate, at most."""


@dataclass(frozen=True)
class Scattering:
    """Deviations of the contacts to come, in some draws.

    Parameters
    ----------
    seen
        Deviations of contacts that were seen; of those of a pair the one counts that is most like the contact to come.
    scale
        Scale s of deviations in each draw.
    shrunk
        The seen deviations as they are after the noise of the tracks is allowed for, for each of `seen`.
    fresh
        Standard normal numbers of each pair of bodies: log size and turn.
    wander
        Strength of the white acceleration in m/s^1.5 in each draw.
    shaking
        Standard normal numbers of the kicks that it gives.
    """

    seen: tuple[Deviation, ...]
    scale: Float[np.ndarray, "draw"]
    shrunk: Float[np.ndarray, "seen draw 2"]
    fresh: Float[np.ndarray, "draw body body 2"]
    wander: Float[np.ndarray, "draw"]
    shaking: Float[np.ndarray, "draw body instant 2"]

    @classmethod
    def of(
        cls,
        seen: Sequence[Deviation],
        scale: Float[np.ndarray, "draw"],
        wander: Float[np.ndarray, "draw"],
        *,
        fresh: Float[np.ndarray, "draw body body 2"],
        shaking: Float[np.ndarray, "draw body instant 2"],
        noise: Float[np.ndarray, "seen draw 2"],
    ) -> "Scattering":
        """With what is known of the seen deviations in each draw.

        Of a deviation with the prior variance s^2 that was measured with the variance v, the share s^2 / (s^2 + v)
        remains, and an uncertainty; that part of it which the draws do not hold already is drawn by `noise`.
        """
        shrunk = np.zeros((len(seen), len(scale), 2))
        for number, one in enumerate(seen):
            share = scale[:, None] ** 2 / (scale[:, None] ** 2 + one.variance)
            rest = (1 - share) * scale[:, None]
            shrunk[number] = np.where(one.touches[:, None], share * one.log_ratio, 0.0) + rest * noise[number]
        return cls(tuple(seen), scale, shrunk, fresh, wander, shaking)

    def select(self, draws: np.ndarray) -> "Scattering":
        """The deviations in some of the draws."""
        seen = tuple(one.select(draws) for one in self.seen)
        return Scattering(
            seen, self.scale[draws], self.shrunk[:, draws], self.fresh[draws], self.wander[draws], self.shaking[draws]
        )

    def kicked(self, state: State, time: float, duration: float) -> State:
        """The state after a kick at a time (s) that stands for the acceleration of some duration (s)."""
        numbers = self.shaking[:, :, int(time / INSTANT) % INSTANTS]
        moves = (state.release <= time) & (np.linalg.norm(state.velocity, axis=-1) > SLOWEST)
        kicked = state.copy()
        kick = np.where(moves[..., None], self.wander[:, None, None] * np.sqrt(duration) * numbers, 0.0)
        kicked.velocity += kick
        kicked.rolling += kick
        return kicked

    def log_ratio(self, meeting: Meeting, approach: Float[np.ndarray, "contact 2"]) -> Float[np.ndarray, "contact 2"]:
        """Log size and turn of the impulses of some contacts.

        Parameters
        ----------
        meeting
            The contacts.
        approach
            Velocity in m/s of the second body relative to the first before each.
        """
        draws = meeting.draws
        alike = np.zeros(len(draws))
        carried = np.zeros((len(draws), 2))
        for one, values in zip(self.seen, self.shrunk, strict=True):
            same = (meeting.first == one.first) & (meeting.second == one.second) & one.touches[draws]
            near = np.where(same, _alike(one, meeting.normal, draws, approach), 0.0)
            better = near > alike
            alike, carried = np.where(better, near, alike), np.where(better[:, None], values[draws], carried)
        fresh = self.scale[draws, None] * self.fresh[draws, meeting.first, meeting.second]
        return alike[:, None] * carried + np.sqrt(1 - alike[:, None] ** 2) * fresh


def advance_scattered(
    worlds: Worlds,
    state: State,
    times: Float[np.ndarray, "begin_and_time"],
    model: PhysicsModel,
    scattering: Scattering | None,
) -> Stretch:
    """As `advance`, with motion that deviates from the model.

    Parameters
    ----------
    worlds, state, model
        See `advance`.
    times
        Time in s at which the simulation sets out, and those at which the result is wanted.
    scattering
        The deviations, of the same draws; None where all follows the model.
    """
    begin, times = float(times[0]), times[1:]
    if scattering is None:
        return advance(worlds, state, times, model)
    span = float(times[-1]) - begin
    number = max(int(np.ceil(span / LONGEST_PIECE)), 1)
    duration = span / number
    kicks = begin + (np.arange(number) + 0.5) * duration
    pieces = []
    for start, stop in pairwise([begin, *kicks.tolist(), float(times[-1])]):
        own = times[(times > start) & (times < stop)]
        piece = _with_contacts(worlds, state, np.append(own, stop), model, scattering)
        state = scattering.kicked(piece.end(state), stop, duration)
        pieces.append(piece)
    return _one_after_the_other(pieces, times)


def _with_contacts(
    worlds: Worlds, state: State, times: Float[np.ndarray, "time"], model: PhysicsModel, scattering: Scattering
) -> Stretch:
    """As `advance`, with contacts that deviate."""
    stretch = advance(worlds, state, times, model)
    state = state.copy()
    last: Float[np.ndarray, "world"] = np.full(len(worlds), -np.inf)
    for _ in range(MOST_CONTACTS):
        meeting = stretch.next_meeting(last)
        if not len(meeting.draws):
            break
        own = worlds.select(meeting.draws.tolist())
        moments = around(own, state.select(meeting.draws), meeting.time, model)
        after = _deviated(moments, meeting, scattering)
        stretch = _joined(stretch, advance(own, after, times, model), meeting)
        state.put(meeting.draws, after)
        last[meeting.draws] = meeting.time
    return stretch


def _one_after_the_other(pieces: Sequence[Stretch], times: Float[np.ndarray, "time"]) -> Stretch:
    """Pieces of a stretch as one, at the times that are wanted."""
    every = np.concatenate([piece.times for piece in pieces])
    wanted = np.searchsorted(every, times)
    parts = {
        name: np.concatenate([getattr(piece, name) for piece in pieces], axis=1)[:, wanted]
        for name in ("position", "velocity", "angle", "spin", "exists")
    }
    contacts = pieces[0].contacts
    for piece in pieces[1:]:
        contacts = contacts.followed_by(piece.contacts)
    return Stretch(times, **parts, contacts=contacts, broke_off=np.any([piece.broke_off for piece in pieces], axis=0))


def _deviated(moments: Moments, meeting: Meeting, scattering: Scattering) -> State:
    """The states after some contacts that deviate."""
    rows = np.arange(len(meeting.draws))
    before = moments.before.velocity
    approach = before[rows, meeting.second] - before[rows, meeting.first]
    log_ratio = scattering.log_ratio(meeting, approach)
    after = moments.after.copy()
    for body in (meeting.first, meeting.second):
        after.velocity[rows, body] = before[rows, body] + turned(moments.kick[rows, body], log_ratio)
    return after


def _joined(stretch: Stretch, rest: Stretch, meeting: Meeting) -> Stretch:
    """A stretch whose draws go on otherwise after a contact of each."""
    draws = meeting.draws
    later = stretch.times > meeting.time[:, None]
    parts = {}
    for name in ("position", "velocity", "angle", "spin", "exists"):
        values = getattr(stretch, name).copy()
        chosen = later.reshape(*later.shape, *(1,) * (values.ndim - 2))
        values[draws] = np.where(chosen, getattr(rest, name), values[draws])
        parts[name] = values
    until = np.full(len(stretch.broke_off), np.inf)
    until[draws] = meeting.time
    kept = stretch.contacts.where(stretch.contacts.time <= until[stretch.contacts.draws])
    broke_off = stretch.broke_off.copy()
    broke_off[draws] |= rest.broke_off
    return replace(
        stretch,
        **parts,
        contacts=kept.followed_by(rest.contacts.of_draws(draws[rest.contacts.draws])),
        broke_off=broke_off,
    )


def _alike(
    one: Deviation, normal: Float[np.ndarray, "contact 2"], draws: np.ndarray, approach: Float[np.ndarray, "contact 2"]
) -> Float[np.ndarray, "contact"]:
    """How much of a seen deviation a contact has."""
    speeds = np.linalg.norm(approach, axis=1), np.linalg.norm(one.approach[draws], axis=1)
    square = (_angle(normal, one.normal[draws]) / SAME_ANGLE) ** 2
    square += (_angle(approach, one.approach[draws]) / SAME_ANGLE) ** 2
    square += (np.log(np.maximum(speeds[0], 1e-9) / np.maximum(speeds[1], 1e-9)) / SAME_SPEED) ** 2
    return np.exp(-square / 2)


def _angle(one: Float[np.ndarray, "contact 2"], other: Float[np.ndarray, "contact 2"]) -> Float[np.ndarray, "contact"]:
    cross = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
    return np.asarray(np.abs(np.arctan2(cross, (one * other).sum(axis=1))))

"""What happened in the video, from the tracks: collisions, entrances, exits, and who moves when, draw by draw."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from vrdp_prob.reasoning.chance import Chance, Purpose, Seeded
from vrdp_prob.reasoning.contacts import Contact, SeenMotion, see
from vrdp_prob.reasoning.events import EventTable, EventUniverse
from vrdp_prob.reasoning.facts import MOVING_SPEED, Motion
from vrdp_prob.reasoning.rest import DrawnMotion, Rest, possible_rests
from vrdp_prob.reasoning.smoother import body_tracks
from vrdp_prob.scene import Tracks

CONTACT_TIME_SD = 0.012
"""Standard deviation in s of the time of a contact that shows in the tracks."""

LATE_FRAMES = 3
"""Without a camera an object enters when it is first seen this many frames after the start, or later."""

NEGLIGIBLE_LOG_ODDS = -6.0
"""Doubtful contacts below these log odds are left out."""


@dataclass(frozen=True)
class SeenVideo:
    """A video as its tracks tell it.

    Parameters
    ----------
    tracks
        The measured positions.
    draws
        Number of draws of what they leave open.
    chance
        Where the draws come from.
    """

    tracks: Tracks
    draws: int
    chance: Chance = field(default_factory=Seeded)

    @cached_property
    def seen(self) -> SeenMotion:
        """Contacts and the motion between them."""
        return see(self.tracks.bodies, body_tracks(self.tracks))

    @cached_property
    def universe(self) -> EventUniverse:
        """The possible events."""
        return EventUniverse(tuple(body.id for body in self.tracks.bodies))

    @cached_property
    def presence(self) -> Int[np.ndarray, "body 2"]:
        """First frame in view, and first frame after that not in view (the number of frames if there is none).

        With a camera, the motion is continued beyond the first and the last frame in which an object was seen, for as
        long as its centre stays in the picture: rows may be missing, and a hidden object has not left.
        """
        frames = len(self.tracks.times)
        spans = np.empty((len(self.tracks.bodies), 2), dtype=int)
        for body in range(len(self.tracks.bodies)):
            seen = np.flatnonzero(self.tracks.seen[:, body])
            inside = self._inside(body, seen)
            first, last = int(seen[0]), int(seen[-1])
            while first > 0 and inside[first - 1]:
                first -= 1
            while last + 1 < frames and inside[last + 1]:
                last += 1
            spans[body] = first, last + 1
        return spans

    @cached_property
    def contacts(self) -> tuple[Contact, ...]:
        """All contacts worth a thought, sure and doubtful, in order of time."""
        doubtful = [contact for contact in self.seen.doubtful if contact.log_odds > NEGLIGIBLE_LOG_ODDS]
        return tuple(sorted((*self.seen.contacts, *doubtful), key=lambda contact: contact.time))

    @cached_property
    def happened(self) -> Bool[np.ndarray, "draw contact"]:
        """Which contacts happened in each draw."""
        probability = np.array([contact.probability for contact in self.contacts])
        return self.chance.numbers(Purpose.CONTACTS).random((self.draws, len(probability))) < probability

    @cached_property
    def contact_times(self) -> Float[np.ndarray, "draw contact"]:
        """Time in s of each contact in each draw."""
        times = np.array([contact.time for contact in self.contacts])
        jitter = self.chance.numbers(Purpose.CONTACT_TIMES).standard_normal((self.draws, len(times)))
        return np.clip(times + CONTACT_TIME_SD * jitter, self.tracks.times[0], self.tracks.times[-1])

    @cached_property
    def rests(self) -> tuple[tuple[Rest, ...], ...]:
        """Where each body may lie still."""
        end = float(self.tracks.times[-1])
        return tuple(possible_rests(smoother, until=end) for smoother in self.seen.smoothers)

    @cached_property
    def drawn(self) -> tuple[DrawnMotion, ...]:
        """Draws of the motion of each body."""
        numbers = self.chance.numbers(Purpose.MOTION)
        return tuple(
            DrawnMotion(smoother, rests, self.draws, numbers)
            for smoother, rests in zip(self.seen.smoothers, self.rests, strict=True)
        )

    @cached_property
    def events(self) -> EventTable:
        """What happened, with the start and the end of the video."""
        table = EventTable.empty(self.universe, self.draws)
        times = self.tracks.times
        for place, (first, after) in enumerate(self.presence.tolist()):
            if first > 0:
                self._add(table, int(self.universe.entrances.start) + place, float(times[first]))
            if after < len(times):
                self._add(table, int(self.universe.exits.start) + place, float(times[after]))
        self._add(table, self.universe.start, float(times[0]))
        self._add(table, self.universe.end, float(times[-1]))
        for number, contact in enumerate(self.contacts):
            place = self.universe.collision(contact.first, contact.second)
            is_first = self.happened[:, number] & ~table.happens[:, place]
            table.happens[is_first, place] = True
            table.time[is_first, place] = self.contact_times[is_first, number]
        return table

    @cached_property
    def motion(self) -> Motion:
        """Who moves when."""
        times = self.tracks.times
        shape = (self.draws, len(times), len(self.tracks.bodies))
        in_view, moving = np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
        for place, drawn in enumerate(self.drawn):
            first, after = self.presence[place]
            in_view[:, first:after, place] = True
            _, velocity = drawn.state(times[first:after])
            moving[:, first:after, place] = np.linalg.norm(velocity, axis=-1) > MOVING_SPEED
        return Motion(times, in_view, moving)

    def _inside(self, body: int, seen: Int[np.ndarray, "seen"]) -> Bool[np.ndarray, "frame"]:
        """Whether the centre of a body is in the picture, at every frame."""
        camera, times = self.tracks.camera, self.tracks.times
        if camera is not None:
            return np.asarray(camera.in_view(self.seen.smoothers[body].state(times)[0]))
        inside = np.ones(len(times), dtype=bool)
        if seen[0] > LATE_FRAMES:
            inside[: seen[0]] = False
        if seen[-1] < len(times) - 1 - LATE_FRAMES:
            inside[seen[-1] + 1 :] = False
        return inside

    @staticmethod
    def _add(table: EventTable, place: int, time: float) -> None:
        table.happens[:, place] = True
        table.time[:, place] = time

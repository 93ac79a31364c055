"""What happened in the video, from the tracks: collisions, entrances, exits, and who moves when, draw by draw."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from vrdp_prob.reasoning.chance import Chance, Purpose, Seeded
from vrdp_prob.reasoning.contacts import Contact, SeenMotion
from vrdp_prob.reasoning.events import EventTable, EventUniverse
from vrdp_prob.reasoning.facts import MOVING_SPEED, Motion
from vrdp_prob.reasoning.own_course import SURE, OwnCourses
from vrdp_prob.reasoning.rest import DrawnMotion
from vrdp_prob.reasoning.sight import Sight
from vrdp_prob.scene import Tracks

CONTACT_TIME_SD = 0.012
"""Standard deviation in s of the time of a contact that shows in the tracks."""


@dataclass(frozen=True)
class SeenVideo:
    """Draws of what happened in a video.

    Parameters
    ----------
    sight
        What the tracks tell.
    draws
        Number of draws of what they leave open.
    chance
        Where the draws come from.
    own
        What the rollouts of the draws say of its contacts; None where they are not asked.
    """

    sight: Sight
    draws: int
    chance: Chance = field(default_factory=Seeded)
    own: OwnCourses | None = None

    @property
    def tracks(self) -> Tracks:
        """The measured positions."""
        return self.sight.tracks

    @property
    def seen(self) -> SeenMotion:
        """Contacts and the motion between them."""
        return self.sight.seen

    @property
    def universe(self) -> EventUniverse:
        """The possible events."""
        return self.sight.universe

    @property
    def presence(self) -> Int[np.ndarray, "body 2"]:
        """First frame in view, and first frame after that not in view; see `Sight.presence`."""
        return self.sight.presence

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """All contacts worth a thought, sure and doubtful, in order of time."""
        return self.sight.contacts

    @cached_property
    def happened(self) -> Bool[np.ndarray, "draw contact"]:
        """Which contacts happened in each draw: by their probability, or as in the draw that follows its own course."""
        probability = np.array([contact.probability for contact in self.contacts])
        happened = self.chance.numbers(Purpose.CONTACTS).random((self.draws, len(probability))) < probability
        if self.own is None:
            return np.asarray(happened)
        return np.where(self.on_own_course[:, None], self.own.met | (probability > SURE), happened)

    @cached_property
    def on_own_course(self) -> Bool[np.ndarray, "draw"]:
        """Draws that follow their own course."""
        if self.own is None:
            return np.zeros(self.draws, dtype=bool)
        return self.own.chosen(self.chance.numbers(Purpose.COURSES))

    @cached_property
    def contact_times(self) -> Float[np.ndarray, "draw contact"]:
        """Time in s of each contact in each draw."""
        times = np.array([contact.time for contact in self.contacts])
        jitter = self.chance.numbers(Purpose.CONTACT_TIMES).standard_normal((self.draws, len(times)))
        return np.clip(times + CONTACT_TIME_SD * jitter, self.tracks.times[0], self.tracks.times[-1])

    @cached_property
    def drawn(self) -> tuple[DrawnMotion, ...]:
        """Draws of the motion of each body."""
        doubt, numbers = self.chance.numbers(Purpose.RESTS), self.chance.numbers(Purpose.MOTION)
        return tuple(
            DrawnMotion(smoother, rests, self.draws, doubt=doubt, numbers=numbers)
            for smoother, rests in zip(self.seen.smoothers, self.sight.rests, strict=True)
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

    @staticmethod
    def _add(table: EventTable, place: int, time: float) -> None:
        table.happens[:, place] = True
        table.time[:, place] = time

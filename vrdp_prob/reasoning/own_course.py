"""Draws that are worlds of their own: simulated from the release on, because what happens in them is what was seen.

There are two ways to what would have happened. What was seen may be kept wherever a change does not reach: then errors
of the model cannot grow in it, but the states from which the simulation is resumed carry the noise of the tracks. Or a
draw of the posterior is simulated as it is: then all of it fits together, but a draw in which something else happened
than was seen tells of another video. Both err, in different ways; so half of those draws whose own course of events is
the one that was seen follow it, in doubtful contacts, in changes and after the video, and the other draws keep what was
seen. Where bodies act on each other from afar, no body's motion can be smoothed by itself, and a change reaches all of
them at once; then all draws follow their own course.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool

from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.events import EventTable as RolloutEvents
from vrdp_prob.models.simulator.events import RolloutEventKind
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.reasoning.chance import Random
from vrdp_prob.reasoning.contacts import EDGE, Contact
from vrdp_prob.reasoning.events import EventTable
from vrdp_prob.reasoning.future import after_the_video, future_times
from vrdp_prob.reasoning.intervention import Intervention
from vrdp_prob.reasoning.released import Released
from vrdp_prob.reasoning.sight import Sight
from vrdp_prob.reasoning.stretch import State, advance
from vrdp_prob.reasoning.timeline import Timeline, WorldDraws

SHARE = 0.5
"""Share of the draws that can follow their own course which do, where each body moves by itself."""
SAME_TIME = 0.2
"""Time in s by which a simulated contact may differ from the one that was seen."""
SURE = 0.9
"""Probability of a seen contact from which a draw must have it."""


@dataclass(frozen=True)
class OwnCourses:
    """What happens in the rollouts of draws, compared with what was seen.

    Parameters
    ----------
    sight
        What the tracks tell.
    released
        The draws from the release on, simulated when somebody asks.
    """

    sight: Sight
    released: Released

    def chosen(self, numbers: Random) -> Bool[np.ndarray, "draw"]:
        """Draws that follow their own course, by lot where some keep what was seen."""
        count = len(self.released.worlds)
        if self.released.model.is_coupled:
            return np.ones(count, dtype=bool)
        return self.as_seen & (numbers.random((count,)) < SHARE)

    @cached_property
    def met(self) -> Bool[np.ndarray, "draw contact"]:
        """Which contacts that were seen, for sure or in doubt, happen in each draw."""
        met = np.zeros((len(self.released.worlds), len(self.sight.contacts)), dtype=bool)
        for place, contact in enumerate(self.sight.contacts):
            met[self._collisions.world[_like(self._collisions, contact)], place] = True
        return met

    @cached_property
    def as_seen(self) -> Bool[np.ndarray, "draw"]:
        """Draws in which all happens that was seen for sure, and nothing that would have been seen."""
        sure = np.array([contact.probability > SURE for contact in self.sight.contacts], dtype=bool)
        as_seen = self.released.rollout.fine & self.met[:, sure].all(axis=1)
        as_seen[self._strange.world] = False
        return np.asarray(as_seen)

    @cached_property
    def _collisions(self) -> RolloutEvents:
        """Collisions in each draw, in order of time."""
        return self.released.rollout.events.of_kind(RolloutEventKind.COLLISION)

    @property
    def _strange(self) -> RolloutEvents:
        """First collisions of a pair that nobody saw although both bodies were seen before and after them.

        Later ones may belong to an unbroken series: bodies that press on each other touch again and again.
        """
        pairs = np.stack([self._collisions.world, self._collisions.first, self._collisions.second], axis=1)
        events = self._collisions.where(np.sort(np.unique(pairs, axis=0, return_index=True)[1]))
        tracks = self.sight.tracks
        begin = np.maximum(tracks.first_seen[events.first], tracks.first_seen[events.second]) + EDGE
        end = np.minimum(tracks.last_seen[events.first], tracks.last_seen[events.second]) - EDGE
        strange = (events.time > begin) & (events.time < end)
        for contact in self.sight.contacts:
            strange &= ~_like(events, contact)
        return events.where(strange)


def _like(events: RolloutEvents, contact: Contact) -> Bool[np.ndarray, "collision"]:
    """Which collisions are of the pair of a contact, and at about its time."""
    pair = (events.first == contact.first) & (events.second == contact.second)
    return np.asarray(pair & (np.abs(events.time - contact.time) < SAME_TIME))


def changed_course(
    sight: Sight,
    intervention: Intervention,
    model: PhysicsModel,
    chosen: Bool[np.ndarray, "draw"],
    seen: EventTable,
) -> WorldDraws:
    """Some draws with one object changed, simulated from the release on.

    Parameters
    ----------
    sight
        What the tracks tell.
    intervention
        What is done, to which body, in all draws.
    model
        The physics.
    chosen
        Which draws.
    seen
        What happened in the video: without a camera nobody knows where the picture ends, and who enters or leaves
        does so as it did.
    """
    tracks, draws = sight.tracks, np.flatnonzero(chosen)
    worlds = intervention.worlds.select(draws.tolist())
    stretch = advance(worlds, _at_release(worlds, intervention, draws), tracks.times, model)
    timeline = Timeline(sight.universe, len(draws), tracks.camera)
    for meeting in stretch.meetings():
        timeline.note_meeting(meeting, np.ones(len(meeting.draws), dtype=bool))
    timeline.note_crossings(stretch.times, stretch.position, stretch.exists, np.ones_like(timeline.collided))
    if tracks.camera is None:
        there = intervention.leaves_there[draws]
        timeline.note_as_seen(seen.select(draws), entering=there, leaving=there)
    return timeline.of(stretch)


def continued_course(
    sight: Sight, worlds: Worlds, model: PhysicsModel, chosen: Bool[np.ndarray, "draw"], seen: EventTable
) -> WorldDraws:
    """Some draws after the video, simulated from the release on; see `changed_course` for the parameters."""
    draws = np.flatnonzero(chosen)
    own = worlds.select(draws.tolist())
    stretch = advance(own, State.released(own), future_times(sight.tracks), model)
    return after_the_video(sight, stretch, seen.select(draws))


def _at_release(worlds: Worlds, intervention: Intervention, draws: np.ndarray) -> State:
    """The bodies of some draws as they are released, the changed one as the change has it."""
    state, body = State.released(worlds), intervention.body
    if intervention.change.removes:
        state.present[:, body] = False
    velocity, _ = intervention.released(intervention.worlds.velocity[:, body].detach().numpy())
    state.velocity[:, body] = velocity[draws]
    return state

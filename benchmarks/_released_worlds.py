"""Worlds of which nothing is kept as it was seen: every draw is simulated from the release on, as in VRDP."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from vrdp_prob.reasoning.chance import Purpose, Seeded
from vrdp_prob.reasoning.changes import Change
from vrdp_prob.reasoning.events import EventTable, EventUniverse
from vrdp_prob.reasoning.facts import MOVING_SPEED, Motion, draw_attributes
from vrdp_prob.reasoning.future import future_times
from vrdp_prob.reasoning.intervention import Intervention, drawn_meanings
from vrdp_prob.reasoning.posterior_like import PosteriorLike
from vrdp_prob.reasoning.stretch import State, Stretch, advance
from vrdp_prob.reasoning.timeline import Timeline
from vrdp_prob.reasoning.values import Label
from vrdp_prob.scene import Body


@dataclass(frozen=True)
class ReleasedWorlds:
    """Facts from rollouts alone; see `vrdp_prob.reasoning.facts.Facts`.

    Parameters
    ----------
    posterior
        The posterior of one video.
    draws
        Number of draws.
    """

    posterior: PosteriorLike
    draws: int

    def __hash__(self) -> int:
        return id(self)

    @property
    def bodies(self) -> tuple[Body, ...]:
        return self.posterior.tracks.bodies

    @property
    def effective_draws(self) -> float:
        return float(self.draws)

    def attribute(self, name: str) -> tuple[Label, ...]:
        numbers = Seeded(self.posterior.seed).numbers(Purpose.ATTRIBUTES)
        return draw_attributes(self.bodies, self.draws, numbers)[name]

    def motion(self) -> Motion:
        stretch = self._course(None, 0)
        seen = self._frames
        position, velocity = stretch.position[:, :seen], stretch.velocity[:, :seen]
        camera = self.posterior.tracks.camera
        in_view = stretch.exists[:, :seen] & (True if camera is None else np.asarray(camera.in_view(position)))
        return Motion(
            self.posterior.tracks.times, in_view, in_view & (np.linalg.norm(velocity, axis=-1) > MOVING_SPEED)
        )

    def events(self) -> EventTable:
        table = self._table(self._course(None, 0), until=True).table
        for place, time in ((self._universe.start, 0), (self._universe.end, -1)):
            table.happens[:, place], table.time[:, place] = True, self.posterior.tracks.times[time]
        return table

    def unseen_events(self) -> EventTable:
        return self._table(self._course(None, 0), until=False).table

    def counterfactual_events(self, change: Change, body: int) -> EventTable:
        return self._table(self._course(change, body), until=True).table

    def relies_on_default(self, world: str | tuple[Change, int]) -> tuple[str, ...]:
        del world
        return ()

    def limits(self, world: str | tuple[Change, int]) -> tuple[str, ...]:
        del world
        return ()

    @property
    def _frames(self) -> int:
        return len(self.posterior.tracks.times)

    @property
    def _universe(self) -> EventUniverse:
        return EventUniverse(tuple(body.id for body in self.bodies))

    @cache  # noqa: B019 - the worlds live as long as the answers
    def _course(self, change: Change | None, body: int) -> Stretch:
        """Motion of a world from the release on, into the time after the video."""
        worlds = self.posterior.worlds(self.draws)
        numbers = Seeded(self.posterior.seed).numbers(Purpose.MEANING)
        changed = worlds
        if change is not None:
            changed = Intervention(change, body, worlds, drawn_meanings(change, len(worlds), numbers)).worlds
        times = self.posterior.tracks.times
        more = future_times(self.posterior.tracks)
        state = State.released(changed)
        if change is not None and change.removes:
            state.present[:, body] = False
        return advance(changed, state, np.concatenate([times, more]), self.posterior.model)

    def _table(self, stretch: Stretch, *, until: bool) -> Timeline:
        """Events up to the end of the video, or after it."""
        end = float(self.posterior.tracks.times[-1])
        timeline = Timeline(self._universe, self.draws, self.posterior.tracks.camera)
        if not until:
            met = self._universe.collisions
            timeline.met[:, met] = self.events().happens[:, met]
        for meeting in stretch.meetings():
            within = meeting.time <= end
            timeline.note_meeting(meeting, within if until else ~within)
        chosen = stretch.times <= end if until else stretch.times >= end
        parts = stretch.position[:, chosen], stretch.exists[:, chosen]
        timeline.note_crossings(stretch.times[chosen], *parts, np.ones_like(timeline.collided))
        return timeline

"""What if an object were removed or changed: only what the change can reach is simulated.

Abduction, action, prediction. Until the changed object first touches another, nothing differs from what was seen; where
its speed or its friction changes, or a mass that its path follows, its own course differs from its release on. From
then on a body is *reached* once it touches, or fails to touch, one that is reached (or the changed one); a reached body
is simulated from its last observed state, every other body keeps its observed course and its observed events. Time is
cut at the observed contacts and at regular steps; at each cut the bodies that are not reached are put back on their
observed course, so that no error of the model grows in them.

At the first contact of an object that became heavier, lighter or bouncier the geometry is what it was: the observed
velocity changes are kept and scaled as the impulse of the pair scales, which carries over the part of the contact that
the model does not explain.
"""

from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float

from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.reasoning.contacts import Contact
from vrdp_prob.reasoning.intervention import Intervention
from vrdp_prob.reasoning.refit import Turning
from vrdp_prob.reasoning.scattering import Scattering, advance_scattered
from vrdp_prob.reasoning.seen import SeenVideo
from vrdp_prob.reasoning.stretch import State, Stretch
from vrdp_prob.reasoning.timeline import Timeline, WorldDraws
from vrdp_prob.scene import Shape

LONGEST_STRETCH = 0.4
"""Longest time in s after which bodies that are not reached are put back on their observed course."""

CLEARANCE = 0.1
"""A body is not put back while it is this near (m, between edges) to one that is reached: it may be about to touch."""


class Counterfactual:
    """One changed world of a video, in all draws.

    Parameters
    ----------
    seen
        What the tracks tell.
    worlds
        The posterior draws.
    model
        The physics.
    turning
        Gives angle (rad) and spin (rad/s) of a body at a time (s).
    scattering
        How simulated motion deviates from the model; None where it does not.
    intervention
        What is done, to which body.
    """

    def __init__(
        self,
        seen: SeenVideo,
        worlds: Worlds,
        model: PhysicsModel,
        turning: Turning,
        scattering: Scattering | None = None,
        *,
        intervention: Intervention,
    ) -> None:
        self._scattering = scattering
        self._seen, self._model, self._turning = seen, model, turning
        self._intervention = intervention
        self._change, self._body = intervention.change, intervention.body
        self._worlds = intervention.worlds
        self._mass = worlds.mass.detach().numpy()
        radius = worlds.radius.detach().numpy()[0]
        self._reach = radius * np.array([shape.reach for shape in worlds.shapes])
        count = len(seen.tracks.bodies)
        self._first = np.array([float(s.track.times[0]) for s in seen.seen.smoothers])
        self._last = np.array([float(s.track.times[-1]) for s in seen.seen.smoothers])
        self._reached: Bool[np.ndarray, "draw body"] = np.zeros((seen.draws, count), dtype=bool)
        self._scaled: Bool[np.ndarray, "draw"] = np.zeros(seen.draws, dtype=bool)
        self._timeline = Timeline(seen.universe, seen.draws, seen.tracks.camera)
        self._broke_off: Bool[np.ndarray, "draw"] = np.zeros(seen.draws, dtype=bool)
        self._trajectory, self._exists = self._observed_course()

    def run(self) -> WorldDraws:
        """Simulate what the change reaches."""
        cuts = self._cuts()
        state: State | None = None
        contacts = list(self._seen.contacts)
        for begin, stop in pairwise(cuts.tolist()):
            state = self._back_on_course(begin, state)
            if begin == self._release:
                self._at_release(state)
            while contacts and self._time(contacts[0]) <= begin + 1e-9:
                self._at_contact(contacts.pop(0), state)
            state = self._stretch(state, begin, stop) if self._reached.any() else None
        for contact in contacts:
            self._at_contact(contact, None)
        self._crossings()
        times = self._seen.tracks.times
        return WorldDraws(
            times,
            self._trajectory,
            self._exists,
            self._timeline.table,
            self._timeline.collided | self._touched(),
            self._broke_off,
        )

    def _touched(self) -> Bool[np.ndarray, "draw body"]:
        """The changed body, where its mass decided a contact that was seen."""
        touched = np.zeros_like(self._reached)
        touched[:, self._body] = self._scaled
        return touched

    @property
    def _release(self) -> float | None:
        """When the change is felt before any contact, in s; None where that is in no draw."""
        return float(self._first[self._body]) if self._intervention.felt_at_release.any() else None

    def _at_release(self, state: State) -> None:
        """Another speed or friction, or a mass that the path follows, reaches its body as soon as it moves."""
        velocity, felt = self._intervention.released(state.velocity[:, self._body])
        state.velocity[:, self._body] = velocity
        state.rolling[felt, self._body] = state.velocity[felt, self._body]
        self._reached[felt, self._body] = True

    def _time(self, contact: Contact) -> float:
        return float(np.clip(contact.time, self._seen.tracks.times[0], self._seen.tracks.times[-1]))

    def _cuts(self) -> Float[np.ndarray, "cut"]:
        """Times at which bodies are put back on course, from where the change is first felt to the end."""
        end = float(self._seen.tracks.times[-1])
        own = [self._time(c) for c in self._seen.contacts if self._body in (c.first, c.second)]
        own += [] if self._release is None else [self._release]
        begin = min(own, default=end)
        marks = sorted({begin, end, *own, *(t for t in map(self._time, self._seen.contacts) if begin < t < end)})
        cuts = [marks[0]]
        for mark in marks[1:]:
            pieces = max(int(np.ceil((mark - cuts[-1]) / LONGEST_STRETCH)), 1)
            cuts += np.linspace(cuts[-1], mark, pieces + 1)[1:].tolist()
        return np.array(cuts)

    def _observed_course(self) -> tuple[np.ndarray, np.ndarray]:
        """Trajectory and existence of all bodies as they were seen, without the removed one."""
        times = self._seen.tracks.times
        count = len(self._seen.tracks.bodies)
        trajectory = np.zeros((self._seen.draws, len(times), count, 3))
        exists = np.zeros((self._seen.draws, len(times), count), dtype=bool)
        for body in range(count):
            trajectory[:, :, body, :2] = self._seen.drawn[body].state(times)[0]
            if self._seen.tracks.bodies[body].shape is Shape.CUBE:
                held = np.clip(times, self._first[body], self._last[body])
                trajectory[:, :, body, 2] = np.stack([self._turning(body, float(time))[0] for time in held], axis=1)
            first, after = self._seen.presence[body]
            exists[:, first:after, body] = body != self._body or not self._change.removes
        return trajectory, exists

    def _back_on_course(self, time: float, carried: State | None) -> State:
        """The state at a cut: reached bodies where the simulation left them, all others where they were seen."""
        state = carried.copy() if carried is not None else self._nowhere(time)
        held = self._reached if carried is None else self._reached | self._near_reached(state)
        for body, drawn in enumerate(self._seen.drawn):
            # a body that left the picture was seen for the last time then; from there on it is only simulated
            if carried is not None and time > self._last[body]:
                continue
            at = float(np.clip(time, self._first[body], self._last[body]))
            position, velocity = (array[:, 0] for array in drawn.state(np.array([at])))
            angle, spin = self._turning(body, at)
            free = ~held[:, body]
            state.position[free, body], state.velocity[free, body] = position[free], velocity[free]
            state.rolling[free, body] = drawn.state(np.array([at]), before=True)[1][free, 0]
            state.angle[free, body], state.spin[free, body] = angle[free], spin[free]
            state.release[free, body] = at
        return state

    def _nowhere(self, time: float) -> State:
        state = State.nowhere((self._seen.draws, len(self._seen.drawn)), time)
        state.present[:] = True
        if self._change.removes:
            state.present[:, self._body] = False
        return state

    def _near_reached(self, state: State) -> Bool[np.ndarray, "draw body"]:
        apart = np.linalg.norm(state.position[:, :, None] - state.position[:, None], axis=-1)
        near = apart < self._reach[:, None] + self._reach + CLEARANCE
        return np.asarray((near & self._reached[:, None, :]).any(axis=2))

    def _at_contact(self, contact: Contact, state: State | None) -> None:
        """An observed contact: kept where nothing reached it, undone or changed where something did."""
        number = self._seen.contacts.index(contact)
        happened = self._seen.happened[:, number]
        pair = (contact.first, contact.second)
        involves = self._body in pair
        free = happened & ~self._reached[:, pair[0]] & ~self._reached[:, pair[1]]
        kept = free if not involves or not self._change.removes else np.zeros_like(free)
        draws = np.flatnonzero(kept)
        place = self._seen.universe.collision(*pair)
        self._timeline.note(draws, place, self._seen.contact_times[draws, number])
        if state is None:
            return
        before = {
            body: [array[:, 0] for array in self._seen.drawn[body].state(np.array([self._time(contact)]), before=True)]
            for body in pair
        }
        if involves and not self._change.removes:
            felt = free & self._intervention.felt_at_contact
            self._scaled_kicks(state, pair, before, felt)
            self._reached[np.ix_(felt, list(pair))] = True
            self._scaled |= felt
        reached = self._reached.copy()
        if self._change.removes:
            reached[:, self._body] = True
        for body, other in (pair, pair[::-1]):
            if body == self._body and self._change.removes:
                continue
            # a contact that does not take place as it did: from here on the body is on its own
            missed = happened & ~self._reached[:, body] & reached[:, other] & ~kept
            near = self._near_reached(state)[:, body]
            fresh = missed & ~near
            state.velocity[fresh, body] = before[body][1][fresh]
            self._reached[missed, body] = True

    def _scaled_kicks(
        self, state: State, pair: tuple[int, int], before: dict[int, list[np.ndarray]], draws: Bool[np.ndarray, "draw"]
    ) -> None:
        """Velocities after the first contact of the changed body: observed kicks, scaled as the impulse scales."""
        changed, other = self._body, pair[0] if pair[1] == self._body else pair[1]
        mass, partner = self._mass[:, changed, None], self._mass[:, other, None]
        kick = {body: state.velocity[:, body] - before[body][1] for body in pair}
        # both kicks tell the impulse: momentum weighs the surer one more
        ratio = mass / partner
        kick_other = (kick[other] - ratio * kick[changed]) / 2
        kick_other = kick_other * self._intervention.impulse_ratio(other)[:, None]
        kick_changed = -kick_other * partner / self._worlds.mass.detach().numpy()[:, changed, None]
        for body, change in ((changed, kick_changed), (other, kick_other)):
            state.velocity[draws, body] = (before[body][1] + change)[draws]

    def _stretch(self, state: State, begin: float, stop: float) -> State:
        """Simulate from one cut to the next and note what happens to reached bodies."""
        frames = self._seen.tracks.times
        own = np.flatnonzero((frames > begin + 1e-9) & (frames < stop - 1e-9))
        times = np.concatenate([[begin], frames[own], [stop]])
        active = np.flatnonzero(self._reached.any(axis=1))
        scattering = None if self._scattering is None else self._scattering.select(active)
        stretch = advance_scattered(
            self._worlds.select(active.tolist()), state.select(active), times, self._model, scattering
        )
        self._broke_off[active] |= stretch.broke_off
        self._spread(stretch, active)
        self._record(stretch, active, own, stop)
        after = state.copy()
        after.position[active], after.velocity[active] = stretch.position[:, -1], stretch.velocity[:, -1]
        after.angle[active], after.spin[active] = stretch.angle[:, -1], stretch.spin[:, -1]
        after.rolling[active] = stretch.velocity[:, -1]
        after.release[active] = np.maximum(after.release[active], stop)
        return after

    def _spread(self, stretch: Stretch, active: np.ndarray) -> None:
        """Contacts of reached bodies happen, and reach the other body."""
        for meeting in stretch.meetings():
            draws = active[meeting.draws]
            keep = self._reached[draws, meeting.first] | self._reached[draws, meeting.second]
            self._reached[draws[keep], meeting.first[keep]] = True
            self._reached[draws[keep], meeting.second[keep]] = True
            self._timeline.note_meeting(meeting.of_draws(draws), keep)

    def _record(self, stretch: Stretch, active: np.ndarray, own: np.ndarray, stop: float) -> None:
        frames = self._seen.tracks.times
        number = np.append(own, np.flatnonzero(np.abs(frames - stop) < 1e-9)[:1])
        places = stretch.position[:, : len(number)], stretch.angle[:, : len(number)]
        for body in range(self._reached.shape[1]):
            rows = np.flatnonzero(self._reached[active, body])
            draws, frame = np.ix_(active[rows], number)
            self._trajectory[draws, frame, body, :2] = places[0][rows][:, :, body]
            self._trajectory[draws, frame, body, 2] = places[1][rows][:, :, body]
            self._exists[draws, frame, body] = stretch.exists[rows][:, : len(number), body]

    def _crossings(self) -> None:
        """Entrances and exits: as seen for bodies that were not reached, as simulated for the others."""
        there = self._intervention.leaves_there
        self._timeline.note_as_seen(self._seen.events, entering=there, leaving=there & ~self._reached)
        self._timeline.note_crossings(self._seen.tracks.times, self._trajectory[..., :2], self._exists, self._reached)

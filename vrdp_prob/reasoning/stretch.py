"""One stretch of simulated time: states in, states and contacts out, for all draws at once."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Bool, Float, Int

from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.events import RolloutEventKind
from vrdp_prob.models.simulator.outcome import Outcome
from vrdp_prob.models.simulator.rollout import simulate
from vrdp_prob.models.simulator.worlds import Worlds

EVENT_LIMIT = 1000
"""Events of one draw in one stretch after which it is left as it is: bodies pressed together touch without end."""

INSTANT = 1e-7
"""Time in s by which states before and after a contact differ from its own."""


@dataclass
class State:
    """Where all bodies are at one time, in every draw.

    Parameters
    ----------
    position, velocity
        In m and m/s.
    angle, spin
        In rad and rad/s.
    release
        Time in s from which on a body has this state and moves.
    present
        Whether it takes part.
    rolling
        Velocity in m/s at which it would roll by its spin, which matters for spheres in models in which they slip; NaN
        where the model says it.
    """

    position: Float[np.ndarray, "draw body 2"]
    velocity: Float[np.ndarray, "draw body 2"]
    angle: Float[np.ndarray, "draw body"]
    spin: Float[np.ndarray, "draw body"]
    release: Float[np.ndarray, "draw body"]
    present: Bool[np.ndarray, "draw body"]
    rolling: Float[np.ndarray, "draw body 2"]

    @classmethod
    def nowhere(cls, shape: tuple[int, int], release: float) -> "State":
        """Nobody present yet: bodies (draw, body) at rest at the origin, released at a time (s)."""
        position, velocity = np.zeros((*shape, 2)), np.zeros((*shape, 2))
        present = np.zeros(shape, dtype=bool)
        released = np.full(shape, release)
        return cls(position, velocity, np.zeros(shape), np.zeros(shape), released, present, velocity.copy())

    @classmethod
    def released(cls, worlds: Worlds) -> "State":
        """The bodies as worlds release them; whether spheres roll then, the model of the worlds says."""
        tensors = worlds.position, worlds.velocity, worlds.angle, worlds.spin, worlds.release_time, worlds.present
        position, velocity, angle, spin, release, present = (tensor.detach().numpy().copy() for tensor in tensors)
        return cls(position, velocity, angle, spin, release, present, np.full_like(velocity, np.nan))

    def copy(self) -> "State":
        """The same state in arrays of its own."""
        return State(*(array.copy() for array in vars(self).values()))

    def select(self, draws: np.ndarray) -> "State":
        """The state in some of the draws."""
        return State(*(array[draws] for array in vars(self).values()))

    def put(self, draws: np.ndarray, other: "State") -> None:
        """Take over the state of some draws."""
        for name, array in vars(self).items():
            array[draws] = getattr(other, name)


@dataclass(frozen=True)
class Meeting:
    """The contacts of the draws that have at least so many: each draw's next one, in order of time.

    Parameters
    ----------
    draws
        Which draws.
    time
        When, in s.
    first, second
        Which bodies.
    point
        Where, in m.
    normal
        Unit vector from the first to the second.
    """

    draws: Int[np.ndarray, "contact"]
    time: Float[np.ndarray, "contact"]
    first: Int[np.ndarray, "contact"]
    second: Int[np.ndarray, "contact"]
    point: Float[np.ndarray, "contact 2"]
    normal: Float[np.ndarray, "contact 2"]

    def of_draws(self, draws: Int[np.ndarray, "contact"]) -> "Meeting":
        """The same contacts under other numbers of their draws."""
        return replace(self, draws=draws)

    def where(self, keep: np.ndarray) -> "Meeting":
        """Some of the contacts."""
        return Meeting(*(array[keep] for array in vars(self).values()))

    def followed_by(self, other: "Meeting") -> "Meeting":
        """These contacts and others, in order of draws and times; of an unbroken series of a pair the first."""
        pairs = zip(vars(self).values(), vars(other).values(), strict=True)
        return Meeting(*(np.concatenate(pair) for pair in pairs)).in_order()

    def in_order(self) -> "Meeting":
        """The contacts in order of draws and times; of an unbroken series of the same pair the first."""
        order = np.lexsort((self.time, self.draws))
        same = [np.diff(array[order], prepend=-1) == 0 for array in (self.draws, self.first, self.second)]
        return self.where(order[~np.all(same, axis=0)])


@dataclass(frozen=True)
class Stretch:
    """What the simulation made of a state.

    Parameters
    ----------
    times
        Times in s.
    position, velocity
        In m and m/s.
    angle, spin
        In rad and rad/s.
    exists
        Whether a body is present and released.
    contacts
        Contacts of bodies; of an unbroken series of contacts of the same pair the first.
    broke_off
        Draws whose simulation broke off (see `Outcome`); bodies are where they were then.
    """

    times: Float[np.ndarray, "time"]
    position: Float[np.ndarray, "draw time body 2"]
    velocity: Float[np.ndarray, "draw time body 2"]
    angle: Float[np.ndarray, "draw time body"]
    spin: Float[np.ndarray, "draw time body"]
    exists: Bool[np.ndarray, "draw time body"]
    contacts: Meeting
    broke_off: Bool[np.ndarray, "draw"]

    def meetings(self) -> Iterator[Meeting]:
        """First contacts of all draws, then second contacts, and so on: every draw in order of time."""
        rank = _rank(self.contacts.draws)
        for number in range(int(rank.max(initial=-1)) + 1):
            yield self.contacts.where(rank == number)

    def end(self, begin: State) -> State:
        """The state at the last time, of a stretch that began in another one; spheres roll by then."""
        last = float(self.times[-1])
        return State(
            self.position[:, -1].copy(),
            self.velocity[:, -1].copy(),
            self.angle[:, -1].copy(),
            self.spin[:, -1].copy(),
            np.maximum(begin.release, last),
            begin.present.copy(),
            self.velocity[:, -1].copy(),
        )

    def next_meeting(self, after: Float[np.ndarray, "draw"]) -> Meeting:
        """The first contact of each draw later than a time (s) of each; of draws that have one."""
        later = self.contacts.where(self.contacts.time > after[self.contacts.draws])
        return later.where(_rank(later.draws) == 0)


@dataclass(frozen=True)
class Moments:
    """All bodies immediately before and after a contact of each draw; spheres roll until then.

    Parameters
    ----------
    before, after
        The two states; bodies that are not released yet are as they will be.
    """

    before: State
    after: State

    @property
    def kick(self) -> Float[np.ndarray, "draw body 2"]:
        """Changes of the velocities in m/s."""
        return self.after.velocity - self.before.velocity


def advance(worlds: Worlds, state: State, times: Float[np.ndarray, "time"], model: PhysicsModel) -> Stretch:
    """Simulate worlds from given states.

    Parameters
    ----------
    worlds
        Masses, restitutions and parameters of each draw.
    state
        Where the bodies are.
    times
        Times in s at which the result is wanted.
    model
        The physics.
    """
    released = _released(worlds, state)
    with torch.no_grad():
        rollout = simulate(released, torch.from_numpy(np.array(times)), model, event_limit=EVENT_LIMIT)
    events = rollout.events.of_kind(RolloutEventKind.COLLISION)
    trajectory, velocity = rollout.trajectory.numpy(), rollout.velocity.numpy()
    return Stretch(
        np.asarray(times),
        trajectory[..., :2],
        velocity[..., :2],
        trajectory[..., 2],
        velocity[..., 2],
        rollout.exists.numpy(),
        Meeting(
            np.asarray(events.world, dtype=np.int64),
            np.asarray(events.time, dtype=float),
            np.asarray(events.first, dtype=np.int64),
            np.asarray(events.second, dtype=np.int64),
            np.asarray(events.point, dtype=float),
            np.asarray(events.normal, dtype=float),
        ).in_order(),
        np.array([outcome not in (Outcome.OK, Outcome.OVERLAP) for outcome in rollout.outcome]),
    )


def around(worlds: Worlds, state: State, time: Float[np.ndarray, "draw"], model: PhysicsModel) -> Moments:
    """The states immediately before and after a time (s) of each draw; see `advance` for the rest."""
    times = torch.from_numpy(time[:, None] + INSTANT * np.array([-1.0, 1.0]))
    with torch.no_grad():
        rollout = simulate(_released(worlds, state), times, model, event_limit=EVENT_LIMIT)
    trajectory, velocity = rollout.trajectory.numpy(), rollout.velocity.numpy()
    release = np.maximum(state.release, time[:, None] + INSTANT)
    before, after = (
        State(
            trajectory[:, side, :, :2].copy(),
            velocity[:, side, :, :2].copy(),
            trajectory[:, side, :, 2].copy(),
            velocity[:, side, :, 2].copy(),
            release.copy(),
            state.present.copy(),
            velocity[:, 0, :, :2].copy(),
        )
        for side in (0, 1)
    )
    return Moments(before, after)


def _released(worlds: Worlds, state: State) -> Worlds:
    """The worlds with bodies in given states."""
    return replace(
        worlds,
        position=torch.from_numpy(np.ascontiguousarray(state.position)),
        velocity=torch.from_numpy(np.ascontiguousarray(state.velocity)),
        angle=torch.from_numpy(np.ascontiguousarray(state.angle)),
        spin=torch.from_numpy(np.ascontiguousarray(state.spin)),
        release_time=torch.from_numpy(np.ascontiguousarray(state.release)),
        present=torch.from_numpy(np.ascontiguousarray(state.present)),
        rolling=None if np.isnan(state.rolling).any() else torch.from_numpy(np.ascontiguousarray(state.rolling)),
    )


def _rank(draws: Int[np.ndarray, "contact"]) -> Int[np.ndarray, "contact"]:
    """Place of each contact within its draw, for contacts sorted by draw."""
    starts = np.flatnonzero(np.diff(draws, prepend=-1))
    lengths = np.diff(np.append(starts, len(draws)))
    return np.arange(len(draws)) - np.repeat(starts, lengths)

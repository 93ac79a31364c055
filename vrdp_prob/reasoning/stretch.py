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
    """

    position: Float[np.ndarray, "draw body 2"]
    velocity: Float[np.ndarray, "draw body 2"]
    angle: Float[np.ndarray, "draw body"]
    spin: Float[np.ndarray, "draw body"]
    release: Float[np.ndarray, "draw body"]
    present: Bool[np.ndarray, "draw body"]

    def copy(self) -> "State":
        """The same state in arrays of its own."""
        return State(*(array.copy() for array in vars(self).values()))

    def select(self, draws: np.ndarray) -> "State":
        """The state in some of the draws."""
        return State(*(array[draws] for array in vars(self).values()))


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
    """

    draws: Int[np.ndarray, "contact"]
    time: Float[np.ndarray, "contact"]
    first: Int[np.ndarray, "contact"]
    second: Int[np.ndarray, "contact"]
    point: Float[np.ndarray, "contact 2"]

    def of_draws(self, draws: Int[np.ndarray, "contact"]) -> "Meeting":
        """The same contacts under other numbers of their draws."""
        return replace(self, draws=draws)


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
        contacts = self.contacts
        rank = _rank(contacts.draws)
        for number in range(int(rank.max(initial=-1)) + 1):
            own = rank == number
            yield Meeting(
                contacts.draws[own], contacts.time[own], contacts.first[own], contacts.second[own], contacts.point[own]
            )


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
    released = replace(
        worlds,
        position=torch.from_numpy(np.ascontiguousarray(state.position)),
        velocity=torch.from_numpy(np.ascontiguousarray(state.velocity)),
        angle=torch.from_numpy(np.ascontiguousarray(state.angle)),
        spin=torch.from_numpy(np.ascontiguousarray(state.spin)),
        release_time=torch.from_numpy(np.ascontiguousarray(state.release)),
        present=torch.from_numpy(np.ascontiguousarray(state.present)),
    )
    with torch.no_grad():
        rollout = simulate(released, torch.from_numpy(np.ascontiguousarray(times)), model, event_limit=EVENT_LIMIT)
    events = rollout.events.of_kind(RolloutEventKind.COLLISION)
    order = np.lexsort((events.time, events.world))
    same = [np.diff(array[order], prepend=-1) == 0 for array in (events.world, events.first, events.second)]
    order = order[~np.all(same, axis=0)]
    trajectory, velocity = rollout.trajectory.numpy(), rollout.velocity.numpy()
    return Stretch(
        np.asarray(times),
        trajectory[..., :2],
        velocity[..., :2],
        trajectory[..., 2],
        velocity[..., 2],
        rollout.exists.numpy(),
        Meeting(
            np.asarray(events.world[order], dtype=np.int64),
            np.asarray(events.time[order], dtype=float),
            np.asarray(events.first[order], dtype=np.int64),
            np.asarray(events.second[order], dtype=np.int64),
            np.asarray(events.point[order], dtype=float),
        ),
        np.array([outcome not in (Outcome.OK, Outcome.OVERLAP) for outcome in rollout.outcome]),
    )


def _rank(draws: Int[np.ndarray, "contact"]) -> Int[np.ndarray, "contact"]:
    """Place of each contact within its draw, for contacts sorted by draw."""
    starts = np.flatnonzero(np.diff(draws, prepend=-1))
    lengths = np.diff(np.append(starts, len(draws)))
    return np.arange(len(draws)) - np.repeat(starts, lengths)

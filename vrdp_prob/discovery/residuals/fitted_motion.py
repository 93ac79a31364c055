"""The motion that a fit believes in, frame by frame, and how every later frame answers to a change of a state.

A change of the states at one frame is carried to the next one by a matrix, contacts included. The matrices come from
simulating each step with each state a little changed, so no law of motion is written here a second time.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from vrdp_prob.models.likelihood import EVENT_LIMIT, Likelihood
from vrdp_prob.models.scenery import Scenery
from vrdp_prob.models.simulator.events import CONTACTS, EventTable, RolloutEventKind
from vrdp_prob.models.simulator.rollout import simulate
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.scene import Tracks

AT_REST = 1e-6
"""Speed in m/s below which a simulated body rests."""
SLOWEST = 1e-3
"""Speed in m/s below which a direction of motion means nothing."""
STATE = 6
"""Numbers of a body's state: x, y, vx, vy, angle, spin."""
PLACES, RATES, SEEN = [0, 1, 4], [2, 3, 5], [0, 1, 4]
"""Places of x, y and angle among them, of their rates, and of what is measured."""
STEP = 1e-6
"""Change of a state (m, m/s, rad, rad/s) by which a matrix is found."""
GROWTH = 1e-5
"""Relative change of the radii by which its effect is found."""
APART = 1e-3
"""Time in s by which a frame must be apart from a contact for the two not to change places under such a change."""
REACH = 2.5
"""Frames around a contact in which a kick would be taken for the contact."""
TOUCHING = (*CONTACTS, RolloutEventKind.KICK)
"""Events that change velocities at once."""


@dataclass(frozen=True)
class Kicks:
    """Changes of velocities at once, some for each of several patterns.

    Parameters
    ----------
    times, bodies
        When (s) and to which body each kick happens.
    changes
        Change of vx and vy in m/s and of the spin in rad/s, for each pattern.
    moves
        Change of x and y in m and of the angle in rad at the same time; none where None.
    """

    times: Float[np.ndarray, "kick"]
    bodies: Int[np.ndarray, "kick"]
    changes: Float[np.ndarray, "kick 3 column"]
    moves: Float[np.ndarray, "kick 3 column"] | None = None

    @classmethod
    def single(cls, times: Float[np.ndarray, "kick"], bodies: Int[np.ndarray, "kick"]) -> "Kicks":
        """Kicks of 1 m/s along x and along y, each a pattern of its own."""
        count = len(times)
        changes = np.zeros((count, 3, count, 2))
        for axis in range(2):
            changes[np.arange(count), axis, np.arange(count), axis] = 1.0
        return cls(times, bodies, changes.reshape(count, 3, 2 * count))


@dataclass(frozen=True)
class FittedMotion:
    """Simulated states of the bodies of one video at its frames.

    Parameters
    ----------
    tracks
        What was seen.
    times
        True times of the frames in s.
    position, velocity
        States in m and m/s.
    spin
        Angular velocities in rad/s.
    events
        Contacts and stops.
    mass, inertia
        Masses in kg, and moments of inertia about the vertical in kg m^2.
    growth
        Changes of all places (m) and angles (rad) per relative change of all radii.
    nodes
        Frame from which changes of states are carried to each frame.
    steps
        Matrices that carry changes of the states of all bodies (x, y, vx, vy, angle, spin each) from there.
    """

    tracks: Tracks
    times: Float[np.ndarray, "time"]
    position: Float[np.ndarray, "time body 2"]
    velocity: Float[np.ndarray, "time body 2"]
    spin: Float[np.ndarray, "time body"]
    events: EventTable
    mass: Float[np.ndarray, "body"]
    inertia: Float[np.ndarray, "body"]
    growth: Float[np.ndarray, "time body 3"]
    nodes: Int[np.ndarray, "time"]
    steps: Float[np.ndarray, "time state state"]

    @classmethod
    def of(cls, likelihood: Likelihood, point: Float[np.ndarray, "dimension"]) -> "FittedMotion":
        """The motion at a point of a video's density."""
        rows = torch.from_numpy(point[None])
        tracks = likelihood.tracks
        with torch.no_grad():
            worlds = Scenery.of(tracks).worlds(likelihood.model, likelihood.coordinates.quantities(rows))
            rollout = likelihood.rollout(rows)
        trajectory, velocity = rollout.trajectory[0].numpy(), rollout.velocity[0].numpy()
        times = rollout.times[0].numpy()
        events = rollout.events
        nodes = _nodes(times, events.time[np.isin(events.kind, TOUCHING)])
        release = rollout.times[:, tracks.seen.argmax(axis=0)]
        return cls(
            tracks,
            times,
            trajectory[..., :2],
            velocity[..., :2],
            velocity[..., 2],
            events,
            worlds.mass[0].numpy(),
            worlds.moment_of_inertia[0].numpy(),
            _growth(likelihood, worlds.released_at(release), rollout.times),
            nodes,
            _steps(likelihood, worlds.released_at(release), times, _states(trajectory, velocity), nodes),
        )

    @cached_property
    def frame_time(self) -> float:
        """Time in s between two frames."""
        return float(np.median(np.diff(self.times)))

    @cached_property
    def speed(self) -> Float[np.ndarray, "time body"]:
        """Speed in m/s."""
        return np.linalg.norm(self.velocity, axis=-1)

    @cached_property
    def direction(self) -> Float[np.ndarray, "time body 2"]:
        """Unit vector along the velocity; 0 where a body (almost) rests."""
        fast = self.speed > SLOWEST
        return np.where(fast[..., None], self.velocity / np.where(fast, self.speed, 1.0)[..., None], 0.0)

    @cached_property
    def sideways(self) -> Float[np.ndarray, "time body 2"]:
        """Unit vector to the left of the velocity; 0 where a body (almost) rests."""
        return np.stack([-self.direction[..., 1], self.direction[..., 0]], axis=-1)

    @cached_property
    def moving(self) -> Bool[np.ndarray, "time body"]:
        """Whether a body is there and moves."""
        released = self.tracks.times[:, None] >= self.tracks.first_seen
        return np.asarray(released & (self.speed > AT_REST))

    def contact_times(self, body: int) -> Float[np.ndarray, "contact"]:
        """Times in s at which the velocity of a body changes at once."""
        events = self.events
        touching = np.isin(events.kind, TOUCHING)
        kicks = events.kind == RolloutEventKind.KICK
        return np.sort(events.time[touching & (events.concerns([body]) | kicks)])

    def pushed(self, acceleration: Float[np.ndarray, "time body 2 column"]) -> Float[np.ndarray, "time body 3 column"]:
        """Changes of all places (m) and angles (rad) by further accelerations (m/s^2) of what moves."""
        count = acceleration.shape[-1]
        half = np.zeros((*self.speed.shape, STATE, count))
        half[:, :, 2:4] = acceleration * self.moving[..., None, None] / 2
        change = np.zeros_like(half)
        for frame, node in enumerate(self.nodes[1:], start=1):
            span = self.times[frame] - self.times[node]
            before = (change[node] + span * half[node]).reshape(len(self.steps[frame]), count)
            change[frame] = (self.steps[frame] @ before).reshape(change[frame].shape) + span * half[frame]
        return change[:, :, SEEN]

    def kicked(self, kicks: "Kicks") -> Float[np.ndarray, "time body 3 column"]:
        """Changes of all places (m) and angles (rad) by kicks."""
        changes = kicks.changes
        moves = np.zeros_like(changes) if kicks.moves is None else kicks.moves
        change = np.zeros((*self.speed.shape, STATE, changes.shape[-1]))
        last = len(self.times) - 1
        waiting = np.append(np.flatnonzero(self.restart), last)
        begin = waiting[np.minimum(np.searchsorted(self.times[waiting[:-1]], kicks.times), len(waiting) - 1)]
        for frame, node in enumerate(self.nodes):
            if frame:
                before = change[node].reshape(len(self.steps[frame]), -1)
                change[frame] = (self.steps[frame] @ before).reshape(change[frame].shape)
            for kick in np.flatnonzero((kicks.times <= self.times[frame]) & (begin >= frame)):
                since = self.times[frame] - kicks.times[kick]
                change[frame, kicks.bodies[kick], PLACES] += moves[kick] + since * changes[kick]
                change[frame, kicks.bodies[kick], RATES] += changes[kick]
        return change[:, :, SEEN]

    @cached_property
    def restart(self) -> Bool[np.ndarray, "time"]:
        """Whether changes of states may be carried on from a frame: not next to a contact, which they may swap with."""
        return np.isin(np.arange(len(self.times)), self.nodes)


def _nodes(times: Float[np.ndarray, "time"], contacts: Float[np.ndarray, "contact"]) -> Int[np.ndarray, "time"]:
    """Frame from which changes of states are carried to each frame: the last one before it apart from contacts."""
    near = (np.abs(times[:, None] - contacts) < APART).any(axis=1)
    near[0] = False
    last = np.maximum.accumulate(np.where(near, 0, np.arange(len(times))))
    return np.concatenate([[0], last[:-1]])


def _steps(
    likelihood: Likelihood,
    worlds: Worlds,
    times: Float[np.ndarray, "time"],
    states: Float[np.ndarray, "time body 6"],
    nodes: Int[np.ndarray, "time"],
) -> Float[np.ndarray, "time state state"]:
    """Matrices that carry changes of the states from a node to each frame; the first frame's is of no use."""
    count, bodies = states.shape[:2]
    size = STATE * bodies
    moves = STEP * np.concatenate([np.eye(size), -np.eye(size)])
    starts = (states[nodes[1:]].reshape(count - 1, 1, size) + moves).reshape(-1, bodies, STATE)
    begin, end = np.repeat(times[nodes[1:]], len(moves)), np.repeat(times[1:], len(moves))
    numbers = torch.from_numpy(np.ascontiguousarray(starts))
    changed = replace(
        worlds.select([0] * len(starts)),
        position=numbers[..., :2],
        velocity=numbers[..., 2:4],
        angle=numbers[..., 4],
        spin=numbers[..., 5],
        release_time=torch.from_numpy(np.maximum(begin[:, None], worlds.release_time.numpy())),
    )
    with torch.no_grad():
        ends = simulate(
            changed, torch.from_numpy(np.stack([begin, end], axis=1)), likelihood.model, event_limit=EVENT_LIMIT
        )
    after = _states(ends.trajectory[:, 1].numpy(), ends.velocity[:, 1].numpy()).reshape(count - 1, 2, size, size)
    matrices = np.swapaxes(after[:, 0] - after[:, 1], 1, 2) / (2 * STEP)
    return np.concatenate([np.eye(size)[None], np.nan_to_num(matrices)])


def _growth(
    likelihood: Likelihood, worlds: Worlds, times: Float[Tensor, "one time"]
) -> Float[np.ndarray, "time body 3"]:
    """Changes of what is measured per relative change of all radii."""
    factor = torch.tensor([[1 + GROWTH], [1 - GROWTH]], dtype=torch.float64)
    pair = worlds.select([0, 0])
    with torch.no_grad():
        ends = simulate(
            replace(pair, radius=factor * pair.radius), times[0], likelihood.model, event_limit=EVENT_LIMIT
        ).trajectory.numpy()
    return np.nan_to_num((ends[0] - ends[1]) / (2 * GROWTH))


def _states(
    trajectory: Float[np.ndarray, "many body 3"], velocity: Float[np.ndarray, "many body 3"]
) -> Float[np.ndarray, "many body 6"]:
    return np.concatenate([trajectory[..., :2], velocity[..., :2], trajectory[..., 2:], velocity[..., 2:]], axis=-1)

"""The contacts that a fit believes in: where, how fast, and how anything that acts there would show."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from vrdp_prob.discovery.residuals.fitted_motion import FittedMotion, Kicks
from vrdp_prob.models.simulator.events import EventTable, RolloutEventKind
from vrdp_prob.scene import Shape

CREEP = 0.02
"""Slip in m/s below which the direction of rubbing is smoothed."""
SLOWEST = 1e-3
"""Slowest approach in m/s that is told apart."""


@dataclass(frozen=True)
class FittedContacts:
    """Contacts of bodies in one video, with each other or with stated walls.

    A contact has a side for each body that takes part: two, or one at a wall, which does not move.

    Parameters
    ----------
    motion
        The motion.
    events
        The contacts.
    kind
        What the bodies touch: each other (`COLLISION`) or a wall (`WALL`).
    """

    motion: FittedMotion
    events: EventTable
    kind: RolloutEventKind = RolloutEventKind.COLLISION

    @classmethod
    def of(cls, motion: FittedMotion, kind: RolloutEventKind = RolloutEventKind.COLLISION) -> "FittedContacts":
        """The contacts of a motion."""
        return cls(motion, motion.events.of_kind(kind), kind)

    def where(self, keep: Bool[np.ndarray, "contact"]) -> "FittedContacts":
        """Some of the contacts."""
        return replace(self, events=self.events.where(keep))

    @property
    def known_normal(self) -> Bool[np.ndarray, "contact"]:
        """Whether the direction of the normal is known by where the bodies are, and how they are turned."""
        cubes = np.array([body.shape is Shape.CUBE for body in self.motion.tracks.bodies])
        return ~(cubes & ~self.motion.tracks.angles_told)[self.bodies].any(axis=1)

    def __len__(self) -> int:
        return len(self.events)

    @property
    def sides(self) -> Float[np.ndarray, "side"]:
        """For each body of a contact: on which end of the normal it is, -1 or 1."""
        return np.array([-1.0, 1.0])[: 2 if self.kind is RolloutEventKind.COLLISION else 1]

    @property
    def bodies(self) -> Int[np.ndarray, "contact side"]:
        """The bodies."""
        return np.stack([self.events.first, self.events.second], axis=1)[:, : len(self.sides)]

    @property
    def log_speed(self) -> Float[np.ndarray, "contact"]:
        """Logarithms of the approach speeds in m/s."""
        return np.asarray(np.log(np.maximum(self.events.closing_speed, SLOWEST)))

    @cached_property
    def before(self) -> Int[np.ndarray, "contact"]:
        """Last frame before each contact."""
        return np.maximum(np.searchsorted(self.motion.times, self.events.time) - 1, 0)

    @cached_property
    def tangent(self) -> Float[np.ndarray, "contact 2"]:
        """Unit vector to the left of the normal, which points from the first to the second body or to the wall."""
        normal = self.events.normal
        return np.stack([-normal[:, 1], normal[:, 0]], axis=1)

    @cached_property
    def lever(self) -> Float[np.ndarray, "contact side 2"]:
        """From the middle of each of the bodies to the touching point, in m."""
        frame = self.before[:, None]
        since = (self.events.time - self.motion.times[self.before])[:, None, None]
        moved = self.motion.position[frame, self.bodies] + since * self.motion.velocity[frame, self.bodies]
        return self.events.point[:, None] - moved

    @cached_property
    def slip(self) -> Float[np.ndarray, "contact"]:
        """Speed in m/s of the second touching point past the first body's, along the tangent, before the contact."""
        frame = self.before[:, None]
        spin = self.motion.spin[frame, self.bodies]
        turning = spin[..., None] * np.stack([-self.lever[..., 1], self.lever[..., 0]], axis=-1)
        surface = self.motion.velocity[frame, self.bodies] + turning
        return ((self.sides @ surface) * self.tangent).sum(axis=1)

    @cached_property
    def rubbing(self) -> Float[np.ndarray, "contact"]:
        """Direction along the tangent, 1 or -1, of the impulse of rubbing; near 0 where nothing slips."""
        return -self.slip / np.hypot(self.slip, CREEP)

    @cached_property
    def common_mass(self) -> Float[np.ndarray, "contact"]:
        """Reduced mass of the bodies in kg."""
        return np.asarray(1 / (1 / self.motion.mass[self.bodies]).sum(axis=1))

    @cached_property
    def stopping(self) -> Float[np.ndarray, "contact"]:
        """Normal impulse (kg m/s) that ends the approach."""
        turning = (
            self.lever[..., 0] * self.events.normal[:, None, 1] - self.lever[..., 1] * self.events.normal[:, None, 0]
        )
        per_impulse = (1 / self.motion.mass[self.bodies] + turning**2 / self.motion.inertia[self.bodies]).sum(axis=1)
        return self.events.closing_speed / per_impulse

    @property
    def bounce(self) -> Float[np.ndarray, "contact"]:
        """Part of the normal impulse (kg m/s) that restitution adds to what ends the approach."""
        return np.maximum(self.events.impulse - self.stopping, 0.0)

    def pushed_apart(
        self, impulse: Float[np.ndarray, "contact 2 column"], *, moving: bool = True
    ) -> Float[np.ndarray, "time body 3 column"]:
        """Changes of what is measured by impulses (kg m/s) on the second body or wall, their opposites on the first.

        Parameters
        ----------
        impulse
            The impulses.
        moving
            Whether velocities change; spins do in any case.
        """
        both = self.sides[:, None, None] * impulse[:, None]
        mass, inertia = self.motion.mass[self.bodies], self.motion.inertia[self.bodies]
        lever = self.lever[..., None]
        torque = lever[:, :, 0] * both[:, :, 1] - lever[:, :, 1] * both[:, :, 0]
        changes = np.zeros((*self.bodies.shape, 3, impulse.shape[-1]))
        changes[:, :, :2] = moving * both / mass[..., None, None]
        changes[:, :, 2] = torque / inertia[..., None]
        return self._kicked(changes)

    def pushed_together(
        self, directions: Sequence[Float[np.ndarray, "contact 2"]]
    ) -> Float[np.ndarray, "time body 3 column"]:
        """Changes of what is measured if all bodies leave a contact by 1 m/s faster along each of some directions."""
        count = len(self)
        changes = np.zeros((*self.bodies.shape, 3, len(directions), count))
        for place, direction in enumerate(directions):
            changes[np.arange(count), :, :2, place, np.arange(count)] = direction[:, None]
        return self._kicked(changes.reshape(*self.bodies.shape, 3, len(directions) * count))

    def pushed_anyhow(self) -> Float[np.ndarray, "time body 3 column"]:
        """Changes of what is measured by kicks of all bodies along x and along y, each by itself."""
        return self.motion.kicked(Kicks.single(self._times, self.bodies.ravel()))

    def lasting(self, durations: Float[np.ndarray, "contact column"]) -> Float[np.ndarray, "time body 3 column"]:
        """Changes of what is measured where contacts last, so that bodies yield and push back meanwhile.

        A spring of no friction takes half of the duration to end the approach and the other half to part the bodies,
        which is as if they met at once, and half of the duration later: each body is displaced by that time and by
        what its velocity changes, the way it came. Source: collinear collision with a linear spring (W. J. Stronge,
        Impact Mechanics, 2nd ed., section 2.2).

        Parameters
        ----------
        durations
            How long each contact lasts, in s.
        """
        change = self.sides[:, None] * (self.events.impulse[:, None] * self.events.normal)[:, None]
        velocity = change / self.motion.mass[self.bodies][..., None]
        moves = np.zeros((*self.bodies.shape, 3, durations.shape[1]))
        moves[:, :, :2] = -velocity[..., None] * durations[:, None, None] / 2
        flat = moves.reshape(self.bodies.size, 3, durations.shape[1])
        return self.motion.kicked(Kicks(self._times, self.bodies.ravel(), np.zeros_like(flat), flat))

    def _kicked(self, changes: Float[np.ndarray, "contact side 3 column"]) -> Float[np.ndarray, "time body 3 column"]:
        flat = changes.reshape(self.bodies.size, 3, changes.shape[-1])
        return self.motion.kicked(Kicks(self._times, self.bodies.ravel(), flat))

    @property
    def _times(self) -> Float[np.ndarray, "kick"]:
        """Time in s at which each body of each contact is in touch."""
        return np.repeat(self.events.time, len(self.sides))

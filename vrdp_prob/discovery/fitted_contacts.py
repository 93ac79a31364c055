"""The contacts between bodies that a fit believes in: where, how fast, and how anything that acts there would show."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from vrdp_prob.discovery.fitted_motion import FittedMotion, Kicks
from vrdp_prob.models.simulator.events import EventTable, RolloutEventKind
from vrdp_prob.scene import Shape

CREEP = 0.02
"""Slip in m/s below which the direction of rubbing is smoothed."""


@dataclass(frozen=True)
class FittedContacts:
    """Contacts between two bodies of one video.

    Parameters
    ----------
    motion
        The motion.
    events
        The contacts.
    """

    motion: FittedMotion
    events: EventTable

    @classmethod
    def of(cls, motion: FittedMotion) -> "FittedContacts":
        """The contacts of a motion."""
        return cls(motion, motion.events.of_kind(RolloutEventKind.COLLISION))

    def where(self, keep: Bool[np.ndarray, "contact"]) -> "FittedContacts":
        """Some of the contacts."""
        return FittedContacts(self.motion, self.events.where(keep))

    @property
    def known_normal(self) -> Bool[np.ndarray, "contact"]:
        """Whether the direction of the normal is known by where the bodies are, and how they are turned."""
        cubes = np.array([body.shape is Shape.CUBE for body in self.motion.tracks.bodies])
        return ~cubes[self.bodies].any(axis=1) | (self.motion.tracks.angles is not None)

    def __len__(self) -> int:
        return len(self.events)

    @property
    def bodies(self) -> Int[np.ndarray, "contact 2"]:
        """The two bodies."""
        return np.stack([self.events.first, self.events.second], axis=1)

    @cached_property
    def before(self) -> Int[np.ndarray, "contact"]:
        """Last frame before each contact."""
        return np.maximum(np.searchsorted(self.motion.times, self.events.time) - 1, 0)

    @cached_property
    def tangent(self) -> Float[np.ndarray, "contact 2"]:
        """Unit vector to the left of the normal from the first to the second body."""
        normal = self.events.normal
        return np.stack([-normal[:, 1], normal[:, 0]], axis=1)

    @cached_property
    def lever(self) -> Float[np.ndarray, "contact 2 2"]:
        """From the middle of each of the two bodies to the touching point, in m."""
        frame = self.before[:, None]
        since = (self.events.time - self.motion.times[self.before])[:, None, None]
        moved = self.motion.position[frame, self.bodies] + since * self.motion.velocity[frame, self.bodies]
        return self.events.point[:, None] - moved

    @cached_property
    def slip(self) -> Float[np.ndarray, "contact"]:
        """Speed in m/s of the second body's touching point past the first's, along the tangent, before the contact."""
        frame = self.before[:, None]
        spin = self.motion.spin[frame, self.bodies]
        turning = spin[..., None] * np.stack([-self.lever[..., 1], self.lever[..., 0]], axis=-1)
        surface = self.motion.velocity[frame, self.bodies] + turning
        return ((surface[:, 1] - surface[:, 0]) * self.tangent).sum(axis=1)

    @cached_property
    def rubbing(self) -> Float[np.ndarray, "contact"]:
        """Direction along the tangent, 1 or -1, in which rubbing pushes the second body; near 0 where nothing slips."""
        return -self.slip / np.hypot(self.slip, CREEP)

    @cached_property
    def common_mass(self) -> Float[np.ndarray, "contact"]:
        """Reduced mass of the two bodies in kg."""
        first, second = self.motion.mass[self.bodies].T
        return first * second / (first + second)

    def pushed_apart(
        self, impulse: Float[np.ndarray, "contact 2 column"], *, moving: bool = True, turning: bool = True
    ) -> Float[np.ndarray, "time body 3 column"]:
        """Changes of what is measured by impulses (kg m/s) on the second body, and their opposites on the first.

        Parameters
        ----------
        impulse
            The impulses.
        moving, turning
            Whether velocities, and whether spins change.
        """
        both = np.stack([-impulse, impulse], axis=1)
        mass, inertia = self.motion.mass[self.bodies], self.motion.inertia[self.bodies]
        lever = self.lever[..., None]
        torque = lever[:, :, 0] * both[:, :, 1] - lever[:, :, 1] * both[:, :, 0]
        changes = np.zeros((len(self), 2, 3, impulse.shape[-1]))
        changes[:, :, :2] = moving * both / mass[..., None, None]
        changes[:, :, 2] = turning * torque / inertia[..., None]
        return self._kicked(changes)

    def pushed_together(
        self, directions: Sequence[Float[np.ndarray, "contact 2"]]
    ) -> Float[np.ndarray, "time body 3 column"]:
        """Changes of what is measured if both bodies leave a contact by 1 m/s faster along each of some directions."""
        count = len(self)
        changes = np.zeros((count, 2, 3, len(directions), count))
        for place, direction in enumerate(directions):
            changes[np.arange(count), :, :2, place, np.arange(count)] = direction[:, None]
        return self._kicked(changes.reshape(count, 2, 3, len(directions) * count))

    def pushed_anyhow(self) -> Float[np.ndarray, "time body 3 column"]:
        """Changes of what is measured by kicks of both bodies along x and along y, each by itself."""
        return self.motion.kicked(Kicks.single(np.repeat(self.events.time, 2), self.bodies.ravel()))

    def _kicked(self, changes: Float[np.ndarray, "contact 2 3 column"]) -> Float[np.ndarray, "time body 3 column"]:
        flat = changes.reshape(2 * len(self), 3, changes.shape[-1])
        return self.motion.kicked(Kicks(np.repeat(self.events.time, 2), self.bodies.ravel(), flat))

"""A change of one object as every draw has it: each draw takes one of the meanings of its word."""

from dataclasses import replace
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Bool, Float, Int

from vrdp_prob.models.effects.body_friction import FRICTION_RATIO
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.reasoning.chance import Random
from vrdp_prob.reasoning.changes import Change, PhysicalParameter
from vrdp_prob.reasoning.facts import MOVING_SPEED

MASS, RESTITUTION, FRICTION, SPEED = PhysicalParameter


def drawn_meanings(change: Change, draws: int, numbers: Random) -> Int[np.ndarray, "draw"]:
    """Which of the meanings of its word each of some draws takes."""
    if not change.is_uncertain:
        return np.zeros(draws, dtype=int)
    probabilities = np.array([meaning.probability for meaning in change.meanings])
    return numbers.choice(np.arange(len(probabilities)), draws, p=probabilities)


class Intervention:
    """A change of one body, in all draws.

    A changed speed is felt from the release on, a changed restitution from the first contact, and a changed friction,
    or a mass that a body's path follows, from the release of a body that moves, else from the first contact.

    Parameters
    ----------
    change, body
        What is done, to which body.
    worlds
        The draws before it.
    taken
        Which of the meanings of its word each draw takes.
    path_follows_mass
        Whether a body moves otherwise with another mass before it touches anything.
    """

    def __init__(
        self,
        change: Change,
        body: int,
        worlds: Worlds,
        taken: Int[np.ndarray, "draw"],
        *,
        path_follows_mass: bool = False,
    ) -> None:
        self.change, self.body, self._before, self._taken = change, body, worlds, taken
        self._path_follows_mass = path_follows_mass

    @cached_property
    def worlds(self) -> Worlds:
        """The draws with the changed mass, restitution and friction."""
        mass, bounce = self._constants(self.body)
        worlds = self._before.with_mass_factor(self.body, torch.from_numpy(self._shifted(MASS, mass) / mass))
        restitution = worlds.restitution.clone()
        restitution[:, self.body] = torch.from_numpy(self._shifted(RESTITUTION, bounce))
        return replace(worlds, restitution=restitution, parameters=self._parameters())

    @property
    def leaves_there(self) -> Bool[np.ndarray, "draw body"]:
        """Which bodies are there after it."""
        there = np.ones(self._before.mass.shape, dtype=bool)
        there[:, self.body] = not self.change.removes
        return there

    @property
    def felt_at_release(self) -> Bool[np.ndarray, "draw"]:
        """Draws in which the course of a moving body differs from its release on."""
        felt = self._changes(SPEED) | self._changes(FRICTION)
        return felt | self._changes(MASS) if self._path_follows_mass else felt

    @property
    def felt_at_contact(self) -> Bool[np.ndarray, "draw"]:
        """Draws in which the course of the body differs at the latest from its first contact on."""
        return self._changes(MASS) | self._changes(RESTITUTION) | self._changes(FRICTION)

    def released(
        self, velocity: Float[np.ndarray, "draw 2"]
    ) -> tuple[Float[np.ndarray, "draw 2"], Bool[np.ndarray, "draw"]]:
        """Velocity of the body at its release, in m/s, after the change, and draws in which it feels the change there.

        A body at rest feels nothing until it is hit, and keeps its velocity.
        """
        speed = np.linalg.norm(velocity, axis=1)
        felt = self.felt_at_release & (speed > MOVING_SPEED)
        after = velocity * (self._shifted(SPEED, speed) / np.maximum(speed, np.finfo(float).tiny))[:, None]
        return np.where(felt[:, None], after, velocity), felt

    def impulse_ratio(self, partner: int) -> Float[np.ndarray, "draw"]:
        """Impulse of a contact with another body over what it was: as (1 + e) m1 m2 / (m1 + m2) changes."""
        (mass, bounce), (other, other_bounce) = self._constants(self.body), self._constants(partner)
        changed = self._shifted(MASS, mass)
        reduced = changed * (mass + other) / (mass * (changed + other))
        return reduced * (1 + self._shifted(RESTITUTION, bounce) * other_bounce) / (1 + bounce * other_bounce)

    def _constants(self, body: int) -> tuple[Float[np.ndarray, "draw"], Float[np.ndarray, "draw"]]:
        """Mass (kg) and restitution factor of a body before the change."""
        return self._before.mass[:, body].detach().numpy(), self._before.restitution[:, body].detach().numpy()

    def _parameters(self) -> dict[str, torch.Tensor]:
        parameters = dict(self._before.parameters)
        # without dry friction there is none to change
        if self._changes(FRICTION).any() and FRICTION_RATIO.name in parameters:
            ratio = parameters[FRICTION_RATIO.name].clone()
            ratio[:, self.body] = torch.from_numpy(self._shifted(FRICTION, ratio[:, self.body].detach().numpy()))
            parameters[FRICTION_RATIO.name] = ratio
        return parameters

    def _changes(self, parameter: PhysicalParameter) -> Bool[np.ndarray, "draw"]:
        """Draws whose meaning changes a parameter."""
        of_it = [meaning.shift is not None and meaning.shift.parameter is parameter for meaning in self.change.meanings]
        return np.array([*of_it, False], dtype=bool)[self._taken if of_it else np.full(len(self._taken), -1)]

    def _shifted(self, parameter: PhysicalParameter, values: Float[np.ndarray, "draw"]) -> Float[np.ndarray, "draw"]:
        """Values of a parameter of the body after the change."""
        shifted = values.copy()
        for place in np.unique(self._taken[self._changes(parameter)]).tolist():
            shift, own = self.change.meanings[place].shift, self._taken == place
            shifted[own] = values[own] if shift is None else shift.of(values[own])
        return shifted

"""Scenes of the benchmark of the simulator, and the log density that is measured on them."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from vrdp_prob.models.effects.contact_friction import ContactFriction
from vrdp_prob.models.effects.linear_drag import LinearDrag
from vrdp_prob.models.effects.slip_to_roll import SlipToRoll
from vrdp_prob.models.parameters import Scope
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.events import RolloutEventKind
from vrdp_prob.models.simulator.rollout import simulate
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.scene import Shape

FRAMES = torch.arange(128, dtype=torch.float64) * 0.04
DISCS = (Shape.CYLINDER, Shape.SPHERE, Shape.CYLINDER, Shape.SPHERE, Shape.CYLINDER)
MIXED = (Shape.CUBE, Shape.SPHERE, Shape.CYLINDER, Shape.CUBE, Shape.SPHERE)
NOISE = 0.01
"""Standard deviation in m of the errors of all positions."""
LEAVES = ("position", "velocity", "mass", "restitution")
"""What the log density is differentiated by."""
BASE = PhysicsModel.base()
EXTENDED = BASE.with_effect(ContactFriction()).with_effect(LinearDrag()).with_effect(SlipToRoll())
PARAMETERS = {"sliding_friction": 0.1, "rolling_resistance": 0.03, "air_drag": 0.02, "angular_drag": 1.0}
"""Values of the shared parameters; others have their defaults."""


def scenes(count: int, shapes: Sequence[Shape], model: PhysicsModel = BASE, seed: int = 0) -> Worlds:
    """Bodies around a centre that they move to."""
    generator = np.random.default_rng(seed)
    position = _apart(generator, count, len(shapes))
    velocity = -position * generator.uniform(0.4, 1.2, (count, len(shapes), 1))
    return _worlds(generator, tuple(shapes), position, velocity + generator.normal(0, 0.4, position.shape), model)


def crowd(count: int, shapes: Sequence[Shape], seed: int = 0) -> Worlds:
    """Bodies that move in all directions, as many per area and as fast whatever their number."""
    generator = np.random.default_rng(seed)
    position = _apart(generator, count, len(shapes))
    return _worlds(generator, tuple(shapes), position, generator.normal(0, 0.8, position.shape), BASE)


def _apart(generator: np.random.Generator, count: int, bodies: int) -> np.ndarray:
    side = 1.8 * np.sqrt(bodies / 5)
    position = np.zeros((count, bodies, 2))
    for world in range(count):
        placed = 0
        while placed < bodies:
            candidate = generator.uniform(-side, side, 2)
            if (np.hypot(*(candidate - position[world, :placed]).T) > 0.6).all():
                position[world, placed] = candidate
                placed += 1
    return position


def _worlds(
    generator: np.random.Generator,
    shapes: tuple[Shape, ...],
    position: np.ndarray,
    velocity: np.ndarray,
    model: PhysicsModel,
) -> Worlds:
    count, bodies = position.shape[:2]
    tensor = torch.from_numpy
    one = torch.ones(count, bodies, dtype=torch.float64)
    return Worlds(
        shapes=shapes,
        position=tensor(position),
        velocity=tensor(velocity),
        angle=tensor(generator.uniform(0, 6, (count, bodies))),
        spin=tensor(generator.normal(0, 1, (count, bodies))),
        release_time=0 * one,
        mass=tensor(generator.lognormal(0, 0.5, (count, bodies))),
        restitution=tensor(generator.uniform(0.6, 1, (count, bodies))),
        radius=0.2 * one,
        present=torch.ones(count, bodies, dtype=torch.bool),
        parameters={
            parameter.name: PARAMETERS.get(parameter.name, parameter.default)
            * (one if parameter.scope is Scope.BODY else one[:, 0])
            for parameter in model.parameters
            if parameter.name not in LEAVES
        },
    )


def positions_of(model: PhysicsModel = BASE) -> Callable[[Worlds], Tensor]:
    """Positions [world, time, body, 2] in m by the simulator under test."""
    return lambda worlds: simulate(worlds, FRAMES, model).trajectory[..., :2]


def gradient_of(worlds: Worlds, positions: Callable[[Worlds], Tensor], seen: Tensor) -> dict[str, Tensor]:
    """Derivative of the log density by `LEAVES`, where `positions` simulates."""
    leaves = {name: getattr(worlds, name).clone().requires_grad_() for name in LEAVES}
    torch.autograd.backward((-0.5 * ((positions(replace(worlds, **leaves)) - seen) / NOISE) ** 2).sum())
    return {name: leaf.grad for name, leaf in leaves.items() if leaf.grad is not None}


def contacts_per_world(worlds: Worlds, model: PhysicsModel = BASE) -> float:
    """Mean number of contacts in the frames."""
    return len(simulate(worlds, FRAMES, model).events.of_kind(RolloutEventKind.COLLISION)) / len(worlds)

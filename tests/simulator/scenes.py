"""Worlds for the tests."""

from collections.abc import Mapping, Sequence

import numpy as np
import torch
from torch import Tensor

from vrdp_prob.models.simulator.rollout import Rollout, simulate
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.scene import Shape

DISC, SPHERE, CUBE = Shape.CYLINDER, Shape.SPHERE, Shape.CUBE
FRICTIONLESS = {"sliding_friction": 0.0, "rolling_resistance": 0.0, "air_drag": 0.0, "angular_drag": 0.0}
RADIUS = 0.2
FRAMES = torch.arange(128, dtype=torch.float64) * 0.04


def tensor(values: object) -> Tensor:
    return torch.as_tensor(values, dtype=torch.float64)


def world(
    position: Sequence[Sequence[float]],
    velocity: Sequence[Sequence[float]],
    shapes: Sequence[Shape] | None = None,
    parameters: Mapping[str, float | Sequence[float]] | None = None,
    **fields: object,
) -> Worlds:
    """One world; every field may be given per body."""
    count = len(position)
    defaults: dict[str, object] = {
        "angle": [0.0] * count,
        "spin": [0.0] * count,
        "release_time": [0.0] * count,
        "mass": [1.0] * count,
        "restitution": [1.0] * count,
        "radius": [RADIUS] * count,
    }
    walls = tensor(fields.pop("walls", np.zeros((0, 4))))
    wall_restitution = tensor([fields.pop("wall_restitution", [1.0] * len(walls))])
    per_body = {name: tensor([fields.pop(name, value)]) for name, value in defaults.items()}
    return Worlds(
        shapes=tuple(shapes) if shapes else (DISC,) * count,
        position=tensor([position]),
        velocity=tensor([velocity]),
        present=torch.ones(1, count, dtype=torch.bool),
        parameters={name: tensor([value]) for name, value in {**FRICTIONLESS, **(parameters or {})}.items()},
        walls=walls,
        wall_restitution=wall_restitution,
        **per_body,
        **fields,
    )


def random_worlds(count: int, shapes: Sequence[Shape], seed: int, *, walls: bool = True) -> Worlds:
    """Scenes as in CLEVRER: bodies around a centre that they move to, all shapes apart at the start."""
    generator = np.random.default_rng(seed)
    bodies = len(shapes)
    position = np.zeros((count, bodies, 2))
    for index in range(count):
        placed = 0
        while placed < bodies:
            candidate = generator.uniform(-1.8, 1.8, 2)
            if all(np.hypot(*(candidate - other)) > 0.62 for other in position[index, :placed]):
                position[index, placed] = candidate
                placed += 1
    inwards = -position * generator.uniform(0.4, 1.4, (count, bodies, 1))
    ranges = {
        "sliding_friction": (0.02, 0.2),
        "rolling_resistance": (0.01, 0.05),
        "air_drag": (0.005, 0.05),
        "angular_drag": (0.5, 2.0),
    }
    lines = [[-2.2, -2.2, 2.2, -2.3], [2.2, -2.3, 2.4, 2.2]] if walls else np.zeros((0, 4))
    return Worlds(
        shapes=tuple(shapes),
        position=tensor(position),
        velocity=tensor(inwards + generator.normal(0, 0.4, (count, bodies, 2))),
        angle=tensor(generator.uniform(0, 6, (count, bodies))),
        spin=tensor(generator.normal(0, 1.5, (count, bodies))),
        release_time=torch.zeros(count, bodies, dtype=torch.float64),
        mass=tensor(generator.lognormal(0, 0.5, (count, bodies))),
        restitution=tensor(generator.uniform(0.55, 1, (count, bodies))),
        radius=tensor(generator.uniform(0.18, 0.22, (count, bodies))),
        present=torch.ones(count, bodies, dtype=torch.bool),
        parameters={name: tensor(generator.uniform(*limits, count)) for name, limits in ranges.items()},
        walls=tensor(lines),
        wall_restitution=tensor(np.full((count, len(lines)), 0.8)),
    )


def at(worlds: Worlds, time: float, **options: object) -> Rollout:
    """Rollout to the start and one time."""
    return simulate(worlds, tensor([0.0, time]), **options)


def energy(worlds: Worlds, rollout: Rollout) -> Tensor:
    """Kinetic energy [world, time] in J."""
    velocity = rollout.velocity
    moving = worlds.mass[:, None] * (velocity[..., :2] ** 2).sum(-1)
    turning = worlds.moment_of_inertia[:, None] * velocity[..., 2] ** 2
    return ((moving + turning) * rollout.exists).sum(-1) / 2

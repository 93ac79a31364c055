"""Compare simulated worlds with the independent reference."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch

from tests.simulator import reference
from tests.simulator.scenes import random_worlds, tensor
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.events import EventTable, RolloutEventKind
from vrdp_prob.models.simulator.rollout import simulate
from vrdp_prob.models.simulator.worlds import Worlds

SAME_TIME = 1e-6
"""Difference in s up to which two contacts are the same one."""
LINES = [[-2.2, -2.2, 2.2, -2.3], [2.2, -2.3, 2.4, 2.2], [-2.5, 0.3, -2.1, 0.9]]
"""Two cushions and a short wall whose ends can be hit."""


@dataclass(frozen=True)
class Comparison:
    """What was found in some scenes: deviations in m (angles times radius), contacts, and how much doubts cut off.

    `compared` counts scenes by the share of their time before the first event in doubt, `cut` those that have one.
    """

    scenes: int = 0
    farthest: float = 0.0
    contacts: int = 0
    missed: int = 0
    invented: int = 0
    latest: float = 0.0
    cut: int = 0
    compared: float = 0.0

    def __add__(self, other: "Comparison") -> "Comparison":
        names = ("scenes", "contacts", "missed", "invented", "cut", "compared")
        return Comparison(
            **{name: getattr(self, name) + getattr(other, name) for name in names},
            farthest=max(self.farthest, other.farthest),
            latest=max(self.latest, other.latest),
        )

    def __str__(self) -> str:
        return (
            f"{self.scenes} scenes, {self.contacts} contacts, {self.missed} missed, {self.invented} invented; farthest "
            f"deviation {self.farthest:.1e} m, of the time of a contact {self.latest:.1e} s; {self.cut} scenes have an "
            f"event in doubt, {self.compared / max(self.scenes, 1):.0%} of the time is before it"
        )


def scene_of(worlds: Worlds, index: int) -> reference.Scene:
    """One world as plain numbers."""
    of_body = {name: values[index].numpy() for name, values in worlds.parameters.items() if values.ndim == 2}
    fields = ("position", "velocity", "angle", "spin", "release_time", "mass", "restitution", "radius")
    return reference.Scene(
        shapes=tuple(shape.value for shape in worlds.shapes),
        **{name: getattr(worlds, name)[index].numpy() for name in fields},
        parameters={name: float(values[index]) for name, values in worlds.parameters.items() if values.ndim == 1},
        rolling_share=np.stack(
            [of_body.get(name, np.zeros(len(worlds.shapes))) for name in ("release_rolling", "release_rolling_across")],
            axis=-1,
        ),
        walls=worlds.walls.numpy(),
        wall_restitution=worlds.restitution_of_walls[index].numpy(),
    )


def compare(
    worlds: Worlds, times: torch.Tensor, model: PhysicsModel | None = None, *, closed: bool = False
) -> Comparison:
    """Simulate worlds and compare each with the reference until its first event in doubt."""
    rollout = simulate(worlds, times, model)
    total = Comparison()
    for index in range(len(worlds)):
        expected = reference.rollout(scene_of(worlds, index), times.numpy(), closed=closed)
        until = expected.doubtful_from - SAME_TIME
        states = rollout.trajectory[index].detach().numpy()[times.numpy() < until]
        deviation = np.abs(states - expected.states[: len(states), :, :3])
        deviation[..., 2] *= worlds.radius[index].numpy()
        events = rollout.events.of_world(index)
        total += replace(
            _contacts(events.where(events.time < until), expected, len(worlds.shapes), until),
            scenes=1,
            farthest=float(deviation.max(initial=0.0)),
            cut=int(until < times[-1]),
            compared=len(states) / len(times),
        )
    return total


def _contacts(events: EventTable, expected: reference.Result, bodies: int, until: float) -> Comparison:
    """Match two lists of contacts; each of one list has at most one of the other."""
    wall = events.kind == RolloutEventKind.WALL
    keep = wall | (events.kind == RolloutEventKind.COLLISION)
    second = np.where(wall, events.second + bodies, events.second)
    found = list(zip(events.first[keep], second[keep], events.time[keep], strict=True))
    missed, contacts, latest = 0, 0, 0.0
    for one in expected.contacts:
        if one.time >= until:
            continue
        contacts += 1
        match = [
            index
            for index, (first, other, time) in enumerate(found)
            if (first, other) == (one.first, one.second) and abs(time - one.time) < SAME_TIME
        ]
        if match:
            latest = max(latest, float(abs(found.pop(match[0])[2] - one.time)))
        else:
            missed += 1
    return Comparison(contacts=contacts, missed=missed, invented=len(found), latest=latest)


def scenes(count: int, shapes: Sequence[object], seed: int, *, walls: bool = True, late: bool = False) -> Worlds:
    """Random scenes with walls whose ends can be hit; `late` releases the last body within the first second."""
    worlds = random_worlds(count, tuple(shapes), seed, walls=False)
    if walls:
        worlds = replace(worlds, walls=tensor(LINES), wall_restitution=tensor(np.full((count, len(LINES)), 0.8)))
    if late:
        release = torch.zeros_like(worlds.release_time)
        release[:, -1] = tensor(np.random.default_rng(seed + 1).uniform(0, 1, count))
        worlds = worlds.released_at(release)
    return worlds

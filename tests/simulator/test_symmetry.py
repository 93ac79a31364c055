"""Mirrored, rotated and shifted scenes give mirrored, rotated and shifted motion."""

from dataclasses import replace

import pytest
import torch

from tests.simulator.scenes import CUBE, DISC, FRAMES, SPHERE, random_worlds, tensor
from vrdp_prob.models.simulator.rollout import simulate
from vrdp_prob.models.simulator.worlds import Worlds

TIMES = FRAMES[:40]
TOLERANCE = 1e-8


def _scene(seed: int) -> Worlds:
    return random_worlds(8, (CUBE, DISC, SPHERE, CUBE), seed)


def _turned(points: torch.Tensor, angle: float) -> torch.Tensor:
    cosine, sine = torch.cos(tensor(angle)), torch.sin(tensor(angle))
    return points @ torch.stack([torch.stack([cosine, sine]), torch.stack([-sine, cosine])])


@pytest.mark.parametrize("seed", [1, 2])
def test_mirror(seed: int) -> None:
    worlds = _scene(seed)
    flip = tensor([1.0, -1.0])
    mirrored = replace(
        worlds,
        position=worlds.position * flip,
        velocity=worlds.velocity * flip,
        angle=-worlds.angle,
        spin=-worlds.spin,
        walls=worlds.walls * flip.repeat(2),
    )
    first, second = simulate(worlds, TIMES), simulate(mirrored, TIMES)
    assert torch.allclose(first.trajectory * tensor([1.0, -1, -1]), second.trajectory, atol=TOLERANCE)


@pytest.mark.parametrize("seed", [1, 2])
def test_rotation(seed: int) -> None:
    worlds = _scene(seed)
    angle = 1.1
    turned = replace(
        worlds,
        position=_turned(worlds.position, angle),
        velocity=_turned(worlds.velocity, angle),
        angle=worlds.angle + angle,
        walls=_turned(worlds.walls.reshape(-1, 2), angle).reshape(-1, 4),
    )
    first, second = simulate(worlds, TIMES).trajectory, simulate(turned, TIMES).trajectory
    assert torch.allclose(_turned(first[..., :2], angle), second[..., :2], atol=TOLERANCE)
    assert torch.allclose(first[..., 2] + angle, second[..., 2], atol=TOLERANCE)


@pytest.mark.parametrize("seed", [1, 2])
def test_time_shift(seed: int) -> None:
    worlds = _scene(seed)
    shifted = worlds.released_at(worlds.release_time + 7.25)
    first, second = simulate(worlds, TIMES), simulate(shifted, TIMES + 7.25)
    assert torch.allclose(first.trajectory, second.trajectory, atol=TOLERANCE)


def test_order_of_bodies_does_not_matter() -> None:
    worlds = _scene(3)
    order = [2, 0, 3, 1]
    fields = ("position", "velocity", "angle", "spin", "release_time", "mass", "restitution", "radius", "present")
    other = replace(
        worlds,
        shapes=tuple(worlds.shapes[index] for index in order),
        **{name: getattr(worlds, name)[:, order] for name in fields},
    )
    first, second = simulate(worlds, TIMES), simulate(other, TIMES)
    assert torch.allclose(first.trajectory[:, :, order], second.trajectory, atol=TOLERANCE)


def test_a_world_does_not_depend_on_its_batch() -> None:
    worlds = _scene(4)
    together, alone = simulate(worlds, TIMES), simulate(worlds.select([5]), TIMES)
    assert torch.equal(together.trajectory[5:6], alone.trajectory)

"""Mirrored, rotated and shifted scenes give mirrored, rotated and shifted motion."""

from dataclasses import replace

import pytest
import torch

from tests.simulator.scenes import CUBE, DISC, FRAMES, SPHERE, random_worlds, tensor
from tests.simulator.test_reference import MODELS, random_strengths
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.rollout import simulate
from vrdp_prob.models.simulator.worlds import Worlds

TIMES = FRAMES[:40]
TOLERANCE = 1e-8
EACH_MODEL = pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)


def _scene(seed: int, model: PhysicsModel) -> Worlds:
    return random_strengths(random_worlds(8, (CUBE, DISC, SPHERE, CUBE), seed), model, seed)


def _downhill(worlds: Worlds, tilt: torch.Tensor) -> Worlds:
    """The worlds with another tilt, where they have one."""
    if "tilt_x" not in worlds.parameters:
        return worlds
    return replace(worlds, parameters={**worlds.parameters, "tilt_x": tilt[:, 0], "tilt_y": tilt[:, 1]})


def _tilt(worlds: Worlds) -> torch.Tensor:
    none = torch.zeros(len(worlds), dtype=torch.float64)
    return torch.stack([worlds.parameters.get(name, none) for name in ("tilt_x", "tilt_y")], dim=-1)


def _turned(points: torch.Tensor, angle: float) -> torch.Tensor:
    cosine, sine = torch.cos(tensor(angle)), torch.sin(tensor(angle))
    return points @ torch.stack([torch.stack([cosine, sine]), torch.stack([-sine, cosine])])


@EACH_MODEL
@pytest.mark.parametrize("seed", [1, 2])
def test_mirror(seed: int, model: PhysicsModel) -> None:
    worlds = _scene(seed, model)
    flip = tensor([1.0, -1.0])
    mirrored = replace(
        worlds,
        position=worlds.position * flip,
        velocity=worlds.velocity * flip,
        angle=-worlds.angle,
        spin=-worlds.spin,
        walls=worlds.walls * flip.repeat(2),
    )
    mirrored = _downhill(mirrored, _tilt(worlds) * flip)
    if "release_rolling_across" in worlds.parameters:
        across = {"release_rolling_across": -worlds.parameters["release_rolling_across"]}
        mirrored = replace(mirrored, parameters={**mirrored.parameters, **across})
    first, second = simulate(worlds, TIMES, model), simulate(mirrored, TIMES, model)
    assert torch.allclose(first.trajectory * tensor([1.0, -1, -1]), second.trajectory, atol=TOLERANCE)


@EACH_MODEL
@pytest.mark.parametrize("seed", [1, 2])
def test_rotation(seed: int, model: PhysicsModel) -> None:
    worlds = _scene(seed, model)
    angle = 1.1
    turned = replace(
        worlds,
        position=_turned(worlds.position, angle),
        velocity=_turned(worlds.velocity, angle),
        angle=worlds.angle + angle,
        walls=_turned(worlds.walls.reshape(-1, 2), angle).reshape(-1, 4),
    )
    turned = _downhill(turned, _turned(_tilt(worlds), angle))
    first, second = simulate(worlds, TIMES, model).trajectory, simulate(turned, TIMES, model).trajectory
    assert torch.allclose(_turned(first[..., :2], angle), second[..., :2], atol=TOLERANCE)
    assert torch.allclose(first[..., 2] + angle, second[..., 2], atol=TOLERANCE)


@EACH_MODEL
@pytest.mark.parametrize("seed", [1, 2])
def test_time_shift(seed: int, model: PhysicsModel) -> None:
    worlds = _scene(seed, model)
    shifted = worlds.released_at(worlds.release_time + 7.25)
    first, second = simulate(worlds, TIMES, model), simulate(shifted, TIMES + 7.25, model)
    assert torch.allclose(first.trajectory, second.trajectory, atol=TOLERANCE)


@EACH_MODEL
def test_order_of_bodies_does_not_matter(model: PhysicsModel) -> None:
    worlds = _scene(3, model)
    order = [2, 0, 3, 1]
    fields = ("position", "velocity", "angle", "spin", "release_time", "mass", "restitution", "radius", "present")
    other = replace(
        worlds,
        shapes=tuple(worlds.shapes[index] for index in order),
        **{name: getattr(worlds, name)[:, order] for name in fields},
        parameters={
            name: values[:, order] if values.ndim == 2 else values for name, values in worlds.parameters.items()
        },
    )
    first, second = simulate(worlds, TIMES, model), simulate(other, TIMES, model)
    assert torch.allclose(first.trajectory[:, :, order], second.trajectory, atol=TOLERANCE)


@EACH_MODEL
def test_a_world_does_not_depend_on_its_batch(model: PhysicsModel) -> None:
    worlds = _scene(4, model)
    together, alone = simulate(worlds, TIMES, model), simulate(worlds.select([5]), TIMES, model)
    assert torch.equal(together.trajectory[5:6], alone.trajectory)

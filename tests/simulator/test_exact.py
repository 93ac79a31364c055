"""Scenes whose motion is known in closed form."""

import math

import pytest
import torch

from tests.simulator.scenes import CUBE, RADIUS, SPHERE, at, tensor, world
from vrdp_prob.models.simulator.events import RolloutEventKind
from vrdp_prob.models.simulator.outcome import Outcome


def test_two_equal_discs_exchange_their_velocities() -> None:
    result = at(world([[0, 0], [2, 0]], [[1.5, 0], [0, 0]]), 4.0)
    assert torch.allclose(result.velocity[0, -1, :, 0], tensor([0.0, 1.5]), atol=1e-12)
    contact = 1.6 / 1.5
    assert result.events.time == pytest.approx([contact], abs=1e-10)
    assert torch.allclose(result.trajectory[0, -1, :, 0], tensor([1.6, 2 + 1.5 * (4 - contact)]), atol=1e-10)


def test_a_disc_bounces_off_a_wall() -> None:
    scene = world([[0, 0]], [[1.0, 0.5]], walls=[[1, -5, 1, 5]], wall_restitution=[0.7])
    result = at(scene, 2.0)
    assert torch.allclose(result.velocity[0, -1, 0, :2], tensor([-0.7, 0.5]), atol=1e-12)
    assert torch.allclose(result.trajectory[0, -1, 0, :2], tensor([0.8 - 0.7 * 1.2, 1.0]), atol=1e-10)
    assert result.events.kind.tolist() == [RolloutEventKind.WALL]


@pytest.mark.parametrize(("shape", "name"), [(CUBE, "sliding_friction"), (SPHERE, "rolling_resistance")])
def test_stopping_distance_under_friction(shape: object, name: str) -> None:
    result = at(world([[0, 0]], [[1.2, 0.9]], [shape], {name: 0.07}), 5.0)
    distance = 1.5**2 / (2 * 0.07 * 9.81)
    assert torch.allclose(result.trajectory[0, -1, 0, :2], tensor([0.8, 0.6]) * distance, atol=1e-9)
    assert (result.velocity[0, -1] == 0).all()
    assert result.events.time == pytest.approx([1.5 / (0.07 * 9.81)], abs=1e-9)


def test_stopping_distance_under_friction_and_air_drag() -> None:
    friction, drag = 0.05 * 9.81, 0.3
    result = at(world([[0, 0]], [[2.0, 0.0]], None, {"sliding_friction": 0.05, "air_drag": drag}), 9.0)
    distance = math.log(1 + drag * 4 / friction) / (2 * drag)
    assert result.trajectory[0, -1, 0, 0].item() == pytest.approx(distance, abs=1e-9)


def test_spin_decays_at_a_constant_rate_and_not_past_rest() -> None:
    scene = world([[0, 0]], [[0, 0]], [CUBE], {"angular_drag": 0.5, "sliding_friction": 0.1}, spin=[-2.0])
    result = at(scene, 8.0)
    assert result.trajectory[0, -1, 0, 2].item() == pytest.approx(-4.0, abs=1e-9)
    assert result.velocity[0, -1, 0, 2] == 0


def test_newtons_cradle_of_three() -> None:
    scene = world([[0, 0], [1, 0], [1 + 2 * RADIUS, 0]], [[1.0, 0], [0, 0], [0, 0]])
    result = at(scene, 2.0)
    assert result.outcome == (Outcome.OK,)
    assert torch.allclose(result.velocity[0, -1, :, 0], tensor([0.0, 0.0, 1.0]), atol=1e-12)
    assert torch.allclose(result.trajectory[0, -1, :, 0], tensor([0.6, 1.0, 1.4 + 1.4]), atol=1e-9)


def test_a_corner_hit_turns_the_cube() -> None:
    mass, half, offset, speed = 1.0, 0.2, 0.15, 1.0
    scene = world([[0, 0], [1, offset]], [[0, 0], [-speed, 0]], [CUBE, SPHERE], radius=[half, 1e-3])
    result = at(scene, 1.5)
    inertia = mass * (2 * half) ** 2 / 6
    impulse = 2 * speed / (1 / mass + 1 / mass + offset**2 / inertia)
    assert result.velocity[0, -1, 0].tolist() == pytest.approx([-impulse, 0, impulse * offset / inertia], abs=1e-9)
    assert result.velocity[0, -1, 1, 0].item() == pytest.approx(-speed + impulse, abs=1e-9)


def test_oblique_contact_keeps_the_tangential_velocity() -> None:
    angle = 0.6
    normal = tensor([math.cos(angle), math.sin(angle)])
    tangent = tensor([-math.sin(angle), math.cos(angle)])
    start = -2 * RADIUS * normal - 0.5 * (normal + 0.3 * tangent)
    scene = world([start.tolist(), [0, 0]], [(normal + 0.3 * tangent).tolist(), [0, 0]], restitution=[0.5, 0.8])
    velocity = at(scene, 1.0).velocity[0, -1, :, :2]
    assert torch.allclose(velocity[0], 0.3 * normal + 0.3 * tangent, atol=1e-10)
    assert torch.allclose(velocity[1], 0.7 * normal, atol=1e-10)

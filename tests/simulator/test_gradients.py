"""Derivatives against closed forms."""

from dataclasses import replace

import pytest
import torch

from tests.simulator.differences import Scene
from tests.simulator.scenes import CUBE, RADIUS, SPHERE, tensor, world
from vrdp_prob.models.effects.pair_force import PairForce
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt
from vrdp_prob.models.effects.wind import Wind
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.rollout import simulate

GRAVITY = 9.81


def _leaf(values: object) -> torch.Tensor:
    return tensor(values).requires_grad_()


def test_wall_bounce() -> None:
    x, v, r, t = _leaf([[[0.0, 0.0]]]), _leaf([[[1.3, 0.2]]]), _leaf([[0.7]]), _leaf([0.0, 2.0])
    radius = _leaf([[RADIUS]])
    scene = replace(
        world([[0, 0]], [[0, 0]], walls=[[1, -5, 1, 5]]), position=x, velocity=v, wall_restitution=r, radius=radius
    )
    simulate(scene, t).trajectory[0, -1, 0, 0].backward()
    # x(t) = X - r (x0 + v t - X) with X = 1 - R.
    assert x.grad[0, 0].tolist() == pytest.approx([-0.7, 0.0], abs=1e-9)
    assert v.grad[0, 0].tolist() == pytest.approx([-1.4, 0.0], abs=1e-9)
    assert r.grad.item() == pytest.approx(-(2.6 - 0.8), abs=1e-9)
    assert radius.grad.item() == pytest.approx(-1.7, abs=1e-9)
    assert t.grad.tolist() == pytest.approx([0.0, -0.91], abs=1e-9)


def test_two_discs_that_exchange_velocities() -> None:
    # The published counterexample: engines return (0.75, 0.25, 0.91, 0.08) where (1, 0, 1, 0) is true.
    x, v = _leaf([[[0.0, 0.0], [1.0, 0.0]]]), _leaf([[[1.0, 0.0], [0.0, 0.0]]])
    simulate(replace(world([[0, 0], [0, 0]], [[0, 0], [0, 0]]), position=x, velocity=v), tensor([0.0, 1.5])).trajectory[
        0, -1, 1, 0
    ].backward()
    # The second disc ends where the first would be, one contact distance ahead.
    assert x.grad[0, :, 0].tolist() == pytest.approx([1.0, 0.0], abs=1e-9)
    assert v.grad[0, :, 0].tolist() == pytest.approx([1.5, 0.0], abs=1e-9)


def test_masses_of_two_discs() -> None:
    mass, restitution = _leaf([[1.0, 3.0]]), _leaf([[0.9, 0.8]])
    scene = replace(world([[0, 0], [1, 0]], [[1, 0], [0, 0]]), mass=mass, restitution=restitution)
    simulate(scene, tensor([0.0, 2.0])).velocity[0, -1, 1, 0].backward()
    # v2 = m1 (1 + r1 r2) v / (m1 + m2).
    assert mass.grad[0].tolist() == pytest.approx([1.72 * 3 / 16, -1.72 / 16], abs=1e-9)
    assert restitution.grad[0].tolist() == pytest.approx([0.8 / 4, 0.9 / 4], abs=1e-9)


def test_stopping_distance() -> None:
    friction, v = _leaf([0.1]), _leaf([[[1.0, 0.0]]])
    scene = world([[0, 0]], [[0, 0]])
    scene = replace(scene, velocity=v, parameters={**scene.parameters, "sliding_friction": friction})
    result = simulate(scene, tensor([0.0, 4.0]))
    (result.trajectory.sum() + result.velocity[:, 1:].sum()).backward()
    assert friction.grad.item() == pytest.approx(-1 / (2 * 9.81 * 0.01), abs=1e-8)
    assert v.grad[0, 0, 0].item() == pytest.approx(1 / 0.981, abs=1e-8)


@pytest.mark.parametrize("excess", [1.05, 2.0, 50.0])
def test_a_disc_that_slides_off_from_rest_goes_the_way_it_is_pushed(excess: float) -> None:
    friction, tilt, times = 0.004, _leaf([0.003, 0.004]), tensor([0.0, 1.0, 2.0])
    model = PhysicsModel.base().with_effect(SurfaceTilt())
    steep = excess * friction / 0.005 * tilt
    scene = world([[0, 0]], [[0, 0]], parameters={"sliding_friction": friction})
    slope = dict(zip(("tilt_x", "tilt_y"), steep[:, None], strict=True))
    places = simulate(replace(scene, parameters={**scene.parameters, **slope}), times, model).trajectory[0, -1, 0, :2]
    expected = GRAVITY * (steep - friction * steep / steep.norm()) * times[-1] ** 2 / 2
    assert places.tolist() == pytest.approx(expected.tolist(), abs=1e-6)
    for axis in range(2):
        (ours,) = torch.autograd.grad(places[axis], tilt, retain_graph=True)
        (theirs,) = torch.autograd.grad(expected[axis], tilt, retain_graph=True)
        assert ours.tolist() == pytest.approx(theirs.tolist(), rel=1e-5)


PUSHED = {
    "wind": ({"wind_x": 1.5, "wind_y": 1.2, "air_drag": 0.02}, {"wind_x", "wind_y", "air_drag"}),
    "tilt": ({"tilt_x": 0.006, "tilt_y": -0.003}, {"tilt_x", "tilt_y", "rolling_resistance"}),
    "pair_force": ({"pair_strength": -0.1, "pair_softening": 0.2}, {"pair_strength", "position", "mass"}),
}
"""What pushes resting spheres, with parameters that change the way they go."""


@pytest.mark.parametrize("name", list(PUSHED))
def test_bodies_at_rest_that_are_pushed_have_the_derivatives_of_differences(name: str) -> None:
    effect = {"wind": Wind(), "tilt": SurfaceTilt(), "pair_force": PairForce()}[name]
    parameters, changed = PUSHED[name]
    worlds = world(
        [[0.0, 0.0], [0.9, 0.5], [-0.4, 0.8]],
        [[0.0, 0.0]] * 3,
        [SPHERE] * 3,
        {"rolling_resistance": 0.004, "sliding_friction": 0.05, **parameters},
    )
    times = tensor([0.0, 0.04, 0.2, 0.5, 1.0])
    scene = Scene(worlds, times, PhysicsModel.base().with_effect(effect), seed=3)
    gone = scene.rollout(scene.inputs).trajectory[0, -1, :, :2] - worlds.position[0]
    assert float(gone.abs().max()) > 0.01
    (slope,) = scene.slopes(changed)
    assert slope.finite
    assert slope.error < 1e-4


def _assert_same_derivatives(found: torch.Tensor, expected: torch.Tensor, *leaves: torch.Tensor) -> None:
    """Compare values, and derivatives by all leaves of both."""
    assert found.tolist() == pytest.approx(expected.tolist(), abs=1e-9)
    for index in range(len(found)):
        ours = torch.autograd.grad(found[index], leaves, retain_graph=True)
        theirs = torch.autograd.grad(expected[index], leaves, retain_graph=True)
        for one, other in zip(ours, theirs, strict=True):
            assert one.flatten().tolist() == pytest.approx(other.flatten().tolist(), rel=1e-7, abs=1e-8)


def _glide(place: torch.Tensor, speed: torch.Tensor, braking: torch.Tensor, time: torch.Tensor) -> torch.Tensor:
    return place + speed * time - speed.sign() * braking * time**2 / 2


def test_a_disc_at_a_wall_by_everything() -> None:
    x, v, bounce = _leaf([[[0.1, 0.0]]]), _leaf([[[1.6, 0.0]]]), [_leaf([[0.9]]), _leaf([[0.8]])]
    radius, friction, release, times = _leaf([[RADIUS]]), _leaf([0.07]), _leaf([[0.15]]), _leaf([0.0, 1.4])
    wall = _leaf([[1.0, -5.0, 1.0, 5.0]])
    scene = world([[0, 0]], [[0, 0]], walls=[[1, -5, 1, 5]])
    scene = replace(
        scene,
        position=x,
        velocity=v,
        restitution=bounce[0],
        wall_restitution=bounce[1],
        radius=radius,
        release_time=release,
        walls=wall,
        parameters={**scene.parameters, "sliding_friction": friction},
    )
    found = simulate(scene, times).trajectory[0, -1, 0, 0]
    braking, place = GRAVITY * friction[0], wall[0, [0, 2]].mean() - radius[0, 0]
    speed = (v[0, 0, 0] ** 2 - 2 * braking * (place - x[0, 0, 0])).sqrt()
    contact = release[0, 0] + (v[0, 0, 0] - speed) / braking
    expected = _glide(place, -speed * bounce[0][0, 0] * bounce[1][0, 0], braking, times[1] - contact)
    _assert_same_derivatives(found[None], expected[None], x, v, *bounce, radius, friction, release, wall, times)


def test_two_balls_by_everything() -> None:
    x, v = _leaf([[[0.0, 0.0], [1.0, 0.0]]]), _leaf([[[1.8, 0.0], [0.6, 0.0]]])
    mass, bounce, radius = _leaf([[1.3, 0.6]]), _leaf([[0.9, 0.7]]), _leaf([[0.2, 0.15]])
    friction, release, times = _leaf([0.04]), _leaf([[0.05, 0.12]]), _leaf([0.0, 1.3])
    scene = world([[0, 0], [1, 0]], [[0, 0], [0, 0]], [SPHERE, SPHERE])
    scene = replace(
        scene,
        position=x,
        velocity=v,
        mass=mass,
        restitution=bounce,
        radius=radius,
        release_time=release,
        parameters={**scene.parameters, "rolling_resistance": friction},
    )
    found = simulate(scene, times).trajectory[0, -1, :, 0]
    braking, (start, later) = GRAVITY * friction[0], release[0]
    # Both are slowed alike, so their distance changes at a constant rate once both are there.
    first, speed = _glide(x[0, 0, 0], v[0, 0, 0], braking, later - start), v[0, 0, 0] - braking * (later - start)
    until = (x[0, 1, 0] - first - radius.sum()) / (speed - v[0, 1, 0])
    before = torch.stack([speed, v[0, 1, 0]]) - braking * until
    places = torch.stack([_glide(first, speed, braking, until), _glide(x[0, 1, 0], v[0, 1, 0], braking, until)])
    impulse = (1 + bounce.prod()) * (before[0] - before[1]) / (1 / mass).sum()
    after = before + impulse / mass[0] * tensor([-1.0, 1.0])
    expected = _glide(places, after, braking, times[1] - later - until)
    _assert_same_derivatives(found, expected, x, v, mass, bounce, radius, friction, release, times)


def test_a_known_moment_of_inertia() -> None:
    inertia, offset, speed = _leaf([[0.05, torch.nan]]), 0.15, 1.0
    scene = world([[0, 0], [1, offset]], [[0, 0], [-speed, 0]], [CUBE, SPHERE], radius=[RADIUS, 1e-3])
    spin = simulate(replace(scene, inertia=inertia), tensor([0.0, 1.5])).velocity[0, -1, 0, 2]
    expected = 2 * speed * offset / (2 * inertia[0, 0] + offset**2)
    ours, theirs = (torch.autograd.grad(value, inertia)[0][0, 0].item() for value in (spin, expected))
    assert spin.item() == pytest.approx(expected.item(), abs=1e-9)
    assert ours == pytest.approx(theirs, abs=1e-7)


def test_second_derivatives_are_refused() -> None:
    v = _leaf([[[1.0, 0.0]]])
    value = simulate(replace(world([[0, 0]], [[0, 0]]), velocity=v), tensor([0.0, 1.0])).trajectory.sum()
    with pytest.raises(RuntimeError, match="first derivative only"):
        torch.autograd.grad(value, v, create_graph=True)

"""What an effect may do besides accelerate: boundaries, kicks, obstacles, forces at a distance, time, rolling."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.integrate import solve_ivp

from tests.simulator.scenes import CUBE, DISC, FRAMES, RADIUS, SPHERE, at, tensor, world
from vrdp_prob.errors import InputError
from vrdp_prob.models.effects.contact_friction import ContactFriction
from vrdp_prob.models.effects.contact_radius_error import ContactRadiusError
from vrdp_prob.models.effects.external_impulse import ExternalImpulse
from vrdp_prob.models.effects.friction_patch import FrictionPatch
from vrdp_prob.models.effects.hidden_obstacle import HiddenObstacle
from vrdp_prob.models.effects.pair_force import PairForce
from vrdp_prob.models.effects.slip_to_roll import SlipToRoll
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt
from vrdp_prob.models.effects.time_varying_friction import TimeVaryingFriction
from vrdp_prob.models.parameters import Scope
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.ending_kernel import GRIP
from vrdp_prob.models.simulator.events import RolloutEventKind
from vrdp_prob.models.simulator.outcome import Outcome
from vrdp_prob.models.simulator.rollout import simulate
from vrdp_prob.models.simulator.worlds import Worlds

GRAVITY = 9.81
_ALONE = (SurfaceTilt, TimeVaryingFriction, FrictionPatch, HiddenObstacle, ContactRadiusError, ExternalImpulse)
ALONE = PhysicsModel("alone", (*PhysicsModel.base().effects, *(effect() for effect in _ALONE)))
TOGETHER = PhysicsModel("together", (*PhysicsModel.base().effects, PairForce(), SlipToRoll(), SurfaceTilt()))
RUBBING = PhysicsModel("rubbing", (*PhysicsModel.base().effects, SlipToRoll(), ContactFriction()))
GONE = {
    "tilt_x": 0.0,
    "tilt_y": 0.0,
    "friction_trend": 0.0,
    "patch_x": 0.0,
    "patch_y": 50.0,
    "patch_radius": 0.5,
    "patch_friction": 0.0,
    "obstacle_x": 50.0,
    "obstacle_y": 50.0,
    "obstacle_radius": 0.1,
    "obstacle_restitution": 1.0,
    "radius_error": 0.0,
    "impulse_time": 100.0,
    "pair_strength": 0.0,
    "pair_softening": 0.1,
    "slip_friction": 0.2,
    "contact_friction": 0.0,
    "wall_friction": 0.0,
}
OF_BODIES = {"impulse_x": 0.0, "impulse_y": 0.0, "release_rolling": 0.0, "release_rolling_across": 0.0}


def scene(
    position: list[list[float]], velocity: list[list[float]], shapes: list[object] | None = None, **values: object
) -> Worlds:
    """One world in which all effects are gone but those whose parameters are given."""
    shared = {name: values.pop(name, value) for name, value in GONE.items()}
    for name in ("sliding_friction", "rolling_resistance", "air_drag", "angular_drag"):
        shared[name] = values.pop(name, 0.0)
    own = {name: values.pop(name, [value] * len(position)) for name, value in OF_BODIES.items()}
    plain = world(position, velocity, shapes, shared, **values)
    return replace(plain, parameters={**plain.parameters, **{name: tensor([value]) for name, value in own.items()}})


def test_friction_changes_at_the_edge_of_a_patch() -> None:
    friction, more, begin = 0.05, 2.0, 0.6
    worlds = scene(
        [[0, 0]], [[1.5, 0]], sliding_friction=friction, patch_x=begin + 5, patch_y=0.0, patch_radius=5.0,
        patch_friction=more,
    )  # fmt: skip
    rollout = at(worlds, 5.0, model=ALONE)
    square = 1.5**2 - 2 * friction * GRAVITY * begin
    expected = begin + square / (2 * friction * (1 + more) * GRAVITY)
    assert rollout.trajectory[0, -1, 0, 0].item() == pytest.approx(expected, abs=1e-10)
    assert rollout.events.kind.tolist() == [RolloutEventKind.CROSSING, RolloutEventKind.STOP]
    assert rollout.events.time[0] == pytest.approx((1.5 - math.sqrt(square)) / (friction * GRAVITY), abs=1e-10)


def test_a_kick_changes_the_velocity_at_its_time() -> None:
    worlds = scene([[0, 0], [3, 0]], [[1, 0], [0, 0]], impulse_time=0.7, impulse_x=[0.0, 0.5], impulse_y=[0.2, 0.0])
    result = at(worlds, 2.0, model=ALONE)
    assert torch.allclose(result.trajectory[0, -1, :, :2], tensor([[2.0, 0.26], [3.65, 0.0]]), atol=1e-12)
    assert result.events.kind.tolist() == [RolloutEventKind.KICK] * 2


def test_an_obstacle_reflects() -> None:
    worlds = scene([[0, 0]], [[1, 0]], obstacle_x=1.3, obstacle_y=0.0, obstacle_restitution=0.5)
    result = at(worlds, 2.0, model=ALONE)
    assert result.trajectory[0, -1, 0, 0].item() == pytest.approx(1.0 - 0.5 * 1.0, abs=1e-10)
    assert result.events.kind.tolist() == [RolloutEventKind.OBSTACLE]
    assert result.events.second.tolist() == [0]


def test_bodies_touch_at_another_radius() -> None:
    result = at(scene([[0, 0], [2, 0]], [[1, 0], [0, 0]], radius_error=0.25), 2.0, model=ALONE)
    assert result.events.time.tolist() == pytest.approx([2 - 2.5 * RADIUS], abs=1e-10)


def test_a_body_starts_when_friction_has_become_too_small() -> None:
    friction, tilt, trend = 0.1, 0.06, -0.2
    result = at(
        scene([[0, 0]], [[0, 0]], sliding_friction=friction, tilt_x=tilt, friction_trend=trend), 4.0, model=ALONE
    )
    begin = (tilt / friction / (1 + GRIP) - 1) / trend
    # a = g (tilt - friction (1 + trend t)), which is GRIP tilt g / (1 + GRIP) at first and grows by -g friction trend.
    first, growth, lasted = GRIP / (1 + GRIP) * tilt * GRAVITY, -GRAVITY * friction * trend, 4.0 - begin
    expected = first * lasted**2 / 2 + growth * lasted**3 / 6
    assert result.trajectory[0, -1, 0, 0].item() == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("slips", [True, False])
def test_two_bodies_attract_each_other(*, slips: bool) -> None:
    strength, softening, masses = 0.4, 0.1, np.array([1.0, 3.0])
    start = [[0, 0], [1.2, 0.1]], [[0.1, 0.3], [-0.2, 0.0]]
    worlds = scene(*start, pair_strength=strength, pair_softening=softening, mass=masses.tolist(), radius=[1e-3, 1e-3])

    def rates(_: float, y: np.ndarray) -> np.ndarray:
        between = y[2:4] - y[0:2]
        force = strength * between / (between @ between + softening**2) ** 1.5
        return np.concatenate([y[4:], force / masses[0], -force / masses[1]])

    times = np.linspace(0, 2, 30)
    exact = solve_ivp(rates, (0, 2), np.ravel(start), "DOP853", times, rtol=1e-12, atol=1e-12).y[:4].T.reshape(-1, 2, 2)
    rollout = simulate(worlds, tensor(times), TOGETHER if slips else PhysicsModel.base().with_effect(PairForce()))
    assert rollout.outcome == (Outcome.OK,)
    assert np.abs(rollout.trajectory[0, :, :, :2].numpy() - exact).max() < 1e-8


def test_a_body_at_rest_yields_to_an_attraction_that_grows() -> None:
    friction, strength, softening = 0.02, 0.25, 0.01
    worlds = scene(
        [[-4, 0], [0, 0.0]], [[1.5, 0], [0, 0]], [SPHERE, DISC], sliding_friction=friction, pair_strength=strength,
        pair_softening=softening, release_rolling=[1.0, 0.0],
    )  # fmt: skip
    rollout = simulate(worlds, FRAMES, TOGETHER)
    moved = np.flatnonzero(rollout.trajectory[0, :, 1, 0].numpy() < -1e-7)[0]
    distance = np.linalg.norm(rollout.trajectory[0, moved, 0, :2] - rollout.trajectory[0, moved, 1, :2])
    assert rollout.outcome == (Outcome.OK,)
    assert distance == pytest.approx(math.sqrt(strength / (friction * GRAVITY)), rel=0.06)


def test_a_sphere_slips_until_it_rolls_with_five_sevenths_of_its_velocity() -> None:
    speed, friction = 1.4, 0.15
    result = at(scene([[0, 0]], [[speed, 0]], [SPHERE], slip_friction=friction), 3.0, model=TOGETHER)
    until = 2 * speed / (7 * friction * GRAVITY)
    assert result.velocity[0, -1, 0, 0].item() == pytest.approx(5 / 7 * speed, abs=1e-12)
    place = speed * until - friction * GRAVITY * until**2 / 2 + 5 / 7 * speed * (3.0 - until)
    assert result.trajectory[0, -1, 0, 0].item() == pytest.approx(place, abs=1e-10)
    assert result.events.time.tolist() == pytest.approx([until], abs=1e-10)


def test_a_rolling_sphere_on_a_slope_accelerates_with_five_sevenths_of_gravity_along_it() -> None:
    worlds = scene([[0, 0]], [[0.5, 0]], [SPHERE], tilt_x=0.02, release_rolling=[1.0])
    assert at(worlds, 2.0, model=TOGETHER).trajectory[0, -1, 0, 0].item() == pytest.approx(
        1.0 + 5 / 7 * 0.02 * GRAVITY * 2, abs=1e-9
    )


@pytest.mark.parametrize("friction", [0.1, 10.0])
def test_a_sphere_that_rolls_into_a_wall_loses_rolling_by_friction_there(friction: float) -> None:
    speed, bounce = 0.8, 0.7
    worlds = scene(
        [[0, 0]], [[speed, 0]], [SPHERE], restitution=[bounce], release_rolling=[1.0], wall_friction=friction
    )
    worlds = replace(worlds, walls=tensor([[1.0, -2.0, 1.0, 2.0]]), wall_restitution=tensor([[1.0]]))
    velocity = at(worlds, 8.0, model=RUBBING).velocity[0, -1, 0, 0].item()
    # Little friction gives all it can; much stops the sphere's surface where it touches, so it rolls no more.
    rolling = max(speed - 2.5 * friction * (1 + bounce) * speed, 0.0)
    assert velocity == pytest.approx((-5 * bounce * speed + 2 * rolling) / 7)


def test_spheres_that_roll_against_each_other_take_up_rolling() -> None:
    friction, speed, bounce = 0.05, 0.5, 0.9
    worlds = scene(
        [[0, 0], [1, 0]],
        [[speed, 0], [0, 0]],
        [SPHERE, SPHERE],
        restitution=[bounce, 1.0],
        release_rolling=[1.0, 0.0],
        contact_friction=friction,
    )
    velocity = at(worlds, 6.0, model=RUBBING).velocity[0, -1, :, 0]
    after = speed * (1 - bounce) / 2, speed * (1 + bounce) / 2
    change = 2.5 * friction * after[1]
    expected = [(5 * after[0] + 2 * (speed - change)) / 7, (5 * after[1] - 2 * change) / 7]
    assert velocity.tolist() == pytest.approx(expected)


def test_a_spin_about_the_direction_of_motion_bends_the_path() -> None:
    speed, across, friction = 1.0, 0.6, 0.2
    worlds = scene([[0, 0]], [[speed, 0]], [SPHERE], slip_friction=friction, release_rolling_across=[across])
    rolls_at = 2 / 7 * speed * math.hypot(1.0, across) / (friction * GRAVITY)
    result = at(worlds, rolls_at + 1.0, model=TOGETHER)
    # It slips along (1, -across), the other way of which friction pushes it until v = (5 v + 2 u) / 7.
    rolling = speed * np.array([5.0, 2.0 * across]) / 7
    slipped = (np.array([speed, 0.0]) + rolling) / 2 * rolls_at
    assert result.trajectory[0, -1, 0, :2].numpy() == pytest.approx(slipped + rolling * 1.0)


def test_after_a_central_hit_between_rolling_spheres_both_slip() -> None:
    speed, restitution = 1.0, 0.9**2
    worlds = scene(
        [[0, 0], [1, 0]], [[speed, 0], [0, 0]], [SPHERE, SPHERE], restitution=[0.9, 0.9], release_rolling=[1.0, 0.0]
    )
    velocity = at(worlds, 6.0, model=TOGETHER).velocity[0, -1, :, 0]
    after = np.array([1 - restitution, 1 + restitution]) * speed / 2
    rolling = np.array([speed, 0.0])
    assert velocity.numpy() == pytest.approx(5 / 7 * after + 2 / 7 * rolling, abs=1e-9)


CASES = [
    (ALONE, scene(
        [[-1.5, 0.1], [0.4, 0.0], [0.5, 1.2]], [[1.9, 0.05], [0, 0], [-0.3, -0.4]], [DISC, CUBE, SPHERE],
        sliding_friction=0.05, rolling_resistance=0.02, air_drag=0.03, angular_drag=0.8, tilt_x=0.004, tilt_y=-0.003,
        friction_trend=0.1, patch_x=-0.6, patch_y=0.3, patch_radius=0.4, patch_friction=1.5, obstacle_x=1.6,
        obstacle_y=0.1, obstacle_radius=0.15, obstacle_restitution=0.7, radius_error=0.02, impulse_time=2.1,
        impulse_x=[0.1, -0.2, 0.05], impulse_y=[0.3, 0.1, 0.0], spin=[0.3, 0.2, 0.0], mass=[1.2, 0.8, 1.0],
        restitution=[0.9, 0.8, 0.7], release_time=[0.013, 0.113, 0.013],
    )),
    (TOGETHER, scene(
        [[-1.5, 0.1], [0.4, 0.0], [0.5, 1.2]], [[1.6, 0.05], [0, 0], [-0.3, -0.4]], [SPHERE, CUBE, SPHERE],
        sliding_friction=0.03, rolling_resistance=0.02, air_drag=0.03, angular_drag=0.8, tilt_x=0.004, tilt_y=-0.003,
        pair_strength=0.05, pair_softening=0.2, slip_friction=0.15, release_rolling=[0.3, 0.0, 0.6],
        spin=[0.3, 0.2, 0.0], mass=[1.2, 0.8, 1.0], restitution=[0.9, 0.8, 0.7], release_time=[0.013, 0.053, 0.113],
    )),
]  # fmt: skip


@pytest.mark.parametrize(("model", "worlds"), CASES, ids=["alone", "together"])
def test_derivatives_by_every_parameter(model: PhysicsModel, worlds: Worlds) -> None:
    names = ("position", "velocity", "angle", "spin", "release_time", "mass", "restitution", "radius")
    known = {parameter.name for parameter in model.parameters}
    values = {name: getattr(worlds, name) for name in names}
    values |= {name: value for name, value in worlds.parameters.items() if name in known}
    weight = tensor(np.random.default_rng(4).normal(size=(1, len(FRAMES), 3, 3)))

    def total(changed: dict[str, torch.Tensor]) -> torch.Tensor:
        parameters = {**worlds.parameters, **{name: value for name, value in changed.items() if name in known}}
        fields = {name: changed[name] for name in names}
        return (simulate(replace(worlds, **fields, parameters=parameters), FRAMES, model).trajectory * weight).sum()

    leaves = {name: value.clone().requires_grad_() for name, value in values.items()}
    total(leaves).backward()
    size = math.sqrt(sum((leaf.grad**2).sum().item() for leaf in leaves.values()))
    for name, value in values.items():
        for place in np.ndindex(*value.shape):
            slopes = []
            for step in (2e-6, 1e-6):
                moved = [value.clone(), value.clone()]
                moved[0][place] += step
                moved[1][place] -= step
                high, low = (total({**values, name: one}).item() for one in moved)
                slopes.append((high - low) / (2 * step))
            difference = (4 * slopes[1] - slopes[0]) / 3
            assert leaves[name].grad[place].item() == pytest.approx(difference, abs=1e-6 * size), (name, place)


def test_models_with_these_effects_are_files(tmp_path: object) -> None:
    for model in (ALONE, TOGETHER):
        model.write(f"{tmp_path}/model.toml")
        again = PhysicsModel.read(f"{tmp_path}/model.toml")
        assert again.layout == model.layout
        assert [effect.name for effect in again.effects] == [effect.name for effect in model.effects]


def test_missing_parameters_are_named() -> None:
    worlds = scene([[0, 0]], [[0, 0]])
    some = {name: value for name, value in worlds.parameters.items() if name != "impulse_x"}
    with pytest.raises(InputError, match="impulse_x"):
        simulate(replace(worlds, parameters=some), FRAMES, ALONE)
    assert next(one for one in ALONE.parameters if one.name == "impulse_x").scope is Scope.BODY

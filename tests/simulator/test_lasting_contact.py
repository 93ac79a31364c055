"""Bodies that press on each other move together."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
import torch

from tests.simulator import pressing_reference
from tests.simulator.differences import slopes
from tests.simulator.scenes import CUBE, DISC, FRAMES, RADIUS, SPHERE, at, energy, tensor, world
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.events import RolloutEventKind
from vrdp_prob.models.simulator.outcome import Outcome
from vrdp_prob.models.simulator.rollout import simulate
from vrdp_prob.models.simulator.worlds import Worlds

ROLLING, SLIDING = 0.01, 0.3
FRICTION = {"sliding_friction": SLIDING, "rolling_resistance": ROLLING}
BRAKES = {**FRICTION, "air_drag": 0.02, "angular_drag": 1.0}
TOUCH = 2 * RADIUS
"""Distance of two bodies that touch side to side."""
ENTRY = 2e-7
"""Depth in m to which bodies may be pressed when their contact begins to last."""


def _pushing(offset: float, restitution: float = 0.0, *, shape: object = CUBE, **fields: object) -> Worlds:
    """A fast sphere behind a slower body."""
    return world(
        [[0, 0], [0.5, offset]],
        [[2, 0], [0.4, 0.1]],
        [SPHERE, shape],
        fields.pop("parameters", BRAKES),
        restitution=[restitution, restitution],
        spin=[0.3, -0.2],
        **fields,
    )


def test_a_sphere_pushes_a_disc_along_a_line() -> None:
    # Both together: m1 v1 / (m1 + m2), then the mean of both decelerations until both rest.
    mass = (2.0, 1.0)
    scene = world([[0, 0], [0.5, 0]], [[2, 0], [0, 0]], [SPHERE, DISC], FRICTION, restitution=[0, 0], mass=mass)
    rollout = simulate(scene, FRAMES)
    contact = rollout.events.time[0]
    speed = (2 - 9.81 * ROLLING * contact) * 2 / 3
    braking = 9.81 * (mass[0] * ROLLING + mass[1] * SLIDING) / 3
    time = np.clip(FRAMES.numpy() - contact, 0, speed / braking)
    after = FRAMES.numpy() > contact
    expected = 0.5 + speed * time - braking * time**2 / 2
    assert np.abs(rollout.trajectory[0, :, 1, 0].numpy() - expected)[after].max() < 1e-6
    assert (rollout.velocity[0, -1] == 0).all()
    assert len(rollout.events) < 6


def test_a_sphere_pushes_a_disc_off_its_centre() -> None:
    position = np.array([[0.0, 0.0], [TOUCH * np.cos(0.3), TOUCH * np.sin(0.3)]])
    velocity = np.array([[1.0, 0.0], [0.9, 0.1]])
    scene = world(position.tolist(), velocity.tolist(), [SPHERE, DISC], FRICTION, restitution=[0, 0], mass=[1.5, 1.0])
    times = torch.linspace(0, 0.3, 40, dtype=torch.float64)
    rollout = simulate(scene, times)
    # The first contact takes their closing velocity.
    normal = np.array([np.cos(0.3), np.sin(0.3)])
    impulse = (velocity[0] - velocity[1]) @ normal / (1 / 1.5 + 1)
    velocity += np.outer([-impulse / 1.5, impulse], normal)
    expected, parted = pressing_reference.two_discs(
        position, velocity, np.array([1.5, 1.0]), np.array([ROLLING, SLIDING]), times.numpy()
    )
    before = times.numpy() < parted
    assert before.sum() > 20
    assert np.abs(rollout.trajectory[0, before, :, :2].numpy() - expected[before]).max() < 1e-6
    assert len(rollout.events) < 6


def test_a_sphere_pushes_the_side_of_a_cube() -> None:
    # Released in touch, with velocities that keep the gap.
    offset, spin = 0.05, 0.6
    state = np.array([TOUCH, 0.0, 0.0, 0.0, offset, 0.8, 0.05, spin, 0.8 - spin * offset, 0.02])
    parameters = {**FRICTION, "angular_drag": 0.5}
    scene = world(
        [[0, offset], [TOUCH, 0]],
        [state[8:].tolist(), state[5:7].tolist()],
        [SPHERE, CUBE],
        parameters,
        spin=[0, spin],
        mass=[1.5, 1.0],
        restitution=[0, 0],
    )
    times = torch.linspace(0, 0.2, 30, dtype=torch.float64)
    rollout = simulate(scene, times)
    inertia = float(scene.moment_of_inertia[0, 1])
    expected = pressing_reference.disc_on_side(
        state, np.array([1.0, 1.5]), inertia, np.array([SLIDING, ROLLING]), times.numpy(), spin_braking=0.5
    )
    found = torch.cat([rollout.trajectory[0, :, 1], rollout.trajectory[0, :, 0, :2]], dim=-1).numpy()
    assert np.abs(found - expected).max() < 1e-6
    assert len(rollout.events) < 6


@pytest.mark.parametrize("offset", [0.0, 0.05, 0.12])
@pytest.mark.parametrize("restitution", [0.05, 0.8])
def test_a_sphere_pushes_a_cube_until_both_rest(offset: float, restitution: float) -> None:
    scene = _pushing(offset, restitution)
    rollout = simulate(scene, torch.linspace(0, 30, 400, dtype=torch.float64))
    assert rollout.outcome == (Outcome.OK,)
    assert len(rollout.events) < 20
    assert (rollout.velocity[0, -1] == 0).all()
    assert energy(scene, rollout).diff(dim=1).max() < 1e-9


def test_the_gap_stays_while_two_discs_press() -> None:
    scene = world([[0, 0], [0.5, 0.03]], [[1.5, 0], [0.5, 0]], [SPHERE, DISC], FRICTION, restitution=[0.2, 0.2])
    times = torch.linspace(0, 2, 2000, dtype=torch.float64)
    rollout = simulate(scene, times)
    place = rollout.trajectory[0, ..., :2]
    gap = (place[:, 1] - place[:, 0]).norm(dim=-1) - TOUCH
    last = rollout.events.of_kind(RolloutEventKind.COLLISION).time[-1]
    gap = gap[times > last]
    pressed = (gap - gap[0]).abs() < 1e-9
    assert pressed.sum() > 50
    assert (pressed.int().diff() <= 0).all()
    assert (gap[~pressed] > gap[0]).all()
    assert gap.min() > -ENTRY


def test_momentum_is_kept_without_friction() -> None:
    # The rear body is driven on by the curvature of the side that turns under it, not by any outer force.
    scene = world(
        [[0, 0.05], [0.401, 0]],
        [[1.0, 0], [0.0, 0]],
        [DISC, CUBE],
        restitution=[0, 0],
        spin=[0, -1.0],
    )
    rollout = simulate(scene, FRAMES[:40])
    momentum = (scene.mass[:, None, :, None] * rollout.velocity[..., :2]).sum(2)
    assert torch.allclose(momentum, momentum[:, :1], atol=1e-10)


def test_the_front_body_leaves_when_it_is_faster() -> None:
    # A disc that brakes hard is pushed by a cube, until the cube stops; on ice both would stay together.
    scene = world([[0, 0], [TOUCH, 0]], [[1, 0], [1.2, 0]], [DISC, SPHERE], FRICTION, restitution=[0, 0])
    rollout = simulate(scene, FRAMES)
    gap = rollout.trajectory[0, :, 1, 0] - rollout.trajectory[0, :, 0, 0] - TOUCH
    assert (gap.diff() > -1e-12).all()
    assert len(rollout.events.of_kind(RolloutEventKind.COLLISION)) == 0


def test_a_chain_is_pushed() -> None:
    scene = world(
        [[0, 0], [0.5, 0], [0.95, 0]], [[2, 0], [0.5, 0], [0.4, 0]], [SPHERE, CUBE, DISC], BRAKES, restitution=[0.3] * 3
    )
    rollout = simulate(scene, FRAMES)
    assert rollout.outcome == (Outcome.OK,)
    assert len(rollout.events) < 30
    assert (rollout.velocity[0, -1] == 0).all()
    gaps = rollout.trajectory[0, :, 1:, 0] - rollout.trajectory[0, :, :-1, 0] - TOUCH
    assert gaps.min() > -ENTRY


TILTED = PhysicsModel.base().with_effect(SurfaceTilt())


def test_a_tilted_surface_presses_bodies_on_a_wall() -> None:
    parameters = {**FRICTION, "tilt_x": 0.1, "tilt_y": 0.0}
    # Spheres roll down the tilt, one to the wall and one onto the first.
    scene = world(
        [[0, 0], [-0.7, 0]],
        [[0, 0], [0, 0]],
        [SPHERE, SPHERE],
        parameters,
        restitution=[0.3, 0.3],
        walls=[[0.5, -1, 0.5, 1]],
        wall_restitution=[1.0],
    )
    rollout = simulate(scene, FRAMES, TILTED)
    assert rollout.outcome == (Outcome.OK,)
    assert len(rollout.events) < 40
    assert rollout.trajectory[0, -1, :, 0].tolist() == pytest.approx([0.3, -0.1], abs=1e-6)
    assert rollout.velocity[0, -1].abs().max() < 1e-6


def test_a_body_that_leans_moves_when_its_support_is_taken() -> None:
    # The sphere rolls down to the cube, which holds it; then a heavy disc strikes the cube away.
    scene = world(
        [[0, 0], [-0.5, 0], [0, -2.0]],
        [[0, 0], [0, 0], [0, 4.0]],
        [CUBE, SPHERE, DISC],
        {"sliding_friction": 0.11, "rolling_resistance": ROLLING, "tilt_x": 0.1, "tilt_y": 0.0, "angular_drag": 1.0},
        restitution=[0.0, 0.0, 0.3],
        mass=[1.0, 0.01, 60.0],
        release_time=[0.0, 0.0, 3.0],
    )
    rollout = simulate(scene, tensor([0.0, 2.0, 2.9, 12.0]), TILTED)
    assert rollout.outcome == (Outcome.OK,)
    assert (rollout.velocity[0, 1, :2] == 0).all()
    assert rollout.trajectory[0, 1, 0, 0] - rollout.trajectory[0, 1, 1, 0] == pytest.approx(TOUCH, abs=1e-6)
    assert torch.equal(rollout.trajectory[0, 1, :2], rollout.trajectory[0, 2, :2])
    assert rollout.trajectory[0, 3, 1, 0] > rollout.trajectory[0, 2, 1, 0] + 1.0


def test_a_flat_contact_of_two_cubes() -> None:
    scene = world([[0, 0], [0.5, 0.03]], [[2, 0], [0.3, 0.0]], [CUBE, CUBE], FRICTION, restitution=[0, 0], mass=[3, 1])
    rollout = simulate(scene, FRAMES)
    assert rollout.outcome == (Outcome.OK,)
    assert len(rollout.events) < 30
    assert rollout.velocity[0, -1].abs().max() < 1e-6


GRADIENT_SCENES = {
    "side": _pushing(0.05, 0.05),
    "from the side to the corner": _pushing(0.12, 0.05),
    "after bounces": _pushing(0.05, 0.8),
    "disc": _pushing(0.05, 0.5, shape=DISC),
    "to a wall": world(
        [[0, 0], [0.5, 0.03]],
        [[2, 0], [0.4, 0.2]],
        [SPHERE, CUBE],
        BRAKES,
        restitution=[0.3, 0.3],
        spin=[0.3, 0.2],
        walls=[[1.0, -1, 1.1, 1]],
        wall_restitution=[0.3],
    ),
    "chain": world(
        [[0, 0], [0.5, 0.03], [0.95, 0.01]],
        [[2, 0], [0.6, 0.1], [0.5, 0]],
        [SPHERE, CUBE, DISC],
        BRAKES,
        restitution=[0.3] * 3,
        spin=[0.3, 0.2, -0.1],
    ),
    "cubes": world(
        [[0, 0], [0.5, 0.03]],
        [[2, 0], [0.3, 0.05]],
        [CUBE, CUBE],
        BRAKES,
        restitution=[0.3, 0.3],
        angle=[0.1, 0],
        mass=[3.0, 1.0],
        spin=[0.3, 0.2],
    ),
}


@pytest.mark.parametrize("name", GRADIENT_SCENES)
def test_gradients_against_central_differences(name: str) -> None:
    # The time of a contact that begins while bodies press by less than 0.1 micrometre follows the steps of the search.
    errors = sorted(_errors(GRADIENT_SCENES[name], PhysicsModel.base(), seeds=range(6)))
    assert errors[-2] < 1e-5
    assert errors[-1] < 1e-3


def test_gradients_of_a_push_along_a_line() -> None:
    # Straight motion hides from the error of a step how its neighbours turn.
    scene = world(
        [[0, 0], [0.5, 0]], [[2, 0], [0.4, 0]], [SPHERE, DISC], BRAKES, restitution=[0.5] * 2, spin=[0.3, 0.2]
    )
    assert np.median(_errors(scene, PhysicsModel.base(), seeds=(1, 2, 3))) < 1e-4


def test_gradients_on_a_tilted_surface() -> None:
    tilt = {"tilt_x": tensor([0.06]), "tilt_y": tensor([0.01])}
    scene = GRADIENT_SCENES["side"]
    scene = replace(scene, parameters={**scene.parameters, **tilt})
    assert max(_errors(scene, TILTED, seeds=(1, 2))) < 1e-5


def _errors(scene: Worlds, model: PhysicsModel, seeds: Sequence[int]) -> list[float]:
    return [slopes(scene, seed, FRAMES, model)[0].error for seed in seeds]


def test_rest_stays_rest() -> None:
    # At the end of a push nothing moves any more, so a longer simulation has the same events.
    scene = _pushing(0.05)
    assert len(at(scene, 20.0).events) == len(at(scene, 40.0).events)

"""Motion that ends: every simulation comes to its last time, with few events."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from tests.simulator import reference
from tests.simulator.comparison import scene_of, scenes
from tests.simulator.scenes import CUBE, DISC, FRAMES, RADIUS, SPHERE, world
from tests.simulator.test_reference import EXTENDED
from vrdp_prob.models.simulator.outcome import Outcome
from vrdp_prob.models.simulator.rollout import simulate
from vrdp_prob.scene import Shape

NOTHING_ELSE = {"linear_drag": 0.0, "contact_friction": 0.0, "wall_friction": 0.0}


@pytest.mark.parametrize("share", [0.3, 0.86, 0.9, 0.98])
def test_a_body_comes_to_rest_on_a_slope(share: float) -> None:
    # The slope is that share of the friction: close to 1 the body turns downhill ever faster before it rests.
    for angle in np.linspace(0.1, 6.2, 12):
        tilt = {"tilt_x": 0.12 * share * np.cos(angle), "tilt_y": 0.12 * share * np.sin(angle)}
        scene = world([[0, 0]], [[1, 0]], None, {"sliding_friction": 0.12, **tilt, **NOTHING_ELSE})
        times = torch.linspace(0, 60, 100, dtype=torch.float64)
        rollout = simulate(scene, times, EXTENDED)
        assert rollout.outcome == (Outcome.OK,)
        assert (rollout.velocity[0, -1] == 0).all()
        expected = reference.rollout(scene_of(scene, 0), times.numpy()).states[:, 0, :2]
        assert np.abs(rollout.trajectory[0, :, 0, :2].numpy() - expected).max() < 1e-6


@pytest.mark.parametrize("shapes", [(DISC, SPHERE, DISC), (DISC, CUBE, DISC, DISC), (CUBE,) * 3])
@pytest.mark.parametrize("factor", [0.0, 0.1, 0.5])
def test_scenes_with_little_rebound(shapes: tuple[Shape, ...], factor: float) -> None:
    worlds = scenes(300, shapes, seed=777)
    rollout = simulate(replace(worlds, restitution=worlds.restitution * factor), FRAMES)
    assert set(rollout.outcome) <= {Outcome.OK, Outcome.OVERLAP}
    assert np.bincount(rollout.events.world).max() < 500


def test_inside_of_long_steps() -> None:
    worlds = scenes(100, (CUBE, DISC, SPHERE, CUBE), seed=6051, walls=False, late=True).select([39])
    expected = reference.rollout(scene_of(worlds, 0), FRAMES.numpy(), closed=True).states[..., :2]
    assert np.abs(simulate(worlds, FRAMES).trajectory[0, ..., :2].numpy() - expected).max() < 1e-8


@pytest.mark.parametrize("shapes", [(DISC, SPHERE, DISC), (CUBE, CUBE, CUBE), (SPHERE, CUBE, DISC)])
@pytest.mark.parametrize("bounce", [0.0, 0.2, 0.5])
def test_inelastic_collapse(shapes: tuple[Shape, ...], bounce: float) -> None:
    # Without friction three bodies on a line meet infinitely often where e < 7 - 4 sqrt(3).
    place, speed = [[0, 0], [0.5, 0], [1.0, 0]], [[1.0, 0], [0, 0], [-1.0, 0]]
    scene = world(place, speed, shapes, restitution=[bounce] * 3, mass=[1.0, 2.0, 1.5])
    rollout = simulate(scene, FRAMES)
    assert rollout.outcome == (Outcome.OK,)
    assert len(rollout.events) < 100
    momentum = (scene.mass[0, :, None] * rollout.velocity[0, -1, :, :2]).sum(0)
    assert momentum.tolist() == pytest.approx([-0.5, 0], abs=1e-9)
    gaps = rollout.trajectory[0, :, 1:, 0] - rollout.trajectory[0, :, :-1, 0] - 2 * RADIUS
    assert gaps.min() > -1e-6

"""Random scenes of discs against an independent simulator."""

import numpy as np
import pytest

from tests.simulator import reference
from tests.simulator.scenes import DISC, FRAMES, SPHERE, random_worlds
from vrdp_prob.models.simulator.events import RolloutEventKind
from vrdp_prob.models.simulator.rollout import simulate

SHAPES = (DISC, SPHERE, DISC, SPHERE)


def _deviations(count: int, seed: int) -> tuple[float, int]:
    """Farthest deviation in m before the first grazing contact, and the number of contacts that were compared."""
    worlds = random_worlds(count, SHAPES, seed, walls=False)
    rollout = simulate(worlds, FRAMES)
    trajectory, times = rollout.trajectory.numpy(), FRAMES.numpy()
    farthest, compared = 0.0, 0
    for index in range(count):
        rolling = np.array([shape is SPHERE for shape in SHAPES])
        friction = [float(worlds.parameters[name][index]) for name in ("sliding_friction", "rolling_resistance")]
        scene = {
            "position": worlds.position[index].numpy(),
            "velocity": worlds.velocity[index].numpy(),
            "mass": worlds.mass[index].numpy(),
            "restitution": worlds.restitution[index].numpy(),
            "radius": worlds.radius[index].numpy(),
            "friction": np.where(rolling, friction[1], friction[0]),
            "drag": float(worlds.parameters["air_drag"][index]),
        }
        expected, contacts, grazing = reference.rollout(scene, times)
        before = times < grazing
        farthest = max(farthest, np.abs(trajectory[index, before, :, :2] - expected[before]).max(initial=0.0))
        events = rollout.events.of_world(index).of_kind(RolloutEventKind.COLLISION)
        found = [pair for *pair, time in zip(events.first, events.second, events.time, strict=True) if time < grazing]
        assert found == [[first, second] for time, first, second in contacts if time < grazing]
        compared += len(found)
    return farthest, compared


def test_discs_against_the_reference() -> None:
    farthest, compared = _deviations(10, seed=21)
    assert farthest < 1e-6
    assert compared >= 10


@pytest.mark.slow
def test_many_discs_against_the_reference() -> None:
    farthest, compared = _deviations(200, seed=22)
    print(f"farthest deviation {farthest:.1e} m over {compared} contacts")
    assert farthest < 1e-6

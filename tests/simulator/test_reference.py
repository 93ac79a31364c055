"""Trajectories of random scenes of all shapes against an independent simulator."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest

from tests.simulator.comparison import Comparison, compare, scenes
from tests.simulator.scenes import CUBE, DISC, FRAMES, SPHERE, tensor
from vrdp_prob.models.effects.contact_friction import ContactFriction
from vrdp_prob.models.effects.linear_drag import LinearDrag
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.worlds import Worlds

Record = Callable[[str, object], None]
MIXES = {
    "discs": (DISC, SPHERE, DISC, SPHERE),
    "mixed": (CUBE, DISC, CUBE, SPHERE, DISC),
    "cubes": (CUBE, CUBE, CUBE),
}
EXTENDED = PhysicsModel.base().with_effect(SurfaceTilt()).with_effect(LinearDrag()).with_effect(ContactFriction())
STRENGTHS = {
    "tilt_x": (-0.005, 0.005),
    "tilt_y": (-0.005, 0.005),
    "linear_drag": (0, 0.3),
    "contact_friction": (0, 0.5),
}
EXACT = 1e-6
"""Farthest deviation in m that is allowed."""


def with_strengths(worlds: Worlds, ranges: Mapping[str, tuple[float, float]], seed: int) -> Worlds:
    """The worlds with random parameters of effects."""
    generator = np.random.default_rng(seed)
    more = {name: tensor(generator.uniform(*limits, len(worlds))) for name, limits in ranges.items()}
    return replace(worlds, parameters={**worlds.parameters, **more})


def _compared(count: int, shapes: Sequence[object], seed: int, model: PhysicsModel) -> Comparison:
    """Half of the scenes with walls, the others with a body that appears late."""
    total = Comparison()
    for kind in range(2):
        worlds = scenes(count // 2, shapes, seed + kind, walls=kind == 0, late=kind == 1)
        worlds = with_strengths(worlds, STRENGTHS, seed) if model is EXTENDED else worlds
        total += compare(worlds, FRAMES, model)
    return total


def _check(found: Comparison, record: Record) -> None:
    print(found)
    record("farthest_deviation_m", found.farthest)
    record("found", str(found))
    assert found.farthest < EXACT
    assert found.missed == found.invented == 0
    assert found.contacts > found.scenes
    assert found.cut < found.scenes / 3


@pytest.mark.parametrize("mix", MIXES)
@pytest.mark.parametrize("model", [PhysicsModel.base(), EXTENDED], ids=["base", "extended"])
def test_against_the_reference(mix: str, model: PhysicsModel, record_property: Record) -> None:
    _check(_compared(20, MIXES[mix], 21, model), record_property)


@pytest.mark.slow
@pytest.mark.parametrize("mix", MIXES)
@pytest.mark.parametrize("model", [PhysicsModel.base(), EXTENDED], ids=["base", "extended"])
def test_many_scenes_against_the_reference(mix: str, model: PhysicsModel, record_property: Record) -> None:
    _check(_compared(300, MIXES[mix], 121, model), record_property)

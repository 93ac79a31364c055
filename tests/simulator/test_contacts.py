"""No contact is missed and none invented, against the reference with motion in closed form."""

from collections.abc import Callable

import numpy as np
import pytest

from tests.simulator import reference
from tests.simulator.comparison import Comparison, compare, scene_of, scenes
from tests.simulator.scenes import CUBE, DISC, FRAMES, SPHERE

MIXES = [
    (DISC, SPHERE, DISC),
    (SPHERE, CUBE, CUBE),
    (CUBE, CUBE, CUBE, CUBE),
    (CUBE, DISC, SPHERE, CUBE),
    (DISC, SPHERE, DISC, SPHERE, SPHERE),
    (CUBE, DISC, CUBE, SPHERE, CUBE),
]
Record = Callable[[str, object], None]


def _compared(count: int, seed: int, batch: int) -> Comparison:
    """Scenes of all mixes in turn; three of four with walls, every second with a body that appears late."""
    total = Comparison()
    for index in range(-(-count // batch)):
        size = min(batch, count - index * batch)
        worlds = scenes(size, MIXES[index % len(MIXES)], seed + index, walls=index % 4 != 3, late=index % 2 == 1)
        total += compare(worlds, FRAMES, closed=True)
    return total


def _check(found: Comparison, record: Record) -> None:
    print(found)
    record("found", str(found))
    assert found.missed == found.invented == 0
    assert found.contacts > 2 * found.scenes
    assert found.compared > 0.7 * found.scenes
    assert found.farthest < 1e-6


def test_contacts_of_random_scenes(record_property: Record) -> None:
    _check(_compared(150, seed=5000, batch=15), record_property)


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_contacts_of_ten_thousand_random_scenes(record_property: Record) -> None:
    _check(_compared(10_000, seed=6000, batch=100), record_property)


@pytest.mark.parametrize("mix", [MIXES[3], MIXES[4]])
def test_both_references_agree(mix: tuple[object, ...], record_property: Record) -> None:
    worlds = scenes(8, mix, seed=70)
    farthest, times = 0.0, FRAMES.numpy()
    for index in range(len(worlds)):
        scene = scene_of(worlds, index)
        integrated, closed = reference.rollout(scene, times), reference.rollout(scene, times, closed=True)
        assert closed.doubtful_from == pytest.approx(integrated.doubtful_from, abs=1e-4)
        assert [(one.first, one.second) for one in closed.contacts] == [
            (one.first, one.second) for one in integrated.contacts
        ]
        before = times < closed.doubtful_from
        farthest = max(farthest, np.abs(closed.states - integrated.states)[before][..., :3].max())
    print(f"farthest deviation of the references from each other {farthest:.1e} m")
    record_property("farthest_deviation_m", float(farthest))
    assert farthest < 1e-7

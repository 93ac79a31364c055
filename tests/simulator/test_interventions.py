"""Late release, removal and changed masses."""

import torch

from tests.simulator.scenes import CUBE, DISC, FRAMES, at, random_worlds, tensor, world
from vrdp_prob.models.simulator.events import RolloutEventKind
from vrdp_prob.models.simulator.rollout import simulate


def test_a_body_appears_when_it_is_released() -> None:
    scene = world([[0, 0], [0.9, 0]], [[1, 0], [0.5, 0]], release_time=[0.0, 1.0])
    rollout = simulate(scene, FRAMES)
    late = rollout.trajectory[0, :, 1, 0]
    assert (late[FRAMES < 1] == 0.9).all()
    assert rollout.exists[0, :, 1].tolist() == (FRAMES >= 1).tolist()
    # The first passes the place before the second is there; released at 1.0 m and 0.9 m they overlap.
    assert rollout.outcome[0].name == "OVERLAP"


def test_release_before_the_first_time() -> None:
    scene = world([[0, 0]], [[1, 0]], release_time=[-2.0])
    assert torch.allclose(simulate(scene, tensor([0.0, 1.0])).trajectory[0, :, 0, 0], tensor([2.0, 3.0]), atol=1e-10)


def test_a_removed_body_meets_nothing() -> None:
    scene = world([[0, 0], [1, 0]], [[1, 0], [0, 0]])
    rollout = at(scene.without(1), 2.0)
    assert len(rollout.events) == 0
    assert rollout.exists[0, -1].tolist() == [True, False]
    assert torch.allclose(rollout.trajectory[0, -1, :, 0], tensor([2.0, 1.0]))


def test_a_heavier_body_is_moved_less() -> None:
    scene = world([[0, 0], [1, 0]], [[1, 0], [0, 0]])
    light, heavy = at(scene, 2.0), at(scene.with_mass_factor(1, 5.0), 2.0)
    assert light.velocity[0, -1, 1, 0].item() > heavy.velocity[0, -1, 1, 0].item() > 0


def test_event_table_names_bodies_and_walls() -> None:
    worlds = random_worlds(6, (CUBE, DISC, DISC), seed=8)
    events = simulate(worlds, FRAMES).events
    contacts = events.of_kind(RolloutEventKind.COLLISION)
    assert (contacts.first < contacts.second).all()
    assert (contacts.closing_speed > 0).all()
    assert (contacts.impulse > 0).all()
    walls = events.of_kind(RolloutEventKind.WALL)
    assert set(walls.second.tolist()) <= {0, 1}
    assert (events.of_kind(RolloutEventKind.STOP).second == -1).all()
    for index in range(len(worlds)):
        assert (events.of_world(index).time[1:] >= events.of_world(index).time[:-1]).all()

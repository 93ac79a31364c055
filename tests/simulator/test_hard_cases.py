"""What could break a simulation is a value of its outcome, not a crash."""

from dataclasses import replace

import pytest
import torch

from tests.simulator.scenes import CUBE, DISC, FRAMES, RADIUS, SPHERE, at, tensor, world
from vrdp_prob.errors import InputError
from vrdp_prob.models.simulator.outcome import Outcome
from vrdp_prob.models.simulator.rollout import simulate
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.scene import Shape


def _stacked(*worlds: Worlds) -> Worlds:
    names = ("position", "velocity", "angle", "spin", "release_time", "mass", "restitution", "radius", "present")
    fields = {name: torch.cat([getattr(one, name) for one in worlds]) for name in names}
    parameters = {name: torch.cat([one.parameters[name] for one in worlds]) for name in worlds[0].parameters}
    walls = torch.cat([one.restitution_of_walls for one in worlds])
    return replace(worlds[0], **fields, parameters=parameters, wall_restitution=walls)


def test_overlap_at_the_start_is_an_outcome_and_spoils_no_other_world() -> None:
    bad = world([[0, 0], [0.3, 0]], [[1, 0], [0, 0]])
    good = world([[0, 0], [1.3, 0]], [[1, 0], [0, 0]])
    rollout = simulate(_stacked(bad, good), FRAMES)
    assert rollout.outcome == (Outcome.OVERLAP, Outcome.OK)
    assert rollout.fine.tolist() == [False, True]
    assert torch.isfinite(rollout.trajectory).all()
    assert "overlapped" in Outcome.OVERLAP.sentence


def test_numbers_that_are_not_finite_are_an_outcome() -> None:
    good = world([[0, 0], [1.3, 0]], [[1, 0], [0, 0]])
    rollout = simulate(_stacked(replace(good, spin=good.spin * torch.nan), good), FRAMES)
    assert rollout.outcome == (Outcome.NOT_FINITE, Outcome.OK)
    assert torch.isfinite(rollout.trajectory).all()


def test_the_event_limit_is_an_outcome() -> None:
    scene = world([[0, 0]], [[3.0, 0]], walls=[[0.21, -1, 0.21, 1], [-0.21, -1, -0.21, 1]])
    rollout = simulate(scene, FRAMES, event_limit=20)
    assert rollout.outcome == (Outcome.EVENT_LIMIT,)
    assert torch.isfinite(rollout.trajectory).all()
    assert (rollout.trajectory[0, -1] == rollout.trajectory[0, -2]).all()
    assert simulate(scene, FRAMES).outcome == (Outcome.OK,)


def test_a_world_beyond_the_event_limit_spoils_no_other_world() -> None:
    trap = {"walls": [[0.21, -1, 0.21, 1], [-0.21, -1, -0.21, 1]]}
    bad, good = (world([[0, y]], [[3.0, 0]], **trap) for y in (0.0, 5.0))
    both = _stacked(bad, good)
    leaf = both.velocity.clone().requires_grad_()
    rollout = simulate(replace(both, velocity=leaf), FRAMES, event_limit=20)
    assert rollout.outcome == (Outcome.EVENT_LIMIT, Outcome.OK)
    assert torch.equal(rollout.trajectory[1], simulate(good, FRAMES).trajectory[0])
    rollout.trajectory.sum().backward()
    assert torch.isfinite(leaf.grad).all()
    assert leaf.grad[1, 0, 0].item() == pytest.approx(FRAMES.sum().item(), rel=1e-9)


@pytest.mark.parametrize("shape", [CUBE, SPHERE])
def test_a_wall_that_takes_all_closing_speed(shape: Shape) -> None:
    scene = world([[0, 0]], [[1.0, 0.5]], [shape], walls=[[1, -5, 1, 5]], wall_restitution=[0.0])
    rollout = at(scene, 2.0)
    assert rollout.outcome == (Outcome.OK,)
    assert rollout.trajectory[0, -1, 0, :2].tolist() == pytest.approx([0.8, 1.0], abs=1e-6)
    assert rollout.velocity[0, -1, 0].tolist() == pytest.approx([0, 0.5, 0], abs=1e-8)


@pytest.mark.parametrize("shapes", [(DISC, SPHERE, DISC), (CUBE, CUBE, CUBE), (SPHERE, CUBE, DISC)])
def test_inelastic_bodies_from_both_sides(shapes: tuple[Shape, ...]) -> None:
    place, speed = [[0, 0], [0.5, 0], [1.0, 0]], [[1.0, 0], [0, 0], [-1.0, 0]]
    scene = world(place, speed, shapes, restitution=[0.5] * 3, mass=[1.0, 2.0, 1.5])
    rollout = simulate(scene, FRAMES)
    assert rollout.outcome == (Outcome.OK,)
    assert len(rollout.events) < 20
    momentum = (scene.mass[0, :, None] * rollout.velocity[0, -1, :, :2]).sum(0)
    assert momentum.tolist() == pytest.approx([-0.5, 0], abs=1e-9)
    gaps = rollout.trajectory[0, :, 1:, 0] - rollout.trajectory[0, :, :-1, 0] - 2 * RADIUS
    assert gaps.min() > -1e-6


@pytest.mark.parametrize("bounce", [0.0, 0.1, 0.6])
def test_inelastic_collapse_between_a_heavy_body_and_a_wall(bounce: float) -> None:
    friction = {"sliding_friction": 0.05, "rolling_resistance": 0.01}
    walls = {"walls": [[1, -5, 1, 5]], "wall_restitution": [bounce]}
    bodies = {"restitution": [bounce, 1.0], "mass": [50.0, 0.5]}
    scene = world([[-0.5, 0], [0.7, 0]], [[2, 0], [0, 0]], [SPHERE, DISC], friction, **walls, **bodies)
    rollout = simulate(scene, FRAMES)
    assert rollout.outcome == (Outcome.OK,)
    place = rollout.trajectory[0, ..., 0]
    assert place[:, 1].max() < 1 - RADIUS + 1e-6
    assert (place[:, 1] - place[:, 0]).min() > 2 * RADIUS - 1e-6


@pytest.mark.parametrize("shapes", [(DISC, SPHERE), (CUBE, CUBE), (CUBE, SPHERE)])
def test_bodies_that_rest_in_touch_stay(shapes: tuple[Shape, ...]) -> None:
    place = [[0.8, 0], [0.8 - 2 * RADIUS, 0]]
    rollout = simulate(world(place, [[0, 0], [0, 0]], shapes, {"sliding_friction": 0.1}, walls=[[1, -5, 1, 5]]), FRAMES)
    assert rollout.outcome == (Outcome.OK,)
    assert len(rollout.events) == 0
    assert rollout.trajectory[0, -1, :, :2].tolist() == place


def test_newtons_cradle_of_five() -> None:
    place = [[0, 0], *([1 + 2 * RADIUS * index, 0] for index in range(4))]
    rollout = at(world(place, [[1.0, 0], *[[0, 0]] * 4]), 2.0)
    assert rollout.outcome == (Outcome.OK,)
    assert torch.allclose(rollout.velocity[0, -1, :, 0], tensor([0.0, 0, 0, 0, 1.0]), atol=1e-12)


def test_contact_without_rebound() -> None:
    rollout = at(world([[0, 0], [1, 0]], [[1, 0], [0, 0]], restitution=[0.0, 0.0]), 3.0)
    assert rollout.outcome == (Outcome.OK,)
    assert torch.allclose(rollout.velocity[0, -1, :, 0], tensor([0.5, 0.5]), atol=1e-12)


def test_a_pushing_body_ends_without_endless_contacts() -> None:
    friction = {"sliding_friction": 0.3, "rolling_resistance": 0.01}
    rollout = simulate(
        world([[0, 0], [0.5, 0]], [[2, 0], [0, 0]], [SPHERE, CUBE], friction, restitution=[0, 0]), FRAMES
    )
    assert rollout.outcome == (Outcome.OK,)
    gap = rollout.trajectory[0, :, 1, 0] - rollout.trajectory[0, :, 0, 0] - 2 * RADIUS
    assert gap.min() > -1e-6


def test_equal_velocities_with_equal_friction() -> None:
    parameters = {"sliding_friction": 0.1, "air_drag": 0.02}
    for distance in (2 * RADIUS, 0.5):
        rollout = simulate(world([[0, 0], [distance, 0]], [[1.5, 0], [1.5, 0]], None, parameters), FRAMES)
        assert rollout.outcome == (Outcome.OK,)
        assert torch.allclose(
            rollout.trajectory[0, :, 1, 0] - rollout.trajectory[0, :, 0, 0], tensor(distance), atol=1e-9
        )


@pytest.mark.parametrize("ratio", [1e6, 1e-6])
def test_extreme_mass_ratio(ratio: float) -> None:
    rollout = at(world([[0, 0], [1, 0]], [[1, 0], [0, 0]], mass=[ratio, 1.0]), 2.0)
    expected = [(ratio - 1) / (ratio + 1), 2 * ratio / (ratio + 1)]
    assert rollout.velocity[0, -1, :, 0].tolist() == pytest.approx(expected, rel=1e-12)


def test_simultaneous_contacts() -> None:
    side = 2 * RADIUS
    scene = world([[-1, 0], [0, side / 2], [0, -side / 2]], [[1, 0], [0, 0], [0, 0]])
    rollout = at(scene, 2.0)
    assert rollout.outcome == (Outcome.OK,)
    assert torch.allclose(rollout.velocity[0, -1, :, :2].sum(0), tensor([1.0, 0.0]), atol=1e-12)


def test_cubes_side_to_side() -> None:
    scene = world([[0, 0], [1, 0]], [[1, 0], [0, 0]], [CUBE, CUBE], restitution=[0.5, 1.0])
    rollout = at(scene, 2.0)
    assert rollout.outcome == (Outcome.OK,)
    assert rollout.velocity[0, -1, :, 0].sum().item() == pytest.approx(1.0, abs=1e-12)
    assert rollout.velocity[0, -1, 1, 0] > rollout.velocity[0, -1, 0, 0]


def test_fast_and_thin_bodies_do_not_tunnel() -> None:
    scene = world([[0, 0.01], [5, 0]], [[200.0, 0], [0, 0]], [DISC, SPHERE], radius=[0.02, 0.02])
    assert len(at(scene, 1.0).events) == 1


def test_bad_times_and_missing_parameters_are_named() -> None:
    scene = world([[0, 0]], [[0, 0]])
    with pytest.raises(InputError, match="increasing"):
        simulate(scene, tensor([1.0, 0.5]))
    with pytest.raises(InputError, match="rolling_resistance"):
        simulate(replace(scene, parameters={"sliding_friction": tensor([0.1])}), FRAMES)


def test_single_precision_in_and_out() -> None:
    exact = world([[0, 0], [1, 0.1]], [[1, 0], [0, 0]], [CUBE, SPHERE], {"sliding_friction": 0.1})
    names = ("position", "velocity", "angle", "spin", "release_time", "mass", "restitution", "radius")
    fields = {name: getattr(exact, name).float() for name in names}
    parameters = {name: values.float() for name, values in exact.parameters.items()}
    velocity = fields["velocity"].requires_grad_()
    rollout = simulate(replace(exact, **fields, parameters=parameters), FRAMES.float())
    rollout.trajectory.sum().backward()
    assert rollout.trajectory.dtype == rollout.velocity.dtype == velocity.grad.dtype == torch.float32
    assert torch.allclose(rollout.trajectory.double(), simulate(exact, FRAMES).trajectory, atol=1e-5)


def test_times_of_each_world() -> None:
    scene = world([[0, 0]], [[1.0, 0]])
    times = torch.stack([tensor([0.0, 1.0]), tensor([0.5, 2.0])]).requires_grad_()
    rollout = simulate(_stacked(scene, scene), times)
    assert torch.allclose(rollout.trajectory[:, :, 0, 0], times, atol=1e-11)
    rollout.trajectory[..., 0].sum().backward()
    assert torch.allclose(times.grad, torch.ones(2, 2, dtype=torch.float64), atol=1e-11)
    with pytest.raises(InputError, match="one row each"):
        simulate(_stacked(scene, scene, scene), times)

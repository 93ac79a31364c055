"""Causes that a discovery may name, against a general integrator (scipy's DOP853) and closed forms."""

import math
from collections.abc import Callable

import numpy as np
import pytest
import torch
from scipy.integrate import solve_ivp

from tests.simulator.scenes import DISC, at, world
from vrdp_prob.models.effects.bowl import Bowl
from vrdp_prob.models.effects.clock_error import ClockError
from vrdp_prob.models.effects.dropped_frames import DROPPED_AFTER, FRAME_TIME, DroppedFrames
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.lens_distortion import LensDistortion
from vrdp_prob.models.effects.magnus_curl import MagnusCurl
from vrdp_prob.models.effects.mass_dependent_friction import MassDependentFriction
from vrdp_prob.models.effects.rotating_table import RotatingTable
from vrdp_prob.models.effects.speed_dependent_restitution import SpeedDependentRestitution
from vrdp_prob.models.effects.wall import Wall
from vrdp_prob.models.effects.wind import Wind
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.ending_kernel import GRIP
from vrdp_prob.models.simulator.outcome import Outcome

GRAVITY = 9.81
FRICTION, DRAG = 0.02, 0.1
START, VELOCITY, SPIN = (0.3, -0.2), (1.1, 0.6), 1.7
END = 1.5

Law = Callable[[np.ndarray, np.ndarray], np.ndarray]


def model_with(*effects: Effect) -> PhysicsModel:
    base = PhysicsModel.base()
    return PhysicsModel("-".join(effect.name for effect in effects), (*base.effects, *effects))


def integrated(law: Law, *, still_air: bool = True) -> np.ndarray:
    """Where a sliding disc ends, by an integrator that shares nothing with the simulator."""

    def slope(_time: float, state: np.ndarray) -> np.ndarray:
        place, velocity = state[:2], state[2:]
        speed = np.linalg.norm(velocity)
        own = -FRICTION * GRAVITY * velocity / speed
        drag = -DRAG * speed * velocity if still_air else 0.0
        return np.concatenate([velocity, own + drag + law(place, velocity)])

    found = solve_ivp(slope, (0.0, END), [*START, *VELOCITY], method="DOP853", rtol=1e-11, atol=1e-12)
    return np.asarray(found.y[:2, -1])


def wind(_place: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    relative = velocity - np.array([-2.0, 1.0])
    return np.asarray(-DRAG * np.linalg.norm(relative) * relative)


PATHS: list[tuple[Effect, dict[str, float], Law]] = [
    (Wind(), {"wind_x": -2.0, "wind_y": 1.0}, wind),
    (MagnusCurl(), {"curl": 0.2}, lambda _, v: 0.2 * SPIN * np.array([-v[1], v[0]])),
    (
        Bowl(),
        {"bowl_stiffness": 0.7, "bowl_x": 0.5, "bowl_y": -1.0},
        lambda r, _: -0.7 * (r - np.array([0.5, -1.0])),
    ),
    (
        RotatingTable(),
        {"table_rotation": 0.4, "rotation_x": 0.2, "rotation_y": 0.1},
        lambda r, v: 0.8 * np.array([v[1], -v[0]]) + 0.16 * (r - np.array([0.2, 0.1])),
    ),
    (
        MassDependentFriction(),
        {"friction_mass_exponent": 0.5},
        lambda _, v: -FRICTION * GRAVITY * (math.sqrt(2.5) - 1) * v / np.linalg.norm(v),
    ),
]


@pytest.mark.parametrize(("effect", "parameters", "law"), PATHS, ids=[effect.name for effect, _, _ in PATHS])
def test_paths(effect: Effect, parameters: dict[str, float], law: Law) -> None:
    base = {"sliding_friction": FRICTION, "air_drag": DRAG}
    scene = world([START], [VELOCITY], [DISC], {**base, **parameters}, spin=[SPIN], mass=[2.5])
    expected = integrated(law, still_air=not isinstance(effect, Wind))
    found = at(scene, END, model=model_with(effect)).trajectory[0, -1, 0, :2].numpy()
    np.testing.assert_allclose(found, expected, atol=1e-8)
    without = at(scene, END).trajectory[0, -1, 0, :2].numpy()
    assert np.linalg.norm(found - without) > 0.01


@pytest.mark.parametrize("excess", [1e-9, 1e-6, 1e-4, 2e-3, 1e-2, 0.3, 10.0])
def test_a_body_at_rest_in_a_dome_either_stays_or_goes(excess: float) -> None:
    stiffness, middle = 0.7, np.array([0.5, -1.0])
    away = np.array(START) - middle
    friction = stiffness * np.linalg.norm(away) / GRAVITY / (1 + excess)
    parameters = {"bowl_stiffness": -stiffness, "bowl_x": middle[0], "bowl_y": middle[1], "sliding_friction": friction}
    rollout = at(world([START], [(0, 0)], [DISC], parameters), END, model=model_with(Bowl()))
    assert rollout.outcome == (Outcome.OK,)
    # Along the slope x'' = k x - friction g from rest.
    grown = (math.cosh(math.sqrt(stiffness) * END) - 1) * excess / (1 + excess) if excess > GRIP else 0.0
    np.testing.assert_allclose(rollout.trajectory[0, -1, 0, :2], START + grown * away, atol=3e-6)


@pytest.mark.parametrize("effect", [effect for effect, _, _ in PATHS], ids=[effect.name for effect, _, _ in PATHS])
def test_paths_without_the_cause_are_those_of_the_base_model(effect: Effect) -> None:
    nothing = {parameter.name: parameter.default for parameter in effect.parameters if parameter.name != "air_drag"}
    base = {"sliding_friction": FRICTION, "air_drag": DRAG}
    scene = world([START], [VELOCITY], [DISC], {**base, **nothing, **effect.vanishes_at}, spin=[SPIN], mass=[2.5])
    found, without = (at(scene, END, model=model).trajectory for model in (model_with(effect), None))
    torch.testing.assert_close(found, without, atol=1e-9, rtol=0)


@pytest.mark.parametrize("speed", [0.3, 2.0])
def test_fast_impacts_lose_more(speed: float) -> None:
    law = {"restitution_exponent": 0.25, "restitution_speed": 0.5}
    scene = world([[0, 0], [1, 0]], [[speed, 0], [0, 0]], [DISC, DISC], law, restitution=[0.9, 1.0])
    after = at(scene, 5.0, model=model_with(SpeedDependentRestitution())).velocity[0, -1, :, 0]
    assert (after[1] - after[0]).item() / speed == pytest.approx(0.9 * (1 + speed / 0.5) ** -0.25, rel=1e-9)


def test_a_hidden_wall_throws_back() -> None:
    """The wall is the line x + y = 1: a disc that comes along the diagonal touches it after sqrt(1/2) - 0.2 m."""
    wall = {
        "hidden_wall_distance": math.sqrt(0.5),
        "hidden_wall_direction": math.pi / 4,
        "hidden_wall_restitution": 0.5,
    }
    scene = world([[0, 0]], [[1.0, 1.0]], [DISC], wall, restitution=[0.8])
    rollout = at(scene, 2.0, model=model_with(Wall()))
    assert rollout.velocity[0, -1, 0, :2].tolist() == pytest.approx([-0.4, -0.4])
    assert rollout.events.time == pytest.approx([(math.sqrt(0.5) - 0.2) / math.sqrt(2)])


def test_lost_frames() -> None:
    stamps = torch.tensor([[0.0, 0.4, 0.8, 1.2]], dtype=torch.float64)
    lost = {"lost_time": torch.tensor([0.1]).double(), "lost_at": torch.tensor([0.6]).double()}
    assert ClockError().measured_times(stamps, lost)[0].tolist() == pytest.approx([0.0, 0.4, 0.9, 1.3])


def test_dropped_frames() -> None:
    stamps = torch.tensor([[0.0, 0.4, 0.8, 1.2]], dtype=torch.float64).expand(2, -1)
    never = {one.name: torch.full((2,), one.default).double() for one in DROPPED_AFTER}
    after = {DROPPED_AFTER[0].name: [0.2, 0.6], DROPPED_AFTER[1].name: [0.2, 1.0]}
    places = never | {name: torch.tensor(values).double() for name, values in after.items()}
    lost = {FRAME_TIME.name: torch.tensor([0.4, 0.5]).double(), **places}
    times = DroppedFrames().measured_times(stamps, lost)
    assert times[0].tolist() == pytest.approx([0.0, 1.2, 1.6, 2.0])
    assert times[1].tolist() == pytest.approx([0.0, 0.4, 1.3, 2.2])


def test_a_lens_moves_what_is_far_from_its_middle() -> None:
    places = torch.tensor([[[[1.0, 0.0], [1.0, 2.0]]]], dtype=torch.float64)
    lens = {
        name: torch.tensor([value]).double() for name, value in (("distortion", 0.1), ("lens_x", 1.0), ("lens_y", 0.0))
    }
    seen = LensDistortion().measured_positions(places, torch.zeros(1, 1).double(), lens)
    assert seen[0, 0].tolist() == [[1.0, 0.0], [1.0, pytest.approx(2 * (1 + 0.1 * 4))]]

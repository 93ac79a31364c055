"""It does not matter where the origin of places and of time lies."""

import math

import numpy as np
import pytest
import torch

from vrdp_prob.models.effects.bowl import Bowl
from vrdp_prob.models.effects.dropped_frames import FRAME_TIME
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.external_impulse import ExternalImpulse
from vrdp_prob.models.effects.friction_patch import FrictionPatch
from vrdp_prob.models.effects.hidden_obstacle import HiddenObstacle
from vrdp_prob.models.effects.pair_force import PairForce
from vrdp_prob.models.effects.places import Region
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt
from vrdp_prob.models.effects.time_varying_friction import TimeVaryingFriction
from vrdp_prob.models.effects.wall import Wall
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.model_file import known_effects
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.unknowns import Structure, unknowns
from vrdp_prob.scene import Body, Shape, Tracks

LOOKED_FOR = [
    effect()
    for effect in known_effects().values()
    if effect.overrides("expected") and not effect.overrides("frame_jitter")  # which goes with the time between frames
]


SIZES = {"patch_radius", "obstacle_radius", "second_obstacle_radius", "pair_softening"}
"""Parameters that are expected to go with the size of the scene; they are stated for one of a half width of 3 m."""

OF_FRAMES = {FRAME_TIME.name}
"""Parameters that are expected to go with the time between two frames."""


def seen(
    middle: tuple[float, float] = (0.0, 0.0), *, begin: float = 0.0, half_width: float = 1.5, frames: int = 801
) -> Tracks:
    """A body that crosses a square along its diagonal in 4 s."""
    times = begin + np.linspace(0.0, 4.0, frames)
    path = np.asarray(middle) + half_width * np.linspace(-1.0, 1.0, frames)[:, None]
    return Tracks.from_arrays("one", (Body("a", Shape.CYLINDER, 0.1),), times, path[:, None])


@pytest.mark.parametrize("effect", LOOKED_FOR, ids=lambda effect: effect.name)
def test_a_small_scene_around_the_origin_changes_little(effect: Effect) -> None:
    stated = {parameter.name: parameter for parameter in effect.parameters if parameter.name not in SIZES | OF_FRAMES}
    for name, parameter in effect.expected([seen(half_width=0.5)]).items():
        if name not in stated:
            continue
        assert parameter.prior.mean == pytest.approx(stated[name].prior.mean, abs=0.5 * stated[name].prior.sd)
        assert parameter.prior.sd == pytest.approx(stated[name].prior.sd)


@pytest.mark.parametrize("effect", [FrictionPatch(), HiddenObstacle(), PairForce()], ids=lambda effect: effect.name)
def test_sizes_go_with_the_scene(effect: Effect) -> None:
    """Ten times smaller, all that is looked for and expected is so, too."""
    large, small = [seen(half_width=3.0)], [seen(half_width=0.3)]
    for name, parameter in effect.expected(small).items():
        if name in SIZES:
            other = effect.expected(large)[name]
            assert parameter.default == pytest.approx(0.1 * other.default)
            assert parameter.prior.mean == pytest.approx(math.log(0.1) + other.prior.mean)
            assert parameter.prior.sd == other.prior.sd
            assert abs(other.prior.mean - stated_mean(effect, name)) < 0.2 * other.prior.sd
    points, others = effect.search_points(small), effect.search_points(large)
    assert len(points) == len(others)
    for point, wide in zip(points, others, strict=True):
        assert point == pytest.approx({name: 0.1 * value for name, value in wide.items()})


def test_an_outlier_does_not_make_the_scene_large() -> None:
    tracks = seen()
    positions = tracks.positions.copy()
    positions[7:9] = 100.0
    spoilt = Tracks.from_arrays("one", tracks.bodies, tracks.times, positions)
    assert Region.of([spoilt]).half_width == pytest.approx(Region.of([tracks]).half_width)


def stated_mean(effect: Effect, name: str) -> float:
    return next(one.prior.mean for one in effect.parameters if one.name == name)


def test_a_place_moves_with_the_scene_and_is_as_wide_as_it() -> None:
    expected = Bowl().expected([seen((6.0, -3.0), half_width=8.0)])
    assert (expected["bowl_x"].prior.mean, expected["bowl_y"].prior.mean) == pytest.approx((6.0, -3.0))
    assert (expected["bowl_x"].default, expected["bowl_y"].default) == pytest.approx((6.0, -3.0))
    assert expected["bowl_x"].prior.sd == pytest.approx(4.0, rel=0.01)
    assert "bowl_stiffness" not in expected


def test_a_wall_may_be_where_the_scene_is() -> None:
    distance = Wall().expected([seen((30.0, 40.0))])["hidden_wall_distance"].prior
    assert abs(50.0 - distance.mean) < 1.5 * distance.sd


def test_a_kick_happens_while_bodies_are_seen() -> None:
    time = ExternalImpulse().expected([seen(begin=1000.0), seen(begin=1020.0)])["impulse_time"].prior
    assert time.mean == pytest.approx(1012.0)
    assert abs(1000.0 - time.mean) < 2 * time.sd


def test_a_model_believes_it_and_forgets_it_with_the_effect() -> None:
    bowl, videos = Bowl(), [seen((6.0, -3.0))]
    model = PhysicsModel.base().with_effect(bowl, videos)
    assert model.believed(bowl.parameters[1]).prior.mean == pytest.approx(6.0)
    assert PhysicsModel.base().with_effect(bowl).believed(bowl.parameters[1]) == bowl.parameters[1]
    assert not model.without_effect(bowl).beliefs
    assert not PhysicsModel.base().with_effect(SurfaceTilt(), videos).beliefs


@pytest.mark.parametrize("begin", [0.0, 1000.0, 1.7e9])
def test_friction_changes_from_the_first_frame_of_a_video_on(begin: float) -> None:
    effect, tracks = TimeVaryingFriction(), seen(begin=begin, frames=21)
    model = PhysicsModel.base().with_effect(effect)
    structure = Structure(moving=frozenset({0}), colliding=frozenset())
    likelihood = Likelihood(tracks, model, unknowns(tracks, model, structure))
    point = torch.zeros(1, len(likelihood.coordinates.entries), dtype=torch.float64)
    values = {"velocity_x": 2.0, "sliding_friction": math.log(0.1), "air_drag": -20.0, "friction_trend": 0.25}
    for name, value in values.items():
        point[0, next(k for k, one in enumerate(likelihood.coordinates.entries) if one.field == name)] = value
    places = likelihood.predicted(point)[0, :, 0, 0]
    # v(t) = 2 - 0.981 (t + t^2 / 8) until the body stops
    until = np.linspace(0.0, 1.4, 8)
    expected = 2 * until - 0.981 * (until**2 / 2 + until**3 / 24)
    np.testing.assert_allclose(places[:8], expected, atol=1e-5)

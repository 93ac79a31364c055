"""True values are those of what is hidden, by the names and conventions of the estimates."""

import math

import numpy as np
import pytest

from tests.discovery.causes import CATALOGUE
from tests.discovery.data_set import DataSet, Wanted, draw
from tests.discovery.hidden import hide, true_values
from tests.discovery.scenes import Setting
from vrdp_prob.models.model_file import known_effects

SMALL = Setting(videos=2, bodies=3, frames=60, friction_spread=0.0)
WITHOUT = {"pair_force", "material_friction", "clock_error", "external_impulse", "wall"}
"""Causes with parameters of each video, or whose strength is not one that tracks tell."""


def hidden(way: str, strength: float) -> DataSet:
    return draw([Wanted(way, strength=strength)], seed=2, setting=SMALL)


@pytest.mark.parametrize("turn", [0.0, math.pi, -2 * math.pi])
def test_a_wall_is_where_its_ends_are(turn: float) -> None:
    truth = hidden("wall", 0.3).truth
    for wall in truth.videos[0].hidden_walls:
        direction = math.atan2(wall.x1 - wall.x2, wall.y2 - wall.y1) + turn + 0.1
        distance = wall.x1 * math.cos(direction) + wall.y1 * math.sin(direction)
        found = true_values(truth, {"hidden_wall_direction": direction, "hidden_wall_distance": distance})
        angle = found["hidden_wall_direction"]
        assert abs(angle - direction) < 0.2
        for x, y in ((wall.x1, wall.y1), (wall.x2, wall.y2)):
            assert x * math.cos(angle) + y * math.sin(angle) == pytest.approx(found["hidden_wall_distance"])


@pytest.mark.parametrize("way", ["mass_dependent_friction", "magnus_curl", "rotating_table", "contact_radius_error"])
def test_a_strength_is_the_true_value_but_for_its_sign(way: str) -> None:
    data = hidden(way, 0.08)
    strength = next(iter(known_effects()[way]().vanishes_at))
    assert abs(true_values(data.truth, {strength: 0.0})[strength]) == pytest.approx(0.08)


def test_what_happens_in_one_video_is_true_of_it_alone() -> None:
    kicked = hidden("external_impulse", 0.5).truth
    bodies = [f"impulse_{axis}[{body} in v0{k}]" for axis in "xy" for body in "abc" for k in (1, 2)]
    found = true_values(kicked, dict.fromkeys(bodies, 0.0))
    assert len(found) == 2
    assert math.hypot(*found.values()) == pytest.approx(0.5)
    lost = hidden("clock_error", 0.1).truth
    assert true_values(lost, {"lost_time[v01]": 0.0, "lost_time[v03]": 0.0}) == {"lost_time[v01]": 0.1}


@pytest.mark.parametrize("way", sorted(set(CATALOGUE) - WITHOUT))
def test_names_of_true_values_are_those_of_parameters(way: str) -> None:
    effect = known_effects()[way]()
    data = hidden(way, 0.06)
    found = true_values(data.truth, {parameter.name: 0.0 for parameter in effect.parameters})
    assert set(effect.vanishes_at) <= set(found)
    assert found


def test_bodies_have_no_number_of_their_own_that_would_hide_a_cause() -> None:
    setting = Setting(videos=1, bodies=3, frames=60)
    rough = hide(["mass_dependent_friction"], seed=1, effect_size=1.0, setting=setting).truth
    video = rough.videos[0]
    found = true_values(rough, {"friction_mass_exponent": 0.0})["friction_mass_exponent"]
    factors = video.friction / video.mass**found
    assert len(np.unique(np.round(factors, 9))) == 2  # what slides, and spheres
    assert hide(["magnus_curl"], seed=1, effect_size=1.0, setting=setting).tracks[0].angles is not None

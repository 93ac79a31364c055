"""Score tests of causes at the strength at which they vanish."""

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np
import pytest
from scipy.stats import chi2

from tests.discovery.fitted import fitted
from vrdp_prob.discovery.candidates import probes
from vrdp_prob.discovery.candidates.scores import (
    CauseScore,
    Largest,
    _largest,
    _one_sided,
    _p_value,
    happens_once,
    mends_any_course,
    score_causes,
)
from vrdp_prob.discovery.finding import UpperBound
from vrdp_prob.discovery.page.wording import bound_words
from vrdp_prob.discovery.residuals.linear import Score
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.discovery.selection.estimates import upper_bounds
from vrdp_prob.models.effects.clock_error import ClockError
from vrdp_prob.models.effects.contact_friction import ContactFriction
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.external_impulse import ExternalImpulse
from vrdp_prob.models.effects.hidden_obstacle import HiddenObstacle
from vrdp_prob.models.effects.linear_drag import LinearDrag
from vrdp_prob.models.effects.slip_to_roll import SlipToRoll
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt
from vrdp_prob.models.effects.wall import Wall
from vrdp_prob.models.model_file import known_effects
from vrdp_prob.scene import Tracks


def scored(
    way: str | None, effect_size: float = 5.0, *, seed: int, names: tuple[str, ...] | None = None
) -> dict[str, CauseScore]:
    _, fit = fitted(way, effect_size, seed=seed)
    present = {effect.name for effect in fit.model.effects}
    effects = [
        effect() for name, effect in known_effects().items() if name not in present and (names is None or name in names)
    ]
    return {one.effect.name: one for one in score_causes(fit, ResidualModel.of(fit), effects, seed=0)}


def test_a_null_gives_no_cause_a_small_p_value() -> None:
    found = scored(None, seed=1)
    assert len(found) >= 15
    assert min(one.p_value for one in found.values()) > 0.05 / 20 / 10  # false alarm of one seed in 200
    assert not any(one.sites for one in found.values())


def test_a_score_does_not_hang_on_how_many_worlds_are_simulated_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    names = ("friction_patch", "surface_tilt")
    whole = scored(None, seed=1, names=names)
    monkeypatch.setattr(probes, "AT_ONCE", 7)
    parts = scored(None, seed=1, names=names)
    assert [parts[name].chi_square for name in names] == [whole[name].chi_square for name in names]


def test_a_hidden_slope_has_the_largest_score_and_the_right_size() -> None:
    data, _ = fitted("surface_tilt", 3.0, seed=2)
    found = scored("surface_tilt", 3.0, seed=2, names=("surface_tilt", "linear_drag", "friction_patch"))
    first = next(iter(found.values()))
    assert first.effect.name == "surface_tilt"
    assert first.p_value < 1e-9
    slope = np.hypot(first.start["tilt_x"], first.start["tilt_y"])
    assert slope == pytest.approx(data.truth.causes[0].strength, rel=0.5)


@pytest.mark.slow
def test_what_videos_have_of_a_score_adds_up_and_a_slope_is_called_for_in_most() -> None:
    slope = scored("surface_tilt", seed=1)["surface_tilt"]
    assert sum(slope.by_video) == pytest.approx(slope.chi_square)
    assert min(slope.by_video) > 0
    assert len(slope.few_videos(1e-3)) > len(slope.by_video) / 2


@pytest.mark.parametrize(
    ("by_video", "p_value", "few"),
    [
        ((1.0, 22.0, 1.0, 2.0), 1e-6, [1]),
        ((16.0, 2.0, 0.0, 15.0), 1e-7, [0, 3]),
        ((14.0, 15.0, 16.0, 13.0), 1e-12, [2, 1, 0]),
        ((-3.0, 40.0, -2.0, -4.0), 1e-7, [1]),
        ((300.0, 900.0, 300.0, 300.0), 0.0, [1, 0, 2, 3]),
        ((1.0, 3000.0, 1.0, 1.0), 0.0, [1]),
    ],
    ids=["one", "two", "all alike", "one against the others", "all, beyond numbers", "one, beyond numbers"],
)
def test_few_videos_are_those_without_which_a_cause_is_not_called_for(
    by_video: tuple[float, ...], p_value: float, few: list[int]
) -> None:
    one = CauseScore(SurfaceTilt(), {}, chi_square=sum(by_video), degrees=2, p_value=p_value, by_video=by_video)
    assert one.few_videos(1e-3) == few


def test_a_strength_that_cannot_be_negative_is_tested_on_one_side() -> None:
    found = scored(None, seed=1, names=("linear_drag", "contact_friction"))
    for one in found.values():
        assert one.chi_square >= 0
        if one.chi_square == 0:
            assert one.p_value == 1.0
        assert all(value > 0 for value in one.start.values())


@pytest.mark.parametrize(
    ("gradient", "expected"),
    [
        ([2.0, 1.0], None),  # both are asked for
        ([-2.0, 1.0], [0.0, 1.0]),  # less than none of the first: the second as if there were no other
        ([-2.0, -1.0], [0.0, 0.0]),
        ([3.0, -0.5], [3.0, 0.0]),
    ],
)
def test_several_strengths_that_cannot_be_negative_are_each_tested_on_one_side(
    gradient: list[float], expected: list[float] | None
) -> None:
    free = Score(np.array(gradient), np.array([[1.0, 0.2], [0.2, 1.0]]))
    found = _one_sided(free, ["contact_friction", "wall_friction"], ContactFriction())
    if expected is None:
        assert found is free
        return
    assert found.estimate == pytest.approx(expected)
    assert found.chi_square == pytest.approx(sum(value**2 for value in expected))
    assert found.chi_square <= free.chi_square
    assert _one_sided(free, ["tilt_x", "tilt_y"], SurfaceTilt()) is free


@pytest.mark.parametrize(
    ("effect", "names", "correlation", "exact"),
    [
        (LinearDrag(), ["linear_drag"], 0.0, True),
        (SlipToRoll(), ["slip_friction"], 0.0, True),
        (SurfaceTilt(), ["tilt_x", "tilt_y"], 0.3, True),
        (ContactFriction(), ["contact_friction", "wall_friction"], 0.0, False),
        (ContactFriction(), ["contact_friction", "wall_friction"], -0.8, False),
        (ContactFriction(), ["contact_friction", "wall_friction"], 0.8, False),
    ],
)
def test_p_values_of_strengths_at_a_boundary_are_as_rare_as_they_say(
    effect: Effect, names: list[str], correlation: float, *, exact: bool
) -> None:
    generator = np.random.default_rng(0)
    information = np.array([[4.0, 4 * correlation], [4 * correlation, 4.0]])[: len(names), : len(names)]
    gradients = generator.multivariate_normal(np.zeros(len(names)), information, 4000)
    found = [_one_sided(Score(one, information), names, effect) for one in gradients]
    p_values = np.array([_p_value(one, names, effect) for one in found])
    for level in (0.2, 0.05, 0.01):
        share, error = (p_values < level).mean(), np.sqrt(level / len(p_values))
        assert share < level + 3 * error
        assert share > level - 3 * error or not exact


def test_what_slips_is_never_slowed_less_than_what_rolls() -> None:
    assert _one_sided(Score(np.array([-3.0]), np.eye(1)), ["slip_friction"], SlipToRoll()).chi_square == 0
    assert _p_value(Score(np.zeros(1), np.eye(1)), ["slip_friction"], SlipToRoll()) == 1.0


def test_the_p_value_of_a_single_place_is_that_of_chi_square() -> None:
    one = scored(None, seed=1, names=("surface_tilt",))["surface_tilt"]
    assert one.degrees == 2
    assert one.p_value == pytest.approx(float(chi2.sf(one.chi_square, 2)))


def test_a_scan_pays_for_looking_everywhere() -> None:
    one = scored(None, seed=1, names=("friction_patch",))["friction_patch"]
    assert one.p_value > 2 * float(chi2.sf(one.chi_square, one.degrees))


@pytest.mark.slow
def test_a_kick_is_found_in_its_video_at_its_body_and_time() -> None:
    data, fit = fitted("external_impulse", seed=2)
    number, (body, time) = next(
        (k, (video.laws.kick_body, video.laws.kick_time))
        for k, video in enumerate(data.truth.videos)
        if np.hypot(video.laws.kick_x, video.laws.kick_y) > 0
    )
    one = score_causes(fit, ResidualModel.of(fit), [ExternalImpulse()], seed=0)[0]
    assert one.sites
    assert (one.sites[0].video, one.sites[0].owner) == (number, body)
    assert one.sites[0].values["impulse_time"] == pytest.approx(time, abs=0.2)


def test_which_effects_happen_once() -> None:
    assert happens_once(ExternalImpulse())
    assert happens_once(ClockError())
    assert not happens_once(SurfaceTilt())


def test_a_jump_of_the_clock_bends_no_path_and_mends_no_course_of_events() -> None:
    assert mends_any_course(ExternalImpulse())
    assert not mends_any_course(ClockError())
    assert not mends_any_course(SurfaceTilt())


def test_a_cause_without_a_vanishing_strength_has_no_score() -> None:
    _, fit = fitted(seed=1)
    assert score_causes(fit, ResidualModel.of(fit), [Wall()], seed=0) == []


def test_bounds_lie_beyond_the_estimates() -> None:
    scores = scored(None, seed=1)
    for one in scores.values():
        for bound in upper_bounds(one.effect, one):
            values = [one.start, *(site.values for site in one.sites)]
            estimates = [abs(some[bound.parameter]) for some in values if bound.parameter in some]
            plain = bound.vanishes_at == 0.0 and one.effect.name != LinearDrag.name
            assert bound.bound is None or bound.bound > (max(estimates, default=0.0) if plain else 0.0)


def test_a_kick_may_be_as_large_as_where_it_would_fit_best() -> None:
    scores = scored(None, seed=1, names=("external_impulse", "material_friction", "slip_to_roll"))
    kick = scores["external_impulse"]
    assert not kick.sites  # chance makes as large ones
    assert all(bound.bound is not None and bound.bound > 0 for bound in upper_bounds(kick.effect, kick))
    known = {bound.parameter: bound for one in scores.values() for bound in upper_bounds(one.effect, one)}
    assert known["slip_friction"].vanishes_at == "rolling_resistance"


@pytest.mark.parametrize(
    ("cause", "strength"), [(Wall(), "hidden_wall_distance"), (ContactFriction(), "contact_friction")]
)
def test_what_has_no_score_has_no_bound(cause: Effect, strength: str) -> None:
    unit = next(one.unit for one in cause.parameters if one.name == strength)
    assert upper_bounds(cause, None)[0] == UpperBound(cause.name, strength, None, unit, told=0)


@pytest.mark.parametrize("cause", [Wall(), HiddenObstacle()], ids=lambda cause: cause.name)
def test_what_stands_in_the_way_is_bounded_by_where_bodies_were(cause: Effect) -> None:
    videos = fitted(seed=1)[1].tracks
    bounds = upper_bounds(cause, None, videos=videos)
    assert {bound.parameter: bound.bound for bound in bounds} == {n: one.size for n, one in cause.unmet(videos).items()}
    assert all(bound.measure and bound.unit == "m" for bound in bounds)


def test_of_several_places_the_largest_bound_counts_and_what_says_nothing_does_not() -> None:
    places = [(-0.5, 0.1), (0.2, 0.3), (9.0, 30.0), (0.0, 0.0)]
    (found,) = _largest([[("impulse_x", *one)] for one in places], ExternalImpulse()).values()
    assert (found.places, found.told) == (4, 2)
    assert found.bound == pytest.approx(0.2 + 0.3 * 1.645, abs=1e-3)
    (vague,) = _largest([[("impulse_x", *one)] for one in places[2:]], ExternalImpulse()).values()
    assert (vague.places, vague.told) == (2, 1)
    assert vague.bound == pytest.approx(9 + 30 * 1.645, abs=0.1)
    (nothing,) = _largest([[("impulse_x", *one)] for one in places[3:]], ExternalImpulse()).values()
    assert nothing == Largest(None, places=1, told=0)


def test_a_patch_may_be_larger_where_bodies_hardly_were_than_where_one_would_fit_best() -> None:
    one = scored(None, seed=1, names=("friction_patch",))["friction_patch"]
    (bound,) = upper_bounds(one.effect, one)
    assert 1 < bound.told < bound.places
    assert bound.bound is not None
    best = abs(one.start["patch_friction"])
    sd = best / np.sqrt(one.chi_square)
    assert bound.bound > 2 * (best + 1.645 * sd)
    assert f"at {bound.told} of {bound.places} places" in bound_words(bound)


class _Asked(ExternalImpulse):
    """A kick that remembers for which videos its times were asked."""

    asked: ClassVar[list[tuple[str, ...]]] = []

    def search_points(self, videos: Sequence[Tracks]) -> Sequence[Mapping[str, float]]:
        self.asked.append(tuple(one.video for one in videos))
        return super().search_points(videos)[:3]


def test_what_happens_once_in_a_video_is_looked_for_at_the_times_of_that_video_alone() -> None:
    _, fit = fitted(seed=1)
    (one,) = score_causes(fit, ResidualModel.of(fit), [_Asked()], seed=0)
    assert _Asked.asked == [(name,) for name in fit.videos]
    assert one.largest["impulse_x"].places <= 3 * len(fit.videos)

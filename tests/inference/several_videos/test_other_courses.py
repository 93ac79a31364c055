"""Videos of a joint fit are searched anew."""

from dataclasses import replace
from unittest.mock import Mock, create_autospec

import numpy as np
import pytest

from tests.inference.several_videos.videos import sliding
from vrdp_prob.inference.map_fit import MapFit
from vrdp_prob.inference.several_videos import fitting, second_look
from vrdp_prob.inference.several_videos.fitting import SharedFit, fit_together
from vrdp_prob.models.parameters import GRAVITY, SLIDING_FRICTION, WALL_RESTITUTION, belief_key
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.scene import Body, Shape, Tracks, Wall


def _fit(log_density: float) -> SharedFit:
    fit = create_autospec(SharedFit, instance=True)
    fit.joint, fit.fits = Mock(log_density=log_density), ["one course only", "", "", ""]
    return fit


@pytest.mark.parametrize(("gained", "is_taken"), [(20.0, True), (1.0, False)], ids=["better", "hardly better"])
@pytest.mark.parametrize(("among", "odd"), [(None, [1, 3]), ([0, 2, 3], [3])], ids=["all", "some"])
def test_other_courses_are_looked_for_in_halves_of_the_videos(
    gained: float, among: list[int] | None, odd: list[int], *, is_taken: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, half, both = _fit(100.0), _fit(100.0), _fit(100.0 + gained)
    first.mended.return_value, half.mended.return_value = half, both
    monkeypatch.setattr(fitting, "may_take_another_course", lambda fit: fit != "one course only")
    assert SharedFit.with_other_courses(first, seed=3, among=among) is (both if is_taken else first)
    first.mended.assert_called_once_with([2], seed=3, thorough=True)
    half.mended.assert_called_once_with(odd, seed=3, thorough=True)


def test_where_nobody_is_trusted_nothing_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    fit = fit_together([sliding(1), sliding(2), sliding(3)], model=PhysicsModel.base(), model_error=False)

    def told() -> PhysicsModel:
        return second_look._told(fit.fits, fit.structures, fit.model, None, [1], islands=False)

    assert told().beliefs["sliding_friction"].prior.sd < 0.5 * SLIDING_FRICTION.prior.sd
    monkeypatch.setattr(second_look, "trusted", lambda fits: [index != 1 for index in range(len(fits))])
    assert told() is fit.model


def _against_a_wall(seed: int, restitution: float = 0.7) -> Tracks:
    """A disc that slides against a wall and back, in closed form."""
    generator = np.random.default_rng(seed)
    radius, braking, speed = 0.2, 0.06 * GRAVITY, generator.uniform(1.5, 2.0)
    times = np.arange(40) / 25
    hit = (speed - np.sqrt(speed**2 - 2 * braking)) / braking
    since = np.maximum(times - hit, 0.0)
    back = restitution * (speed - braking * hit)
    since = np.minimum(since, back / braking)
    forth = speed * np.minimum(times, hit) - braking * np.minimum(times, hit) ** 2 / 2
    places = np.stack([forth - back * since + braking * since**2 / 2, np.zeros_like(times)], axis=-1)
    seen = places[:, None] + generator.normal(scale=0.003, size=(len(times), 1, 2))
    wall = Wall(1.0 + radius, -3.0, 1.0 + radius, 3.0, None)
    bodies = (Body("disc", Shape.CYLINDER, radius),)
    return Tracks.from_arrays(f"wall {seed}", bodies, times, seen, walls=(wall,))


def test_what_others_say_of_a_wall_is_told_with_what_they_say_of_the_table() -> None:
    fit = fit_together([_against_a_wall(seed) for seed in (1, 2, 3)], model=PhysicsModel.base(), model_error=False)
    told = second_look._told(fit.fits, fit.structures, fit.model, None, [0, 1], islands=False)
    name = belief_key(*fit.joint.numbers.keys[0])
    assert told.beliefs[name].prior.mean == pytest.approx(fit.joint.gaussian.mean[0], abs=1e-3)
    assert told.beliefs[name].prior.mean > WALL_RESTITUTION.prior.mean + 0.03  # bodies, too, take part of what is lost


@pytest.mark.parametrize(
    ("ratios", "groups"),
    [
        ([1.0, 1.3, 0.9, 1.0, 1.1, 1.0], [[1]]),
        ([1.0, 4.0, 0.9, 1.3, 1.1, 1.0], [[1], [3]]),
        ([3.0, 3.0, 3.1, 3.3, 3.2, 2.9], [[3, 4, 2]]),
        ([1.0, 1.1, 0.9, 1.0, 1.1, 1.0], []),
        ([0.9, 5.0, 1.0], [[1]]),
    ],
    ids=["a lost one", "one far worse than the others first", "half of them", "none", "one of three"],
)
def test_lost_videos_are_searched_in_groups(ratios: list[float], groups: list[list[int]]) -> None:
    assert second_look.lost_together(_fits(ratios)) == groups


@pytest.mark.parametrize(
    ("ratios", "loses"),
    [
        ([1.0, 1.3, 0.9, 1.0, 1.1, 1.0], True),
        ([1.0, 1.3, 0.9, 1.3, 1.1, 1.0], False),
        ([1.0, 1.3, 0.9], True),
        ([1.0] * 9 + [2.0] * 3, True),
        ([1.0, 1.1, 0.9], False),
        ([1.3], False),
    ],
    ids=["one of six", "two of six", "one of three", "three of twelve", "none", "the only one"],
)
def test_few_lost_videos_lack_their_course_rather_than_a_cause(ratios: list[float], *, loses: bool) -> None:
    assert second_look.loses_single_videos(_fits(ratios)) is loses


@pytest.mark.parametrize(
    ("ratios", "some", "more"),
    [([17.0, 1.5, 1.5, 1.8], [0], True), ([2.1, 1.6, 1.6, 1.6], [0], False), ([2.1, 0.9, 0.9, 0.9], [0], True)],
    ids=["far off", "a little worse than the others", "the only one"],
)
def test_lost_videos_outweigh_others_by_what_they_leave_beyond_the_noise(
    ratios: list[float], some: list[int], *, more: bool
) -> None:
    fits = _fits(ratios)
    assert second_look.outweigh(fits, some) is more
    fits[0].clues.tracks.seen = np.ones((1, 2), dtype=bool)
    fits[1].clues.tracks.seen = np.ones((400, 2), dtype=bool)
    assert second_look.outweigh(fits, some) is (ratios[1] < 1.0)


def test_what_has_one_course_only_is_not_lost() -> None:
    assert second_look.lost_videos(_fits([2.0, 1.0, 3.0], bodies=1)) == []


def test_no_video_of_a_null_is_lost() -> None:
    fit = fit_together([sliding(1), sliding(2), sliding(3)], model=PhysicsModel.base(), model_error=False)
    assert fit.with_lost_courses(seed=0) is fit


@pytest.mark.parametrize(
    ("better", "single", "searches"), [(0, False, 1), (1, False, 2), (5, False, 3), (0, True, 3), (1, True, 3)]
)
def test_lost_videos_are_searched_as_long_as_that_finds_more_and_single_ones_several_times(
    better: int, searches: int, *, single: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fitting, "loses_single_videos", lambda _fits: single)
    monkeypatch.setattr(fitting, "lost_together", lambda _fits: [[2]])
    monkeypatch.setattr(fitting, "lost_videos", lambda _fits: [2])
    chain = [_fit(float(number)) for number in range(better + 1)]
    for one, after in zip(chain, [*chain[1:], chain[-1]], strict=True):
        one.mended.return_value = after
    assert SharedFit.with_lost_courses(chain[0], seed=5) is chain[min(better, 3)]
    asked = [call for one in chain for call in one.mended.call_args_list]
    assert [(call.args, call.kwargs["seed"]) for call in asked] == [(([2],), 5 + k) for k in range(searches)]


@pytest.mark.parametrize("loses", [True, False])
def test_where_the_worst_are_not_found_the_other_lost_ones_are_searched_and_none_may_be_lost_for_it(
    *, loses: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = _fit(0.0), _fit(10.0)
    second.fits = ["found"]
    first.mended.side_effect = lambda videos, **_how: second if videos == [3] else first
    second.mended.return_value = second
    monkeypatch.setattr(fitting, "loses_single_videos", lambda _fits: False)
    monkeypatch.setattr(fitting, "lost_together", lambda _fits: [[1], [3]])
    monkeypatch.setattr(
        fitting, "lost_videos", lambda fits: ([1, 0] if loses else [1]) if fits == ["found"] else [1, 3]
    )
    assert SharedFit.with_lost_courses(first, seed=0) is (first if loses else second)


def _fits(ratios: list[float], *, bodies: int = 2) -> list[Mock]:
    """Fits of videos with such residuals in units of the noise, in which nothing happens."""

    def tracks() -> Mock:
        return Mock(bodies=("",) * bodies, walls=(), seen=np.ones((20, bodies), dtype=bool))

    return [
        Mock(spec=MapFit, misfit=Mock(ratio=ratio), clues=Mock(tracks=tracks()), rollout=Mock(events=()))
        for ratio in ratios
    ]


@pytest.mark.parametrize(
    ("yielding", "worse", "is_taken"),
    [(True, 1.005, True), (True, 1.05, False), (False, 1.005, False), (False, 0.9, True)],
    ids=["as well", "worse", "not to yield", "better"],
)
def test_a_video_that_is_to_yield_takes_what_goes_with_the_others_where_that_explains_it_as_well(
    worse: float, *, yielding: bool, is_taken: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    fit = fit_together([sliding(1), sliding(2), sliding(3)], model=PhysicsModel.base(), model_error=False)
    single = fit.fits[1]
    believed: list[bool] = []

    def fitted(_tracks: object, model: PhysicsModel, *_given: object, **_how: object) -> MapFit:
        believed.append(model is not fit.model)
        return replace(single, misfit=replace(single.misfit, residual_sd=worse * single.misfit.residual_sd))

    monkeypatch.setattr(second_look, "fit_map", fitted)
    monkeypatch.setattr(second_look, "explained", lambda _fits: False)
    found = second_look.look_again(fit.fits, [1], fit.model, None, seed=0, looks=2, yielding=yielding, thorough=True)
    assert (found[1].misfit != single.misfit) is is_taken
    assert found[0] is fit.fits[0]
    assert believed[0]
    assert all(believed) is yielding

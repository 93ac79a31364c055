"""Own numbers of a video that follow the shared ones, and videos that are fitted anew with what the others say."""

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.discovery.data_set import draw
from tests.inference.several_videos.videos import colliding, sliding
from vrdp_prob.inference.infer import default_model
from vrdp_prob.inference.map_fit import MapFit, NoWorldError, fit_map
from vrdp_prob.inference.runs.parallel import several_processes
from vrdp_prob.inference.search.plan import IN_DOUBT, TURNING, FitPlan
from vrdp_prob.inference.several_videos import second_look
from vrdp_prob.inference.several_videos.fitting import fit_together
from vrdp_prob.inference.several_videos.following import _too_slow, follow
from vrdp_prob.inference.several_videos.linking import LinkedVideo
from vrdp_prob.inference.several_videos.parts import stream
from vrdp_prob.inference.several_videos.second_look import doubtful, look_again
from vrdp_prob.models.coordinates import Coordinate, Coordinates
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.parameters import SLIDING_FRICTION, Prior, Transform
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.unknowns import Held
from vrdp_prob.scene import Tracks

SHARPNESS = 1e5
"""One over the standard deviation of the direction that is known best."""


@dataclass(frozen=True)
class Valley(LinkedVideo):
    """Two own numbers in a narrow, bent valley that moves with the shared number; behind an edge all is worse."""

    edge: float = np.inf

    @property
    def data(self) -> Any:
        return SimpleNamespace(residuals=self._residuals, coordinates=self.likelihood.coordinates)

    def _residuals(self, points: np.ndarray) -> np.ndarray:
        shared, first, second = points.T
        beyond = 30.0 * (first > self.edge)
        sharp = SHARPNESS * (first - np.sin(3 * shared) - second**2 / 2)
        return np.stack([sharp, second - shared, 0.1 * first, beyond], axis=1)


class Cliff(Valley):
    """One own number follows the shared one, the other would rather be beyond the edge behind which all is worse."""

    def _residuals(self, points: np.ndarray) -> np.ndarray:
        shared, first, second = points.T
        return np.stack([SHARPNESS * (second - shared), first - 2.0, 30.0 * (first > self.edge)], axis=1)


def valley(edge: float = np.inf) -> Valley:
    entries = tuple(Coordinate(name, None, Transform.IDENTITY, Prior(0.0, 1.0)) for name in ("shared", "a", "b"))
    one = np.zeros(1, dtype=np.int64)
    likelihood = Likelihood(sliding(0), PhysicsModel.base(), Coordinates(entries, {}))
    return Valley(likelihood, one, one, np.zeros(1), edge=edge)


def test_own_numbers_follow_along_a_narrow_bent_valley() -> None:
    found = follow(valley(), np.zeros(1), np.zeros(2), np.array([1.0]))
    assert found.arrived
    first, second = found.local
    assert first == pytest.approx(np.sin(3) + second**2 / 2, abs=1e-6)
    # along the valley `second` is at the least of (second - 1)^2 + (first / 10)^2
    assert second - 1 + 0.01 * first * second == pytest.approx(0.0, abs=1e-3)


def test_they_stop_before_an_edge_behind_which_all_is_worse() -> None:
    found = follow(valley(edge=0.5), np.zeros(1), np.zeros(2), np.array([0.4]))
    assert not found.arrived
    found = follow(valley(edge=0.5), np.zeros(1), np.zeros(2), np.array([0.1]))
    assert found.arrived
    assert found.local[0] < 0.5


def test_a_way_is_gone_without_mending_where_mending_leads_over_an_edge() -> None:
    video = Cliff(**vars(valley(edge=0.0)))
    found = follow(video, np.zeros(1), np.array([-1e-3, 0.0]), np.array([1.0]))
    assert found.arrived
    first, second = found.local
    assert first < 0.0
    assert second == pytest.approx(1.0, abs=1e-6)


def test_a_way_is_given_up_by_its_pace_and_the_steps_that_are_left() -> None:
    assert _too_slow([0.015] * 6, 24)
    assert not _too_slow([0.015] * 6, 94)
    assert not _too_slow([0.03, 0.6, 0.3, 0.03, 0.03, 0.03], 24)
    assert not _too_slow([0.001] * 5, 24)


def test_a_video_that_is_worse_than_the_others_is_fitted_anew() -> None:
    videos = [colliding(0), colliding(1), sliding(2)]
    fits = [fit_map(one, default_model(), stream(0, one.video), model_error=False) for one in videos]
    assert not doubtful(fits)
    assert look_again(fits, [], default_model(), None, seed=0) == fits
    spoilt = replace(fits[1], misfit=replace(fits[1].misfit, residual_sd=3 * fits[1].misfit.residual_sd))
    assert doubtful([fits[0], spoilt, fits[2]]) == [1]
    found = look_again([fits[0], spoilt, fits[2]], [1], default_model(), None, seed=0)
    assert (found[0], found[2]) == (fits[0], fits[2])
    assert found[1].misfit.residual_sd == pytest.approx(fits[1].misfit.residual_sd, rel=0.02)
    assert found[1].likelihood.model == default_model()


@pytest.mark.parametrize(("lost", "like_noise"), [(True, 0.0), (False, TURNING.like_noise)])
def test_cubes_of_a_video_that_was_lost_are_turned_on_where_it_is_explained(
    lost: bool, like_noise: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    fits = [
        fit_map(one, default_model(), stream(0, one.video), plan=IN_DOUBT, model_error=False)
        for one in (colliding(0), sliding(1), sliding(2))
    ]
    sd = 1.3 if lost else 1.0
    fits[0] = replace(fits[0], misfit=replace(fits[0].misfit, residual_sd=sd * fits[0].misfit.noise_sd))
    made: list[FitPlan] = []

    def made_anew(*_given: object, plan: FitPlan, **_how: object) -> MapFit:
        made.append(plan)
        return fits[0]

    monkeypatch.setattr(second_look, "fit_map", made_anew)
    with several_processes(1):
        look_again(fits, [0], default_model(), None, seed=0, thorough=True)
    assert [plan.like_noise for plan in made if plan.yaws] == [like_noise]


@pytest.mark.parametrize("yielding", [True, False])
def test_a_look_at_a_video_that_no_world_is_like_leaves_its_fit(
    *, yielding: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A wall that is tried may stand where a body begins."""
    fits = [
        fit_map(one, default_model(), stream(0, one.video), plan=IN_DOUBT, model_error=False)
        for one in (colliding(0), sliding(1))
    ]
    fits[0] = replace(fits[0], misfit=replace(fits[0].misfit, residual_sd=3 * fits[0].misfit.residual_sd))
    looks: list[str] = []

    def impossible(tracks: Tracks, *_given: object, **_how: object) -> MapFit:
        looks.append(tracks.video)
        raise NoWorldError("no world")

    monkeypatch.setattr(second_look, "fit_map", impossible)
    with several_processes(1):
        found = look_again(fits, [0], default_model(), None, seed=0, yielding=yielding)
    assert looks
    assert found[0] is fits[0]


@pytest.mark.parametrize(
    "left",
    [(0.9, 0.8, 0.7, 0.6, 0.5), (1.0, 0.8, 0.4, 0.8, 0.9), (1.0, 1.0, 0.1, 0.1, 0.7), (0.9, 0.9, 0.5, 0.9, 0.9)],
    ids=["ever better", "one way settled", "two ways settled", "settled on the way"],
)
def test_looks_side_by_side_find_what_they_find_one_after_the_other(
    left: tuple[float, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    fit = fit_map(colliding(0), default_model(), stream(0, "v0"), plan=IN_DOUBT, model_error=False)
    made: list[int] = []

    def looked_at(_self: object, asked: tuple[object, int]) -> MapFit:
        made.append(asked[1])
        return replace(fit, misfit=replace(fit.misfit, residual_sd=left[asked[1]] * fit.misfit.residual_sd))

    monkeypatch.setattr(second_look._Look, "_made", looked_at)
    ways = (*[(look % 2 == 0, IN_DOUBT) for look in range(4)], (True, TURNING))
    search = second_look._Look(default_model(), default_model(), 0.0, 0, ways)
    doubted = second_look._Doubted(fit, far_worse=False, turned_on=False, held={})
    found, looks = [], []
    for at_once in (False, True):
        made.clear()
        (better,) = search.looked([doubted], at_once=at_once)
        found.append(None if better is None else better.misfit.residual_sd)
        looks.append(sorted(made))
    assert found[0] == found[1]
    assert looks[0] == looks[1]


def test_what_is_held_in_a_video_is_held_in_a_new_search_of_it() -> None:
    videos = [colliding(0), colliding(1)]
    held: list[Held] = [{}, {(SLIDING_FRICTION.name, None): 0.25}]
    fits = [
        fit_map(one, default_model(), stream(0, one.video), model_error=False, held=kept)
        for one, kept in zip(videos, held, strict=True)
    ]
    coordinates = fits[1].likelihood.coordinates
    assert (SLIDING_FRICTION.name, None) not in coordinates.places
    assert coordinates.defaults[SLIDING_FRICTION.name] == 0.25
    spoilt = replace(fits[1], misfit=replace(fits[1].misfit, residual_sd=3 * fits[1].misfit.residual_sd))
    found = look_again([fits[0], spoilt], [1], default_model(), None, seed=0, held=held)
    assert found[1] is not spoilt
    assert found[1].likelihood.coordinates.places == coordinates.places
    assert found[1].likelihood.coordinates.defaults[SLIDING_FRICTION.name] == 0.25


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 4, 5])
def test_videos_with_collisions_in_a_row_are_all_explained_together(seed: int) -> None:
    """Own numbers that are known to a millionth, and single videos whose own fit takes a wrong course of events."""
    data = draw([], seed=seed)
    fit = fit_together(data.tracks, model=default_model(), model_error=False)
    assert max(one.misfit.residual_sd for one in fit.fits) < 1.08 * data.truth.measurement.noise
    mean, sd = fit.joint.gaussian.mean, fit.joint.gaussian.sd
    place = [name for name, _ in fit.joint.numbers.keys].index("air_drag")
    assert abs(mean[place] - np.log(data.truth.videos[0].laws.drag)) < 4 * sd[place]
    if seed == 1 and not fit.joint.converged:
        pytest.xfail("one video is at an edge where two orders of events meet; the climb ends 9 nats below the top")
    assert fit.joint.converged

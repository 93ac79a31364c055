"""What leaving a video out says, how models are weighed by it, and how far off forecasts are."""

from collections.abc import Sequence
from dataclasses import astuple, replace
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from tests.discovery.fitted import fitted
from tests.discovery.stand_ins import start_with
from vrdp_prob.discovery.candidates.first_guess import FirstGuess, Site
from vrdp_prob.discovery.candidates.scores import score_causes
from vrdp_prob.discovery.finding import HeldOut, VideoErrors
from vrdp_prob.discovery.residuals.held_out import all_but_each, cavities, left_out
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.discovery.selection import estimates, trials
from vrdp_prob.discovery.selection.estimates import may_vanish
from vrdp_prob.discovery.selection.forecast import SEEN_SHARE, _forecast, error_ratios, held_out
from vrdp_prob.discovery.selection.gains import gain, gains, weights
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.inference.map_fit import MapFit
from vrdp_prob.inference.several_videos import fitting
from vrdp_prob.inference.several_videos.agreement import following_ones
from vrdp_prob.inference.several_videos.climb_state import ImpossibleStartError
from vrdp_prob.inference.several_videos.fitting import SharedFit, fit_together
from vrdp_prob.inference.several_videos.joint_fit import expand
from vrdp_prob.inference.several_videos.parts import link_fits
from vrdp_prob.inference.several_videos.second_look import doubtful
from vrdp_prob.models.effects.clock_error import LOST_AT, LOST_TIME, ClockError
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.external_impulse import ExternalImpulse
from vrdp_prob.models.effects.linear_drag import LinearDrag
from vrdp_prob.models.effects.material_friction import MaterialFriction
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt
from vrdp_prob.models.parameters import ANGULAR_DRAG
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.unknowns import Held
from vrdp_prob.scene import Tracks


@pytest.mark.slow
def test_a_video_is_as_probable_as_the_evidence_with_it_over_that_without_it() -> None:
    data, fit = fitted(seed=2)
    others = fit_together(data.tracks[1:], model=fit.model, model_error=False)
    left_out = next(iter(cavities(fit).values()))
    assert left_out.log_density == pytest.approx(fit.log_evidence - others.log_evidence, abs=1.5)


def test_a_video_that_knows_a_number_best_does_not_drown_what_the_others_say() -> None:
    prior, known, videos = np.eye(2), np.array([1.0, 0.3]), [1e17, 2.0, 3.0]
    curvatures = [strength * np.outer(known, known) for strength in videos]
    for without, left in zip(([2.0, 3.0], [1e17, 3.0], [1e17, 2.0]), all_but_each(prior, curvatures), strict=True):
        np.testing.assert_allclose(left, prior + sum(without) * np.outer(known, known), rtol=1e-12)
    others = all_but_each(prior, curvatures)[0]
    cavity = left_out(0.0, np.zeros(2), np.sqrt(1e17) * known[None], others, np.zeros(2))
    information = 1 + 5 * known @ known
    assert cavity.log_density == pytest.approx(np.log(information / (1e17 * known @ known)) / 2, abs=0.01)
    assert np.linalg.eigvalsh(cavity.covariance) == pytest.approx([1 / information, 1.0])


def test_what_the_others_say_is_less_sharp_than_what_all_say() -> None:
    _, fit = fitted(seed=1)
    for cavity in cavities(fit).values():
        assert (np.sqrt(np.diag(cavity.covariance)) >= fit.joint.gaussian.sd * (1 - 1e-6)).all()


def test_a_right_cause_gains_and_its_removal_loses_the_same() -> None:
    data, fit = fitted("surface_tilt", 3.0, seed=2)
    base = Trial((), fit)
    score = score_causes(fit, ResidualModel.of(fit), [SurfaceTilt()], seed=0)[0]
    found = base.with_cause(score)
    assert found is not None
    assert found.names == ("surface_tilt",)
    gained = found.brought(base)
    assert gained > 30.0
    first = found.fit.joint.log_density
    found = found.mended(doubtful(found.fit.fits), seed=0)
    assert found.fit.joint.log_density >= first
    values = dict(zip(found.fit.joint.numbers.names, found.fit.joint.gaussian.mean, strict=True))
    truth = data.truth.videos[0].laws
    assert (values["tilt_x"], values["tilt_y"]) == pytest.approx((truth.tilt_x, truth.tilt_y), rel=0.1, abs=2e-4)
    again = found.without(found.causes[0])
    assert again.names == ()
    assert abs(again.brought(base)) < 0.1 * gained


def test_equal_models_have_equal_weights_and_a_hopeless_one_none() -> None:
    _, fit = fitted(seed=1)
    base = Trial((), fit)
    hopeless = replace(base, choices={"handicap": np.full(len(fit.fits), 30.0)})
    found = weights([base, base, hopeless], [0.0, 0.0, 0.0], np.random.default_rng(0))
    assert found[:2] == pytest.approx([0.5, 0.5])
    assert found[2] < 1e-3
    prior = weights([base, base], [0.0, -np.log(3.0)], np.random.default_rng(0))
    assert prior == pytest.approx([0.75, 0.25])


def test_forecasts_of_a_null_are_as_far_off_as_they_say() -> None:
    _, fit = fitted(seed=1)
    joint = fit.joint
    points = [joint.point(index) for index in range(len(joint.videos))]
    found = held_out(joint.videos, points, list(cavities(fit).values()))
    assert 0.001 < found.rmse < 0.2
    assert found.rmse_end is not None
    assert found.coverage_50 < found.coverage_90
    assert found.coverage_90 > 0.6
    assert sum(found.pit) == pytest.approx(1.0)
    assert len(found.pit) == 10
    assert found.pit[0] + found.pit[-1] < 0.5


def test_errors_are_compared_video_by_video() -> None:
    def predicted(*errors: float | None) -> HeldOut:
        return HeldOut(1.0, None, None, 0.5, 0.9, (), tuple(VideoErrors(one, None, one) for one in errors))

    before, after = (0.1, 4.0, 0.01, None, 1.0, 2.0), (0.05, 2.0, 0.005, None, 0.5, 1.0)
    halved = error_ratios(predicted(*before), predicted(*after))
    assert set(halved) == {"rmse", "rmse_end"}
    assert astuple(halved["rmse"]) == pytest.approx((0.5, 0.5, 0.5))
    mixed = error_ratios(predicted(1, 1, 1, 1, 1), predicted(0.1, 0.4, 0.5, 0.6, 2.0))["rmse"]
    assert mixed.ratio == pytest.approx(0.5)
    assert 0.1 <= mixed.q025 < 0.45
    assert 0.55 < mixed.q975 <= 2.0
    few = error_ratios(predicted(1, 1, None), predicted(0.5, 0.5, 0.5))["rmse"]
    assert few.ratio == 0.5
    assert np.isnan([few.q025, few.q975]).all()
    assert not error_ratios(predicted(None, None), predicted(0.5, 0.5))


def test_a_model_lacks_what_would_explain_its_lost_videos() -> None:
    _, fit = fitted(seed=1)
    assert Trial((), fit).lacking == 0
    strayed, *others = fit.fits
    worse = replace(strayed, misfit=replace(strayed.misfit, residual_sd=3.0 * strayed.misfit.noise_sd))
    count = strayed.clues.tracks.seen.sum()
    assert Trial((), replace(fit, fits=(worse, *others))).lacking == pytest.approx(2 * count * np.log(3.0))


def test_only_what_is_not_there_may_as_well_vanish() -> None:
    _, null = fitted(seed=1)
    _, tilted = fitted("surface_tilt", 3.0, seed=2)
    for fit, cause, may in ((null, SurfaceTilt(), True), (tilted, SurfaceTilt(), False), (null, LinearDrag(), False)):
        score = score_causes(fit, ResidualModel.of(fit), [cause], seed=0)[0]
        found = Trial((), fit).with_cause(score)
        assert found is not None
        assert found.may_vanish(cause, np.ones(len(fit.fits))) is may  # a drag vanishes infinitely far away


@pytest.mark.parametrize(("shifts", "may"), [((-3.0, -3.0), True), ((-3.0, 0.0), False)], ids=["alike", "one"])
def test_a_friction_that_is_less_for_every_material_alike_is_none_of_a_material(
    shifts: tuple[float, float], *, may: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(estimates, "reaches", lambda *_given: {})
    _, null = fitted(seed=1)
    cause = MaterialFriction()
    (score,) = score_causes(null, ResidualModel.of(null), [cause], seed=0)
    found = Trial((), null).with_cause(score)
    assert found is not None
    joint = found.fit.joint
    mean = joint.gaussian.mean.copy()
    places = [place for place, (name, _) in enumerate(joint.numbers.keys) if name in cause.vanishes_at]
    mean[places] = shifts
    shifted = replace(joint, gaussian=replace(joint.gaussian, mean=mean))
    assert _may_vanish(replace(found, fit=replace(found.fit, joint=shifted)), cause) is may


def test_where_all_bodies_are_of_one_material_their_friction_is_none_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(estimates, "reaches", lambda *_given: {})
    _, null = fitted(seed=1)
    cause = MaterialFriction()
    alike = [replace(one, bodies=tuple(replace(body, material="") for body in one.bodies)) for one in null.tracks]
    assert _may_vanish(Trial((), fit_together(alike, model=null.model.with_effect(cause), model_error=False)), cause)


def _may_vanish(trial: Trial, cause: MaterialFriction) -> bool:
    return may_vanish(trial.fit, cause, unexplained=trial.unexplained, overdispersion=np.ones(3))


@pytest.mark.slow
def test_a_body_that_comes_after_the_fitted_frames_is_not_predicted() -> None:
    data, before = fitted(seed=1)
    late = []
    for tracks in data.tracks:
        positions = tracks.positions.copy()
        positions[: 3 * len(positions) // 4, 0] = np.nan
        late.append(Tracks.from_arrays(tracks.video, tracks.bodies, tracks.times, positions))
    fit = fit_together(late, model=before.model, model_error=False)
    videos = fit.joint.videos
    for index, cavity in enumerate(cavities(fit).values()):
        frame = videos[index].likelihood.observations.frame
        body = videos[index].likelihood.observations.body
        predicted = (frame >= int(SEEN_SHARE * len(late[index].times))) & (body != 0)
        assert len(_forecast(videos[index], fit.joint.point(index), cavity).squares) == predicted.sum()


def test_a_new_search_of_a_video_never_makes_a_fit_worse() -> None:
    _, fit = fitted("surface_tilt", 3.0, seed=2)
    trial = Trial((), fit)
    assert trial.mended([], seed=0) is trial
    assert trial.mended([1], seed=0).fit.joint.log_density >= fit.joint.log_density


@pytest.mark.parametrize(("before", "after", "loses"), [(1.0, 1.5, True), (1.5, 1.5, False), (1.0, 1.1, False)])
def test_a_law_loses_most_videos_that_explains_them_no_more(before: float, after: float, *, loses: bool) -> None:
    _, fit = fitted("surface_tilt", 3.0, seed=2)

    def trial(ratio: float) -> Trial:
        worse = [replace(one.misfit, residual_sd=ratio * one.misfit.noise_sd) for one in fit.fits]
        return Trial((), replace(fit, fits=tuple(replace(a, misfit=b) for a, b in zip(fit.fits, worse, strict=True))))

    assert trial(after).loses_most_of(trial(before)) is loses


@pytest.mark.parametrize(("cause", "keeps"), [(ExternalImpulse(), True), (ClockError(), False)], ids=["kicks", "clock"])
def test_videos_with_kicks_keep_the_course_on_which_these_were_found(
    cause: Effect, *, keeps: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, fit = fitted("surface_tilt", 3.0, seed=2)
    better = replace(fit)
    monkeypatch.setattr(SharedFit, "mended", lambda _fit, _lost, **_how: better)
    monkeypatch.setattr(SharedFit, "with_other_courses", lambda _fit, **_how: better)
    trial = Trial((cause,), fit)
    assert (trial.mended([1], seed=0) is trial) is keeps
    assert (trial.with_other_courses([1], seed=0) is trial) is keeps


@pytest.mark.parametrize(
    ("cause", "converged", "explains", "gained", "asked"),
    [
        (SurfaceTilt(), False, True, [3.0, -1.5, 0.5, -9.0, 2.0, 1.0, 1.0, 1.0], [3, 1]),
        (SurfaceTilt(), False, True, [3.0, -9.0, 0.5, -1.5, -2.0, 50.0, 1.0, 1.0], None),
        (SurfaceTilt(), False, True, [3.0, -0.5, 0.5, 0.0, 2.0, 1.0, 1.0, 1.0], []),
        (SurfaceTilt(), False, False, [3.0, -1.5, 0.5, -9.0, 2.0, 1.0, 1.0, 1.0], None),
        (SurfaceTilt(), True, True, [3.0, -9.0, 0.5, -1.5, 2.0, 1.0, 1.0, 1.0], None),
        (ExternalImpulse(), False, True, [3.0, -9.0, 0.5, -1.5, 2.0, 1.0, 1.0, 1.0], None),
    ],
    ids=["two", "more than a quarter", "none", "most are not explained", "at the top", "kicks"],
)
def test_videos_that_may_hold_a_cause_back_yield_where_the_climb_broke_off(
    cause: Effect,
    gained: list[float],
    asked: list[int] | None,
    *,
    converged: bool,
    explains: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    _, fit = fitted("surface_tilt", 3.0, seed=2)
    searches: list[list[int]] = []

    def mended(fit: SharedFit, videos: list[int], *, seed: int, thorough: bool, yielding: bool) -> SharedFit:
        assert yielding is not thorough
        assert seed == 4
        searches.append(videos)
        return fit

    monkeypatch.setattr(trials, "explained", lambda _fits: explains)
    monkeypatch.setattr(SharedFit, "mended", mended)
    base = Trial((), fit)
    trial = Trial((cause,), replace(fit, fits=((*fit.fits,) * 8)[:8], joint=replace(fit.joint, converged=converged)))
    density = property(lambda one: np.array(gained) if one is trial else np.zeros(8))
    monkeypatch.setattr(Trial, "fitted_density", density)
    assert trial.freed(base, seed=4) is trial
    assert searches == ([] if asked is None else [asked])


@pytest.mark.parametrize(("brings", "is_better"), [(9.0, True), (-9.0, False)], ids=["more", "less"])
def test_a_cause_that_was_freed_stays_so_where_it_brings_more(
    brings: float, *, is_better: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, fit = fitted("surface_tilt", 3.0, seed=2)
    broken_off = replace(fit, joint=replace(fit.joint, converged=False))
    monkeypatch.setattr(SharedFit, "mended", lambda _fit, _videos, **_how: fit)
    monkeypatch.setattr(trials, "explained", lambda _fits: True)
    monkeypatch.setattr(trials, "with_own_population", lambda fit: fit)
    base, trial = Trial((), fit), Trial((SurfaceTilt(),), broken_off)
    values = property(lambda one: np.full(2, brings if one.causes and one is not trial else 0.0))
    monkeypatch.setattr(Trial, "fitted_density", values)
    monkeypatch.setattr(Trial, "_fallen_from", lambda *_given: [1])
    assert (trial.freed(base, seed=0) is not trial) is is_better


def test_a_course_that_another_fit_has_found_is_taken_from_it(monkeypatch: pytest.MonkeyPatch) -> None:
    _, fit = fitted("surface_tilt", 3.0, seed=2)
    joint = fit.joint
    lost = replace(fit, joint=replace(joint, log_density=joint.log_density - 50.0), fits=tuple(map(replace, fit.fits)))
    taken: list[list[bool]] = []

    def linked(fits: Sequence[MapFit], *given: Any) -> Any:
        taken.append([one is other for one, other in zip(fits, fit.fits, strict=True)])
        return link_fits(fits, *given)

    monkeypatch.setattr(fitting, "link_fits", linked)
    found = lost.with_courses_of(fit, [1])
    assert taken == [[False, True, False]]
    assert found.joint.log_density > joint.log_density - 0.1
    better = replace(fit, joint=replace(joint, log_density=joint.log_density + 50.0))
    assert better.with_courses_of(fit, [1]) is better


@pytest.mark.parametrize(
    ("follow", "asked"),
    [([[2, 0]], [[2, 0]]), ([[2]], [[2, 0], [2]]), ([], [[2, 0], [2]])],
    ids=["both", "one of them", "none"],
)
def test_videos_that_are_more_probable_in_another_fit_take_its_course(
    follow: list[list[int]], asked: list[list[int]], monkeypatch: pytest.MonkeyPatch
) -> None:
    _, fit = fitted("surface_tilt", 3.0, seed=2)
    better, calls = replace(fit), list[list[int]]()

    def with_courses_of(_fit: SharedFit, _other: SharedFit, chosen: list[int]) -> SharedFit:
        calls.append(list(chosen))
        return better if calls[-1] in follow else fit

    monkeypatch.setattr(SharedFit, "with_courses_of", with_courses_of)
    trial, other = Trial((), fit), Trial((), fit)
    vars(trial)["unexplained"] = vars(other)["unexplained"] = Mock(gains=np.zeros(3))
    monkeypatch.setattr(
        Trial, "fitted_density", property(lambda self: np.array([8.0, 4.0, 90.0]) * (1.0 if self is other else 0.0))
    )
    assert (trial.with_courses_of(other).fit is better) is bool(follow)
    assert calls == asked
    assert other.with_courses_of(trial) is other


def test_what_is_held_in_a_video_is_held_when_it_is_searched_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    _, fit = fitted("surface_tilt", 3.0, seed=2)
    at, time = (LOST_AT.name, None), (LOST_TIME.name, None)
    held: list[Held] = [{at: None, time: None}, {at: 0.41}, {at: None, time: None}]
    clocked = fit.under(fit.extended(ClockError()), held=held, model_error=False)
    places = clocked.joint.videos[1].likelihood.coordinates.places
    assert time in places
    assert at not in places
    lost = replace(clocked, joint=replace(clocked.joint, log_density=clocked.joint.log_density - 50.0))

    def searched(fits: Sequence[MapFit], *_given: object, held: Sequence[Held], **_how: object) -> list[MapFit]:
        assert list(held) == [one.held for one in lost.structures]
        return [fits[0], replace(fits[1]), fits[2]]

    monkeypatch.setattr(fitting, "look_again", searched)
    found = lost.mended([1], seed=0)
    assert found is not lost
    assert [one.held for one in found.structures] == held
    assert found.joint.videos[1].likelihood.coordinates.places == places
    assert found.joint.videos[1].likelihood.coordinates.defaults[LOST_AT.name] == 0.41


def test_a_video_is_searched_beside_others_that_have_followed_what_they_agree_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    _, fit = fitted("surface_tilt", 3.0, seed=2)
    joint = fit.joint
    elsewhere = joint.gaussian.mean + 0.3 * (np.array(joint.numbers.names) == "sliding_friction")
    points = [joint.point(index)[None] for index in range(len(fit.fits))]
    followed = following_ones(joint.numbers, joint.videos, points, elsewhere)
    locals_ = tuple(replace(one, centre=own) for one, own in zip(joint.gaussian.locals, followed, strict=True))
    strayed = replace(fit, joint=replace(joint, gaussian=replace(joint.gaussian, mean=elsewhere, locals=locals_)))
    handed: list[MapFit] = []

    def looked(fits: Sequence[MapFit], *_: object, **__: object) -> list[MapFit]:
        handed.extend(fits)
        return list(fits)

    monkeypatch.setattr(fitting, "look_again", looked)
    assert strayed.mended([1], seed=0) is strayed
    for index in (0, 2):
        video = joint.videos[index]
        assert expand(video, *video.split(handed[index].point)).promised < 1.0
    assert (handed[1].point == strayed.joint.point(1)).all()


@pytest.mark.slow
def test_gains_are_divided_by_the_overdispersion_of_each_video() -> None:
    _, fit = fitted("surface_tilt", 3.0, seed=2)
    score = score_causes(fit, ResidualModel.of(fit), [SurfaceTilt()], seed=0)[0]
    base = Trial((), fit)
    found = base.with_cause(score)
    assert found is not None
    divisor = np.array([1.0, 4.0, 100.0])
    assert gains(found, base, divisor) == pytest.approx(gains(found, base) / divisor)
    assert gain(found, base, divisor)[0] == pytest.approx(float((gains(found, base) / divisor).sum()))


def test_a_video_searched_anew_may_share_a_number_that_no_other_one_has(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    _, fit = fitted("surface_tilt", 3.0, seed=2)
    assert ANGULAR_DRAG.name in fit.joint.numbers.names
    held = fit.under(fit.model, held=[{(ANGULAR_DRAG.name, None): None}] * len(fit.fits), model_error=False)
    assert ANGULAR_DRAG.name not in held.joint.numbers.names
    lacking = replace(held, structures=tuple(replace(one, held={}) for one in held.structures))
    monkeypatch.setattr(fitting, "look_again", lambda fits, *_, **__: [fits[0], fit.fits[1], *fits[2:]])
    found = lacking.mended([1], seed=0)
    assert found.joint.log_density >= lacking.joint.log_density
    assert found is lacking or ANGULAR_DRAG.name in found.joint.numbers.names


@pytest.mark.slow
def test_a_kick_that_can_be_in_one_place_only_acts_there() -> None:
    """A single place is no choice among several, whose logarithm was taken for that nothing happens."""
    _, fit = fitted("external_impulse", 3.0, seed=2)
    site = Site(1, 0, {"impulse_time": 1.0, "impulse_x": 0.1, "impulse_y": 0.0}, 50.0, 1e-9)
    score = FirstGuess(ExternalImpulse(), {}, (site,))
    trial = Trial((), fit).with_cause(score)
    assert trial is not None
    assert trial.acting(trial.causes[-1]) == [1]


def test_a_model_without_a_cause_is_fitted_from_the_beginning_where_no_world_begins_as_it_is(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    _, fit = fitted("surface_tilt", 3.0, seed=2)
    tilted = Trial((), fit).with_cause(start_with(SurfaceTilt()))
    assert tilted is not None
    begun: list[str] = []

    def under(*_given: object, **_how: object) -> SharedFit:
        raise ImpossibleStartError

    def fit_together(_tracks: object, *, model: PhysicsModel, **_how: object) -> SharedFit:
        begun.append(model.name)
        return fit

    monkeypatch.setattr(SharedFit, "under", under)
    monkeypatch.setattr(trials, "fit_together", fit_together)
    monkeypatch.setattr(trials, "with_own_population", lambda fit: fit)
    found = tilted.without(*tilted.causes)
    assert found.causes == ()
    assert found.fit is fit
    assert begun == [fit.model.name]
    with pytest.raises(ImpossibleStartError):
        replace(tilted, choices={"external_impulse": np.ones(3)}).without(*tilted.causes)

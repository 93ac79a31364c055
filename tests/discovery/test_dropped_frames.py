"""Frames that are missing again and again are seen in the tracks, and the fit that knows of them explains the rest."""

from functools import cache

import numpy as np
import pytest

from tests.discovery.data_set import DataSet, Wanted, draw
from tests.discovery.fitted import SMALL
from tests.discovery.hidden import ROUGH
from tests.discovery.scenes import Setting
from vrdp_prob.discovery.candidates.dropped_frames import Dropped, dropped_frames
from vrdp_prob.discovery.checks.battery import run_checks
from vrdp_prob.discovery.selection.estimates import estimates, upper_bounds
from vrdp_prob.discovery.selection.extensions import Extensions
from vrdp_prob.discovery.selection.gains import gain
from vrdp_prob.discovery.selection.leavings import Leavings
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.inference import default_model, infer
from vrdp_prob.inference.several_videos.fitting import fit_together
from vrdp_prob.models.effects.dropped_frames import FRAME_TIME, MOST_DROPPED, DroppedFrames
from vrdp_prob.scene import Body, Shape, Tracks

DROPPED = 4


@cache
def hidden(seed: int) -> DataSet:
    wanted = Wanted("frames_dropped_often", strength=DROPPED)
    return draw([wanted], seed=seed, setting=SMALL)


def true_places(data: DataSet, video: int) -> list[float]:
    truth = data.truth.videos[video]
    assert truth.late is not None
    missing = np.diff(np.round(truth.late * truth.frame_rate)).astype(int)
    return [float(place) for place in np.repeat((truth.stamps[1:] + truth.stamps[:-1]) / 2, missing)]


@pytest.mark.parametrize("seed", range(1, 4))
def test_tracks_show_most_of_them_and_none_elsewhere(seed: int) -> None:
    data = hidden(seed)
    found = dropped_frames(data.tracks)
    places = [true_places(data, video) for video in range(len(found))]
    assert all(set(np.round(one.after, 6)) <= set(np.round(true, 6)) for one, true in zip(found, places, strict=True))
    assert sum(len(one.after) for one in found) > 0.5 * sum(map(len, places))
    assert {round(one.frame_time, 6) for one in found} == {round(1 / data.truth.videos[0].frame_rate, 6)}


@pytest.mark.parametrize(
    ("way", "strength"),
    [(None, 0.0), ("external_impulse", 0.3), ("wall_met_often", 0.3), ("contact_radius_error", 0.3)],
)
def test_outliers_dropouts_kicks_and_contacts_are_none(way: str | None, strength: float) -> None:
    for seed in (1, 2):
        wanted = [] if way is None else [Wanted(way, strength=strength)]
        data = draw(wanted, seed=seed, setting=Setting(videos=4, bodies=3), measurement=ROUGH)
        assert dropped_frames(data.tracks) == []


def test_a_single_one_is_left_to_the_other_way_of_the_cause_and_uneven_stamps_are_believed() -> None:
    data = hidden(1)
    full, *_ = data.tracks
    assert dropped_frames([full]) != []
    places = true_places(data, 0)
    assert dropped_frames([Dropped(tuple(places[1:]), 1 / 25).restamped(full)]) == []
    assert dropped_frames([Dropped(tuple(places), 1 / 25).restamped(full)]) == []


def stamped_evenly(late: np.ndarray) -> Tracks:
    """Tracks of a body that glides, of which each frame is late by so many frames."""
    times = np.arange(len(late)) / 25
    positions = np.stack([1.6 * (times + late / 25), 0 * times], axis=1)[:, None]
    noise = np.random.default_rng(0).normal(0, 0.002, positions.shape)
    return Tracks.from_arrays("v", (Body("a", Shape.CYLINDER, radius=0.1),), times, positions + noise)


def test_more_than_a_video_may_lack_are_something_else() -> None:
    late = np.cumsum(np.arange(400) % 8 == 7)
    assert late[-1] > MOST_DROPPED
    assert dropped_frames([stamped_evenly(late)]) == []


@pytest.mark.parametrize("lasting", [True, False], ids=["all later ones are as late", "later ones are not"])
def test_frames_that_come_early_and_late_hide_no_other(*, lasting: bool) -> None:
    late = np.zeros(100)
    for place in (30, 70):
        late[place:] += lasting
        late[place - 1 : place + 1] += [-0.38, 0.38] if not lasting else 0.0
    found = dropped_frames([stamped_evenly(late)])
    assert [len(one.after) for one in found] == ([2] if lasting else [])


@pytest.fixture(scope="module")
def found() -> tuple[Trial, Trial]:
    fit = fit_together(hidden(1).tracks, model=default_model(), model_error=False)
    base = Trial((), fit)
    extensions = Extensions(Leavings((DroppedFrames(),), 0), 6.0, lambda *_: None)
    trial = extensions.with_dropped_frames(base, dropped_frames(fit.tracks))
    assert trial is not None
    return base, trial


@pytest.mark.slow
def test_the_fit_finds_those_that_tracks_do_not_show_and_explains_the_rest(found: tuple[Trial, Trial]) -> None:
    base, trial = found
    difference, error = gain(trial, base)
    assert difference > 300
    assert difference > 3 * error
    assert not any(check.significant for check in run_checks(trial.fit, seed=0))
    assert all(part.misfit.ratio < 1.1 for part in trial.fit.fits)
    values = estimates(trial.fit, trial.causes[0])
    interval = values[FRAME_TIME.name]
    assert abs(interval.mean - 1 / 25) < 4 * interval.sd < 0.1 / 25
    for index, name in enumerate(trial.fit.videos):
        places = {round(value.mean, 6) for key, value in values.items() if key.endswith(f"[{name}]")}
        assert places <= set(np.round(true_places(hidden(1), index), 6))


@pytest.mark.slow
def test_it_explains_every_video_and_is_gone_without_the_cause(found: tuple[Trial, Trial]) -> None:
    _, trial = found
    (cause,) = trial.causes
    assert len(trial.acting(cause)) == len(trial.fit.videos)
    assert not trial.patches(cause)
    without = trial.without(cause)
    assert without.names == ()
    assert not any(structure.held for structure in without.fit.structures)


def test_nothing_is_inferred_of_frames_that_nobody_found_missing() -> None:
    (tracks, *_) = draw([], seed=1, setting=SMALL).tracks
    model = default_model().with_effect(DroppedFrames(), [tracks])
    posterior = infer(tracks, sampler="laplace", model=model, seed=0, hand_on=False)
    assert not [name for name in posterior.data.data_vars if str(name).startswith("dropped_after")]
    assert upper_bounds(DroppedFrames(), None) == []

"""Lost frames are found where they were lost, though the time of the loss has no slope."""

import numpy as np
import pytest

from tests.discovery.fitted import fitted, with_cause
from vrdp_prob.discovery.selection.estimates import estimates
from vrdp_prob.discovery.selection.gains import gain
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.models.effects.clock_error import ClockError

SIZE, SEED = 6.0, 1


@pytest.fixture(scope="module")
def found() -> tuple[Trial, Trial]:
    return with_cause("clock_error", SIZE, ClockError(), seed=SEED)


@pytest.mark.slow
def test_the_lost_time_is_that_of_the_truth(found: tuple[Trial, Trial]) -> None:
    data, _ = fitted("clock_error", SIZE, seed=SEED)
    base, trial = found
    assert gain(trial, base)[0] > 100
    values = estimates(trial.fit, ClockError())
    lost = [one for name, one in values.items() if name.startswith("lost_time")]
    assert len(lost) == len(trial.fit.videos)
    strength = data.truth.causes[0].strength
    assert np.mean([abs(one.mean - strength) < 4 * one.sd for one in lost]) > 0.5


@pytest.mark.slow
def test_the_time_of_the_loss_is_told_with_the_interval_between_two_frames(found: tuple[Trial, Trial]) -> None:
    _, trial = found
    values = {name: one for name, one in estimates(trial.fit, ClockError()).items() if name.startswith("lost_at")}
    assert len(values) == len(trial.fit.videos)
    for index, (name, one) in enumerate(values.items()):
        times = trial.fit.joint.videos[index].likelihood.tracks.times
        assert trial.fit.videos[index] in name
        frame = int(np.searchsorted(times, one.mean))
        assert times[frame - 1] < one.q025 < one.q975 < times[frame]


def test_frames_lost_in_every_video_explain_them_all(found: tuple[Trial, Trial]) -> None:
    _, trial = found
    (cause,) = trial.causes
    assert len(trial.acting(cause)) == len(trial.fit.videos)
    assert not trial.patches(cause)


def test_without_the_cause_nothing_is_held_any_more(found: tuple[Trial, Trial]) -> None:
    _, trial = found
    assert all(structure.held for structure in trial.fit.structures)
    without = trial.without(trial.causes[0])
    assert not any(structure.held for structure in without.fit.structures)
    assert without.names == ()

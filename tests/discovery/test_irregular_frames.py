"""Frames that come early or late are found by their one jitter, and told from motion that the model lacks."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.optimize import minimize

from tests.discovery.fitted import fitted, with_cause
from tests.discovery.scenes import Setting
from vrdp_prob.discovery.candidates.scores import score_causes
from vrdp_prob.discovery.checks.battery import run_checks
from vrdp_prob.discovery.residuals.jitter import alike_in_neighbours, jitter
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.discovery.selection.estimates import estimates
from vrdp_prob.discovery.selection.gains import gain
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.models.effects.clock_error import ClockError
from vrdp_prob.models.effects.irregular_frames import IrregularFrames

SIZE, SEED = 3.0, 2
NULLS = 24
LARGEST = 0.1 / 25
"""A tenth of the time in s between two frames."""


@pytest.fixture(scope="module")
def found() -> tuple[Trial, Trial]:
    return with_cause("irregular_frames", SIZE, IrregularFrames(), seed=SEED)


@pytest.mark.slow
def test_the_jitter_is_that_of_the_truth(found: tuple[Trial, Trial]) -> None:
    data, fit = fitted("irregular_frames", SIZE, seed=SEED)
    base, trial = found
    strength = data.truth.causes[0].strength
    promised = jitter(ResidualModel.of(fit))
    assert promised is not None
    assert promised.value == pytest.approx(strength, rel=0.15)
    assert strength < promised.bound < 1.5 * strength
    (one,) = estimates(trial.fit, IrregularFrames()).values()
    assert abs(one.mean - strength) < 4 * one.sd < 0.3 * strength
    difference, error = gain(trial, base)
    assert difference > 100
    assert difference > 3 * error


def test_nothing_is_left_and_no_frame_is_late_like_its_neighbours(found: tuple[Trial, Trial]) -> None:
    _, trial = found
    assert not any(check.significant for check in run_checks(trial.fit, seed=0))
    assert alike_in_neighbours(trial.fit) > 0.01
    assert not trial.patches(trial.causes[0])


def test_it_explains_more_than_lost_frames(found: tuple[Trial, Trial]) -> None:
    _, trial = found
    _, lost = with_cause("irregular_frames", SIZE, ClockError(), seed=SEED)
    assert gain(trial, lost)[0] > 100


def test_without_the_cause_the_jitter_is_gone(found: tuple[Trial, Trial]) -> None:
    _, trial = found
    without = trial.without(trial.causes[0])
    assert without.names == ()
    assert without.fit.value("frame_jitter") is None


def test_motion_that_the_model_lacks_is_no_jitter() -> None:
    _, fit = fitted("linear_drag", 6.0, seed=1, setting=Setting(videos=3, bodies=2, frames=60))
    (score,) = score_causes(fit, ResidualModel.of(fit), [IrregularFrames()], seed=0)
    trial = Trial((), fit).with_cause(score)
    assert trial is not None
    found = trial.fit.value("frame_jitter")
    assert found is not None
    assert found > LARGEST
    assert alike_in_neighbours(trial.fit) < 1e-4
    assert trial.patches(trial.causes[0])


def test_frames_that_are_on_time_have_none() -> None:
    """The statistic against its own law: half a chi-square, so a tenth of nulls have p below 0.1 at most."""
    _, fit = fitted(None, seed=1)
    model = ResidualModel.of(fit)
    generator = np.random.default_rng(0)
    nulls = [jitter(model), *(jitter(with_noise(model, generator)) for _ in range(NULLS))]
    assert all(one is not None and one.value < one.bound < LARGEST for one in nulls)
    assert sum(one is not None and one.p_value < 0.1 for one in nulls) <= 7  # 2.5 expected, more in one of 200 at most


def test_what_is_left_against_beliefs_is_no_noise_of_less_than_nothing() -> None:
    _, fit = fitted(None, seed=1)
    model = ResidualModel.of(fit)
    against = [replace(video.linear, residuals=video.linear.residuals.copy()) for video in model.videos]
    for linear in against:
        linear.residuals[linear.data :] += 100.0
    videos = tuple(replace(video, linear=one) for video, one in zip(model.videos, against, strict=True))
    with np.errstate(all="raise"):
        found = jitter(ResidualModel(replace(model.linear, videos=tuple(against)), videos))
    assert found is not None
    assert np.isfinite([found.value, found.chi_square, found.p_value, found.bound]).all()


@pytest.mark.parametrize("bodies", [1, 3])
def test_the_statistic_is_that_of_the_dense_gaussian(bodies: int) -> None:
    """Beside a jitter of six noise sd, where frames taken one by one would leave less than no noise."""
    _, fit = fitted(None, seed=1, setting=Setting(videos=3, bodies=bodies, frames=50))
    generator = np.random.default_rng(1)
    model = with_noise(ResidualModel.of(fit), generator)
    fastest = max(float(np.sqrt((video.late_frames() ** 2).sum(axis=0).max())) for video in model.videos)
    true = 6.0 / fastest
    jittering = [
        replace(
            video,
            linear=replace(
                video.linear,
                residuals=video.linear.residuals
                + video.linear.padded(video.late_frames() @ (true * generator.standard_normal((50, 1))))[:, 0],
            ),
        )
        for video in model.videos
    ]
    model = ResidualModel(replace(model.linear, videos=tuple(one.linear for one in jittering)), tuple(jittering))
    found = jitter(model)
    assert found is not None
    assert found.value == pytest.approx(true, rel=0.25)
    assert found.value < found.bound < 1.5 * true
    value, chi_square = dense(model, true)
    assert found.value == pytest.approx(value, rel=0.05)
    assert found.chi_square == pytest.approx(chi_square, rel=0.05)


def dense(model: ResidualModel, start: float) -> tuple[float, float]:
    """The jitter, and twice the gain in log density, with every video's covariance written out, and no priors."""
    parts = []
    for video, left in zip(model.videos, model.left, strict=True):
        data = video.linear.data
        basis = null_space(video.linear.own[:data].T, rcond=1e-6)
        parts.append((basis.T @ left[:data], basis.T @ video.late_frames()))

    def cost(logs: np.ndarray) -> float:
        variance, ratio = np.exp(logs[0]), np.exp(2 * logs[1])
        total = 0.0
        for left, rows in parts:
            values = np.linalg.eigvalsh(rows @ rows.T)
            covariance = variance * (np.eye(len(left)) + ratio * rows @ rows.T)
            total += float(np.log(variance * (1 + ratio * np.maximum(values, 0.0))).sum())
            total += float(left @ np.linalg.solve(covariance, left))
        return total / 2

    best = minimize(cost, [0.0, np.log(start)], method="Nelder-Mead", options={"xatol": 1e-3, "fatol": 1e-3})
    count = sum(len(left) for left, _ in parts)
    plain = count * (1 + np.log(sum(float(left @ left) for left, _ in parts) / count)) / 2
    return float(np.exp(best.x[1] + best.x[0] / 2)), 2 * float(plain - best.fun)


def with_noise(model: ResidualModel, generator: np.random.Generator) -> ResidualModel:
    """The same model where pure noise was measured."""
    videos = [
        replace(video, linear=replace(video.linear, residuals=video.drawn(1, generator)[:, 0]))
        for video in model.videos
    ]
    return ResidualModel(replace(model.linear, videos=tuple(one.linear for one in videos)), tuple(videos))

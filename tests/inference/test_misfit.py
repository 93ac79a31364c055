"""What a fit leaves is told from gross outliers, whatever the noise is taken for."""

from dataclasses import replace

import numpy as np
import pytest

from tests.inference.generator import observe
from tests.inference.test_infer import chain, with_outliers
from vrdp_prob.inference import default_model
from vrdp_prob.inference.map_fit import MapFit, fit_map
from vrdp_prob.inference.search.clues import Clues
from vrdp_prob.inference.search.misfit import Misfit, judge, tempered
from vrdp_prob.models.noise import NoiseFamily
from vrdp_prob.scene import Tracks


def fitted(tracks: Tracks, noise: NoiseFamily | None = None) -> MapFit:
    return fit_map(tracks, default_model(), np.random.default_rng(0), noise=noise)


@pytest.mark.parametrize("seed", [2, 3])
def test_outliers_neither_hide_a_wrong_course_nor_count_as_one(seed: int) -> None:
    fit = fitted(with_outliers(observe(chain(), noise=0.005, seed=seed), 0.05))
    assert fit.likelihood.noise is NoiseFamily.STUDENT_T
    assert fit.search.agreed
    assert fit.misfit.ratio == pytest.approx(1.0, abs=0.15)
    assert fit.misfit.fits
    astray = fit.point.copy()
    astray[fit.likelihood.coordinates.places["mass", 1]] += 0.5
    assert judge(fit.likelihood, astray, fit.clues).ratio > 3


@pytest.mark.slow
def test_a_push_that_no_model_knows_shows_among_outliers() -> None:
    tracks = observe(chain(), noise=0.005, seed=4)
    positions = tracks.positions.copy()
    late = np.maximum(tracks.times - 1.5, 0.0)
    positions[:, 0, 1] += 0.4 * late**2
    pushed = Tracks.from_arrays("pushed", tracks.bodies, tracks.times, positions)
    fit = fitted(with_outliers(pushed, 0.05))
    assert fit.misfit.outliers
    assert "Gaussian and larger there" in fit.misfit.sentences[-1]
    assert not fit.misfit.fits
    assert fit.misfit.error_acceleration is not None


@pytest.mark.parametrize("stated", [False, True])
def test_a_small_push_is_told_whether_or_not_the_noise_is_stated(stated: bool) -> None:
    tracks = observe(chain(), noise=0.02, seed=4)
    positions = tracks.positions.copy()
    positions[:, 0, 1] += 0.01 * np.maximum(tracks.times - 1.5, 0.0) ** 2
    covariance = np.tile(0.02**2 * np.eye(2), (*tracks.seen.shape, 1, 1)) if stated else None
    pushed = Tracks.from_arrays("pushed", tracks.bodies, tracks.times, positions, position_covariance=covariance)
    misfit = fitted(pushed).misfit
    assert misfit.error_acceleration is not None
    assert not misfit.large
    assert not misfit.fits
    assert f"{misfit.ratio:.2f} times the measurement noise, and smoothly" in misfit.sentences[0]
    assert ("either errors of measurement are alike" in misfit.sentences[0]) is stated


def test_student_t_noise_that_gives_way_to_an_unknown_acceleration_is_told() -> None:
    tracks = observe(chain(), noise=0.02, seed=4)
    positions = tracks.positions.copy()
    positions[:, 0, 1] += 0.01 * np.maximum(tracks.times - 1.5, 0.0) ** 2
    fit = fitted(Tracks.from_arrays("pushed", tracks.bodies, tracks.times, positions), NoiseFamily.STUDENT_T)
    assert fit.likelihood.model_error is not None
    assert fit.likelihood.noise is NoiseFamily.GAUSSIAN
    assert not fit.misfit.outliers
    assert "not Student-t as was asked for" in fit.misfit.sentences[-1]


@pytest.mark.parametrize(
    ("residual_sd", "words"),
    [(0.0104, "no more than measurement noise (0.01 m), but"), (0.012, "0.012 m, 1.20 times the measurement noise,")],
)
def test_residuals_that_are_larger_than_the_noise_are_not_said_to_be_within_it(residual_sd: float, words: str) -> None:
    smooth = Misfit(residual_sd, 0.01, False, 0.3, "0", 0.012, error_acceleration=0.1, error_duration=0.2)
    assert words in smooth.sentences[0]


@pytest.mark.parametrize(("stated", "fits"), [(True, True), (False, False)])
def test_errors_of_a_camera_that_stay_within_its_stated_noise_are_no_misfit(stated: bool, fits: bool) -> None:
    smooth = Misfit(0.008, 0.01, stated, 0.85, "0", 0.008, 0, True, 0.1, 0.2)
    assert smooth.fits is fits
    assert bool(smooth.sentences) is not fits


def test_gaussian_noise_counts_what_stands_out() -> None:
    fit = fitted(observe(chain(), noise=0.005, seed=2))
    assert fit.misfit.ratio == pytest.approx(1.0, abs=0.15)
    astray = fit.clues.tracks.positions.copy()
    astray[30:33, 0] += 0.1
    tracks = fit.clues.tracks
    moved = Tracks.from_arrays("mistimed", tracks.bodies, tracks.times, astray)
    judged = judge(replace(fit.likelihood, tracks=moved), fit.point, fit.clues)
    squares = fit.misfit.residual_sd**2 + 3 * 0.1**2 / tracks.seen.sum()
    assert judged.residual_sd == pytest.approx(np.sqrt(squares), rel=0.05)


def test_gaussian_noise_that_was_asked_for_counts_outliers_and_says_so() -> None:
    tracks = with_outliers(observe(chain(), noise=0.005, seed=2), 0.05)
    misfit = fitted(tracks, NoiseFamily.GAUSSIAN).misfit
    assert misfit.large
    assert "as was asked for" in misfit.sentences[-1]


def test_residuals_without_outliers_stay_as_they_are() -> None:
    tracks = observe(chain(), noise=0.01, dropout=0.0, frames=60, seed=3)
    clues = Clues.of(tracks)
    noise = 0.01 * np.random.default_rng(0).standard_normal(tracks.positions.shape)
    residuals = np.where(clues.outliers[..., None], np.nan, noise)
    assert np.array_equal(tempered(residuals, clues), residuals, equal_nan=True)
    residuals[30, 1] += 1.0
    changed = (tempered(residuals, clues) != residuals).any(axis=-1) & np.isfinite(residuals[..., 0])
    assert np.argwhere(changed).tolist() == [[30, 1]]


def struck(size: float, *, seed: int, share: float = 0.05) -> Tracks:
    """A chain of collisions, some of whose positions are off by so many standard deviations of the noise."""
    tracks, generator = observe(chain(), noise=0.005, seed=seed), np.random.default_rng(seed)
    angle = generator.uniform(0, 2 * np.pi, tracks.seen.shape)
    off = (generator.random(tracks.seen.shape) < share)[..., None]
    positions = tracks.positions + off * 0.005 * size * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return Tracks.from_arrays("struck", tracks.bodies, tracks.times, positions)


@pytest.mark.parametrize("size", [8, 12])
def test_outliers_that_only_a_fit_shows_are_no_error_of_the_model(size: float) -> None:
    fit = fitted(struck(size, seed=1))
    assert Clues.of(struck(size, seed=1)).outliers.sum() <= 2
    assert fit.likelihood.noise is NoiseFamily.STUDENT_T
    assert fit.misfit.fits
    assert fit.misfit.outliers > 5
    assert "lie far off" in fit.misfit.sentences[0]


def test_noise_that_differs_from_position_to_position_as_it_is_stated_is_no_misfit() -> None:
    tracks, generator = observe(chain(), noise=0.003, seed=1), np.random.default_rng(1)
    rough = generator.random(tracks.seen.shape) < 0.15
    positions = tracks.positions + np.where(rough, 0.02, 0.0)[..., None] * generator.normal(size=tracks.positions.shape)
    covariance = np.where(rough, 0.003**2 + 0.02**2, 0.003**2)[..., None, None] * np.eye(2)
    fit = fitted(Tracks.from_arrays("v", tracks.bodies, tracks.times, positions, position_covariance=covariance))
    assert fit.misfit.fits
    assert fit.misfit.ratio == pytest.approx(1.0, abs=0.1)
    assert fit.misfit.error_acceleration is None
    assert fit.likelihood.noise is NoiseFamily.GAUSSIAN

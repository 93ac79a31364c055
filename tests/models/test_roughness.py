"""Noise of tracks that are computed, rounded, or on a line."""

import numpy as np
import pytest

from tests.inference.generator import Scene, observe
from vrdp_prob.inference import infer
from vrdp_prob.inference.search.clues import Clues
from vrdp_prob.models.roughness import noise_scale, untold_noise
from vrdp_prob.scene import Body, Shape, Tracks

RADIUS = 0.2
HEAD_ON = Scene(
    (Shape.CYLINDER, Shape.CYLINDER),
    np.array([[-1.5, 0.0], [0.5, 0.0]]),
    np.array([[1.8, 0.0], [0.0, 0.0]]),
    np.array([1.0, 1.0]),
    np.array([0.9, 0.8]),
    np.full(2, RADIUS),
    np.full(2, 0.1),
)


def seen(noise: float = 1e-13) -> Tracks:
    return observe(HEAD_ON, noise=noise, frames=60, seed=1)


def moved(tracks: Tracks, positions: np.ndarray) -> Tracks:
    return Tracks.from_arrays(tracks.video, tracks.bodies, tracks.times, positions)


def rounded(decimals: int) -> Tracks:
    return moved(seen(), seen().positions.round(decimals))


def on_a_line(noise: float) -> Tracks:
    return moved(seen(), seen(noise).positions * [1.0, 0.0])


def test_noise_that_can_be_seen_is_told() -> None:
    assert untold_noise(seen(0.0005)) is None
    assert untold_noise(moved(seen(), seen(0.004).positions.round(3))) is None


@pytest.mark.parametrize("spoilt", ["frames lost", "frames at odd times"])
def test_frames_that_come_unevenly_do_not_look_like_noise(spoilt: str) -> None:
    generator = np.random.default_rng(0)
    even = np.arange(200) / 50
    lost = generator.random(200) < 0.4
    times = even[~lost] if spoilt == "frames lost" else even + generator.uniform(0, 0.018, 200)
    positions = np.stack([1.1 * times - 0.15 * times**2, 0.3 * times], axis=1)
    positions += generator.normal(0, 0.002, positions.shape)
    tracks = Tracks.from_arrays("v", (Body("a", Shape.SPHERE, 0.1),), times, positions[:, None])
    assert noise_scale(tracks) == pytest.approx(0.002, rel=0.25)


def test_noise_that_is_stated_differently_for_each_position_is_that_of_the_middle() -> None:
    generator = np.random.default_rng(0)
    times = np.arange(300) / 50
    sd = np.where(generator.random(300) < 0.2, 0.02, 0.003)
    positions = np.stack([0.5 * times, 0.3 * times], axis=1) + sd[:, None] * generator.normal(size=(300, 2))
    covariance = (sd**2)[:, None, None, None] * np.eye(2)
    body = (Body("a", Shape.SPHERE, 0.1),)
    told = Tracks.from_arrays("v", body, times, positions[:, None], position_covariance=covariance)
    assert noise_scale(told) == pytest.approx(0.003, rel=0.1)
    assert noise_scale(Tracks.from_arrays("v", body, times, positions[:, None])) > 0.0045


@pytest.mark.parametrize(
    "covariance",
    [np.full((2, 2), np.nan), np.zeros((2, 2)), np.array([[1.0, np.nan], [np.nan, 1.0]])],
    ids=["unknown", "nothing", "half unknown"],
)
def test_a_covariance_that_says_nothing_is_none(covariance: np.ndarray) -> None:
    plain = seen(0.003)
    shape = (*plain.seen.shape, 2, 2)
    told = Tracks.from_arrays(
        "v", plain.bodies, plain.times, plain.positions, position_covariance=np.full(shape, covariance)
    )
    assert (told.position_covariance, told.position_variance) == (None, None)
    assert noise_scale(told) == noise_scale(plain)
    assert Clues.of(told).moving == Clues.of(plain).moving
    assert Clues.of(told).position_sd == pytest.approx(Clues.of(plain).position_sd)


def test_computed_positions_get_a_small_noise() -> None:
    assert untold_noise(seen()) == pytest.approx(1e-3 * 0.05 * RADIUS)


@pytest.mark.parametrize("decimals", [2, 3])
def test_rounded_positions_get_what_was_rounded_off(decimals: int) -> None:
    assert untold_noise(rounded(decimals)) == pytest.approx(10.0**-decimals / np.sqrt(12), rel=0.3)


def test_a_coordinate_that_is_kept_does_not_count_as_measured() -> None:
    assert untold_noise(on_a_line(0.0005)) == pytest.approx(0.0005, rel=0.3)
    half_at_rest = np.concatenate([seen(0.0005).positions, np.full((60, 2, 2), 3.0)], axis=1)
    bodies = (*seen().bodies, Body("c", Shape.SPHERE, 0.1), Body("d", Shape.SPHERE, 0.1))
    half_at_rest[:, 3] = -3.0
    tracks = Tracks.from_arrays("v", bodies, seen().times, half_at_rest)
    assert noise_scale(tracks) == pytest.approx(0.0005, rel=0.3)
    assert untold_noise(tracks) is None


@pytest.mark.parametrize(("tracks", "error"), [(seen(), 1e-4), (rounded(3), 0.005), (on_a_line(0.0005), 0.004)])
def test_the_mass_ratio_of_such_tracks_is_right_and_the_noise_is_told(tracks: Tracks, error: float) -> None:
    posterior = infer(tracks, sampler="laplace", hand_on=False)
    (pair,) = posterior.mass_ratios()
    assert pair.summary.mean == pytest.approx(1.0, abs=error)
    assert pair.summary.q05 - pair.summary.sd < 1.0 < pair.summary.q95 + pair.summary.sd
    assert posterior.misfit.fits
    assert any("do not tell their noise" in warning for warning in posterior.warnings)

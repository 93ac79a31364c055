"""Steps that trade rates of slowing down leave a density as it is, and go to and fro along an L-shaped ridge.

Two bodies: coordinates are the logarithms of a shared friction, of the bodies' ratios to it and of a drag, then their
velocities. What the tracks tell are the sums of friction and drag, and velocities given these.
"""

import numpy as np
import pytest
import torch
from jaxtyping import Float
from numpy.random import RandomState

from vrdp_prob.inference.draws.mode import Mode
from vrdp_prob.inference.draws.samples import Gaussian
from vrdp_prob.inference.laplace import sample_laplace
from vrdp_prob.inference.samplers.curved_gaussian import CurvedGaussian
from vrdp_prob.inference.samplers.mixture import Mixture
from vrdp_prob.inference.samplers.rate_steps import RateSteps
from vrdp_prob.inference.samplers.straightening import Rates

DIRECTIONS = np.array([[1, 1, 0, 0, 0, 0], [1, 0, 1, 0, 0, 0], [0, 0, 0, 1, 0, 0]], dtype=float)
PRIOR_SD = np.array([0.5, 0.4, 0.4, 1.0, 3.0, 3.0])
WEIGHT = np.array([0.7, 1.2])
"""What a drag does to each body, in units of friction."""
SUM = np.exp([0.0, 0.0]) + WEIGHT
SUM_SD, VELOCITY_SD, LAG = 0.1, 0.05, 0.3


def log_density(points: Float[np.ndarray, "point 6"]) -> Float[np.ndarray, "point"]:
    rates = np.exp(points @ DIRECTIONS.T)
    sums = rates[:, :2] + rates[:, 2:] * WEIGHT
    residuals = [points / PRIOR_SD, (sums - SUM) / SUM_SD, (points[:, 4:] - LAG * rates[:, 2:]) / VELOCITY_SD]
    return -sum((part**2).sum(axis=1) for part in residuals) / 2


def precision_at(point: Float[np.ndarray, "6"]) -> Float[np.ndarray, "6 6"]:
    rates = np.exp(DIRECTIONS @ point)
    slopes = rates[:, None] * DIRECTIONS
    sums = (slopes[:2] + WEIGHT[:, None] * slopes[2]) / SUM_SD
    velocities = (np.eye(6)[4:] - LAG * slopes[2]) / VELOCITY_SD
    return np.diag(PRIOR_SD**-2) + sums.T @ sums + velocities.T @ velocities


@pytest.fixture(scope="module")
def steps() -> RateSteps:
    point = np.array([0.0, 0.0, 0.0, 0.0, LAG, LAG])
    rates = Rates(DIRECTIONS, np.array([1, 2, 3]), np.zeros(6), PRIOR_SD)
    found = RateSteps.of(Mode(point, precision_at(point), 0.0), rates)
    assert found is not None
    return found


@pytest.fixture(scope="module")
def weighted_drags() -> tuple[Float[np.ndarray, "draw"], Float[np.ndarray, "draw"]]:
    """Draws of the logarithm of the drag from the prior, and their weights."""
    random = RandomState(1)
    drawn = PRIOR_SD * random.standard_normal((4_000_000, 6))
    drawn[:, 4:] = LAG * np.exp(drawn[:, 3:4]) + VELOCITY_SD * random.standard_normal((len(drawn), 2))
    correction = log_density(drawn) + (drawn[:, :4] ** 2 / (2 * PRIOR_SD[:4] ** 2)).sum(axis=1)
    correction += ((drawn[:, 4:] - LAG * np.exp(drawn[:, 3:4])) ** 2).sum(axis=1) / (2 * VELOCITY_SD**2)
    weights = np.exp(correction - correction.max())
    weights /= weights.sum()
    return drawn[:, 3], weights


def test_without_rates_there_are_no_steps() -> None:
    rates = Rates(np.zeros((0, 2)), np.zeros(0, dtype=int), np.zeros(2), np.ones(2))
    assert RateSteps.of(Mode(np.zeros(2), np.eye(2), 0.0), rates) is None


@pytest.mark.parametrize("seed", range(12))
def test_the_change_of_volume_is_that_of_the_map(steps: RateSteps, seed: int) -> None:
    place, small = np.array([0.1, -0.2, 0.1, 0.3, 0.2, 0.4]), 1e-6
    moved, volume = steps.moved(place[None], RandomState(seed))
    ends = [steps.moved((place + small * unit)[None], RandomState(seed))[0][0] for unit in np.eye(6)]
    if np.isfinite(volume[0]):
        derivative = (np.array(ends) - moved[0]) / small
        assert np.linalg.slogdet(derivative)[1] == pytest.approx(volume[0], abs=1e-4)
        assert (moved[0] != place).any()
    else:
        np.testing.assert_array_equal(moved[0], place)


def test_a_step_keeps_what_the_tracks_tell(steps: RateSteps) -> None:
    places = np.tile([0.0, 0.0, 0.0, 0.0, LAG, LAG], (400, 1))
    moved, volume = steps.moved(places, RandomState(0))
    possible = np.isfinite(volume)
    assert possible.mean() > 0.5
    rates = np.exp(moved[possible] @ DIRECTIONS.T)
    traded = np.abs(rates[:, 2] - 1) > 0.3
    sums = rates[:, :2] + rates[:, 2:] * WEIGHT
    assert np.median(np.abs(sums[traded] - SUM), axis=0).max() < SUM_SD
    assert np.median(np.abs(moved[possible][traded][:, 4:] - LAG * rates[traded, 2:]), axis=0).max() < VELOCITY_SD


def test_a_chain_of_such_steps_draws_what_it_should(
    steps: RateSteps, weighted_drags: tuple[np.ndarray, np.ndarray]
) -> None:
    """Steps and small Gaussian ones; against weighted draws of the prior, in units of both errors."""
    random = RandomState(1)
    places = np.tile([0.0, 0.0, 0.0, 0.0, LAG, LAG], (500, 1))
    values, kept = log_density(places), []
    for number in range(600):
        moved, volume = steps.moved(places, random)
        if number % 2:
            moved, volume = places + 0.05 * random.standard_normal(places.shape), np.zeros(len(places))
        there = log_density(moved)
        taken = np.log(random.uniform(size=len(places))) < there - values + volume
        places, values = np.where(taken[:, None], moved, places), np.where(taken, there, values)
        if number >= 100:
            kept.append(places[:, 3])
    drags, weights = weighted_drags
    draws = np.array(kept)
    for function in (lambda x: x, lambda x: (x < -1.0).astype(float), lambda x: x**2):
        mean, of_walkers = float(weights @ function(drags)), function(draws).mean(axis=0)
        error = np.sqrt((weights**2) @ (function(drags) - mean) ** 2)
        chain_error = of_walkers.std(ddof=1) / np.sqrt(len(of_walkers))
        assert chain_error < 0.05
        assert abs(of_walkers.mean() - mean) < 4 * np.hypot(error, chain_error)


@pytest.mark.parametrize("trading", [True, False])
def test_fast_draws_reach_the_end_of_the_ridge_by_such_steps(
    steps: RateSteps, weighted_drags: tuple[np.ndarray, np.ndarray], *, trading: bool
) -> None:
    point = np.array([0.0, 0.0, 0.0, 0.0, LAG, LAG])
    start = Mixture.of(CurvedGaussian.straight(Gaussian.from_precision(point, precision_at(point))))
    generator, count = np.random.default_rng(3), 4000
    samples = sample_laplace(
        lambda points: torch.from_numpy(log_density(points.detach().numpy())),
        start,
        draws=count,
        generator=generator,
        rate_steps=steps if trading else None,
        hand_on=False,
    )
    drags, weights = weighted_drags
    share = float(weights @ (drags < -2.0))
    error = np.sqrt((weights**2) @ ((drags < -2.0) - share) ** 2 + share / count)
    found = float((samples.points[0, :, 3] < -2.0).mean())
    assert bool(abs(found - share) < 4 * error) is trading
    np.testing.assert_allclose(samples.log_density[0], log_density(samples.points[0]))

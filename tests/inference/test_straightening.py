"""Ridges along rates of slowing down: exact where tracks depend linearly on the rates."""

import numpy as np
import pytest
import torch

from vrdp_prob.inference.draws.mode import Mode
from vrdp_prob.inference.laplace import smoothed_weights
from vrdp_prob.inference.samplers.proposals import proposals
from vrdp_prob.inference.samplers.straightening import ROOM, Rates, Straightening, all_straightened, straight_gaussian
from vrdp_prob.models.coordinates import Coordinate, Coordinates
from vrdp_prob.models.parameters import Prior, Transform
from vrdp_prob.scene import Body, Shape, Tracks

TIMES = np.linspace(0.0, 1.0, 20)
NOISE = 0.01
TRUE_RATE, TRUE_SPEED = 0.05, 1.0
PRIOR = Prior(np.log(0.05), 1.0)
LEAST, MOST = -9.0, 2.0


def tracks() -> Tracks:
    positions = np.stack([np.arange(3.0)[:, None], np.zeros((3, 1))], axis=-1)
    return Tracks.from_arrays("v", (Body("0", Shape.CYLINDER, 0.1),), np.arange(3.0), positions)


def coordinates() -> Coordinates:
    """A speed, and a drag in the logarithm: the way that was gone is linear in both speed and drag itself."""
    speed = Coordinate("velocity_x", 0, Transform.IDENTITY, Prior(0.0, 3.0))
    return Coordinates((speed, Coordinate("air_drag", None, Transform.LOG, PRIOR)), {})


def residuals(points: np.ndarray) -> np.ndarray:
    way = points[:, :1] * TIMES - np.exp(points[:, 1:]) * TIMES**2 / 2
    seen = TRUE_SPEED * TIMES - TRUE_RATE * TIMES**2 / 2
    prior = np.stack([points[:, 0] / 3.0, (points[:, 1] - PRIOR.mean) / PRIOR.sd], axis=1)
    return np.concatenate([(way - seen) / NOISE, prior], axis=1)


def mode() -> Mode:
    point = np.array([TRUE_SPEED, np.log(TRUE_RATE)])
    for _ in range(20):
        jacobian = derivative(point)
        point = point - np.linalg.solve(jacobian.T @ jacobian, jacobian.T @ residuals(point[None])[0])
    return Mode(point, derivative(point).T @ derivative(point), 0.0)


def derivative(point: np.ndarray) -> np.ndarray:
    steps = 1e-5 * np.eye(2)
    return (residuals(point + steps) - residuals(point - steps)).T / 2e-5


def exact_moments() -> tuple[float, float]:
    """Mean and standard deviation of the logarithm of the drag, on a grid."""
    logarithms = np.linspace(LEAST, MOST, 1101)
    speeds = np.linspace(0.0, 3.0, 3001)
    grid = np.stack(np.meshgrid(speeds, logarithms), axis=-1).reshape(-1, 2)
    density = np.exp(-(residuals(grid) ** 2).sum(axis=1) / 2).reshape(len(logarithms), -1).sum(axis=1)
    density /= density.sum()
    mean = float(density @ logarithms)
    return mean, float(np.sqrt(density @ (logarithms - mean) ** 2))


def test_the_map_has_an_inverse_leaves_the_mode_alone_and_keeps_volumes() -> None:
    straightening = Straightening.of(mode(), Rates.of(tracks(), coordinates()))
    points = torch.from_numpy(mode().point + np.random.default_rng(0).standard_normal((20, 2)))
    (straight,) = all_straightened([straightening], straightening.bent(points).numpy()[None])
    torch.testing.assert_close(torch.from_numpy(straight), points)
    centre = torch.from_numpy(mode().point)
    torch.testing.assert_close(straightening.bent(centre), centre)
    for point in points[:3]:
        slope = torch.autograd.functional.jacobian(straightening.bent, point)
        assert float(torch.linalg.det(slope)) == pytest.approx(1.0)


def test_the_width_along_a_rate_is_that_of_the_posterior_and_not_of_its_peak() -> None:
    mean, sd = exact_moments()
    peak = mode()
    narrow = np.sqrt(np.linalg.inv(peak.precision)[1, 1])
    assert sd > 1.1 * narrow
    gaussian = straight_gaussian(peak, Rates.of(tracks(), coordinates()), np.random.default_rng(0))
    np.testing.assert_array_equal(gaussian.mean, peak.point)
    assert gaussian.sd[1] == pytest.approx(ROOM * np.hypot(sd, mean - peak.point[1]), rel=0.03)


def test_draws_along_the_ridge_have_the_moments_of_the_posterior() -> None:
    mean, sd = exact_moments()
    mixture = proposals((mode(),), residuals, Rates.of(tracks(), coordinates()))
    points, _ = mixture.draws(4000, np.random.default_rng(1))
    weights, k_hat = smoothed_weights(-(residuals(points) ** 2).sum(axis=1) / 2 - mixture.log_density(points))
    assert k_hat < 0.5
    assert 1 / (weights**2).sum() > 3000
    found = float(weights @ points[:, 1])
    assert found == pytest.approx(mean, abs=0.06 * sd)
    assert np.sqrt(weights @ (points[:, 1] - found) ** 2) == pytest.approx(sd, rel=0.06)


def test_a_body_s_rate_is_the_product_of_the_shared_friction_and_its_own_ratio() -> None:
    bodies = (Body("0", Shape.CYLINDER, 0.1), Body("1", Shape.SPHERE, 0.1))
    two = Tracks.from_arrays("v", bodies, np.arange(3.0), np.arange(12.0).reshape(3, 2, 2))
    names = (("velocity_x", 0), ("sliding_friction", None), ("friction_ratio", 0), ("friction_ratio", 1), ("mass", 0))
    entries = tuple(
        Coordinate(name, owner, Transform.IDENTITY if name == "velocity_x" else Transform.LOG, PRIOR)
        for name, owner in names
    )
    rates = Rates.of(two, Coordinates(entries, {}))
    assert rates.places.tolist() == [2, 3]
    assert rates.directions.tolist() == [[0, 1, 1, 0, 0], [0, 0, 0, 1, 0]]
    assert rates.others.tolist() == [0, 4]

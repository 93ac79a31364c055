import numpy as np
import pytest
import torch

from vrdp_prob.inference.draws.samples import Gaussian
from vrdp_prob.inference.samplers.curved_gaussian import CurvedGaussian

WIDTH, CURVATURE = 0.05, 0.8
STRAIGHT = Gaussian(np.zeros(3), np.diag([1.0, WIDTH, 2.0]))


def banana(points: np.ndarray) -> np.ndarray:
    """Residuals that vanish along the curve y = 0.8 x^2, with an independent third coordinate."""
    x, y, other = points.T
    return np.stack([x, (y - CURVATURE * x**2) / WIDTH, other / 2], axis=1)


def test_the_bent_axis_follows_the_curve_that_the_straight_one_leaves() -> None:
    curved = CurvedGaussian.around(STRAIGHT, banana)
    draws = np.random.default_rng(0).standard_normal((500, 3))
    assert np.abs(banana(STRAIGHT.points(draws)) - draws).max() > 100
    assert np.abs(banana(curved.points(draws)) - draws).max() < 1e-6


def test_what_is_straight_stays_so() -> None:
    curved = CurvedGaussian.around(STRAIGHT, lambda points: points / np.diag(STRAIGHT.root))
    draws = np.random.default_rng(0).standard_normal((20, 3))
    assert curved.axes.shape == (3, 0)
    assert curved.points(draws) == pytest.approx(STRAIGHT.points(draws), abs=1e-12)


def test_a_bend_that_only_noise_suggests_is_left_out() -> None:
    def rough(points: np.ndarray) -> np.ndarray:
        return points / np.diag(STRAIGHT.root) + 3 * np.sin(1e4 * points)

    curved = CurvedGaussian.around(STRAIGHT, rough)
    ends = np.concatenate([np.eye(3), -np.eye(3)])
    costs = [(rough(one.points(ends)) ** 2).sum() for one in (curved, STRAIGHT)]
    assert costs[0] <= costs[1] + 1e-9


def test_volumes_are_kept_up_to_the_stated_factor_also_after_it_was_moved() -> None:
    covariance = np.array([[1.0, 0.3, 0.0], [0.3, 0.5, 0.1], [0.0, 0.1, 2.0]])
    curved = CurvedGaussian.around(STRAIGHT, banana).moved(np.array([0.2, -0.1, 0.4]), covariance)
    for place in torch.from_numpy(np.random.default_rng(1).standard_normal((5, 3))):
        derivative = torch.autograd.functional.jacobian(curved.mapped, place)
        assert float(torch.linalg.slogdet(derivative)[1]) == pytest.approx(curved.log_volume, abs=1e-9)


def test_no_points_are_mapped_to_no_points_and_back() -> None:
    curved = CurvedGaussian.around(STRAIGHT, banana)
    none = np.empty((0, 3))
    assert curved.points(none).shape == (0, 3)
    assert curved.whitened(none).shape == (0, 3)

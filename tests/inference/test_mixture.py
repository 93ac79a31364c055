import numpy as np
import pytest
import torch
from scipy.stats import multivariate_t

from vrdp_prob.inference.draws.mode import Mode
from vrdp_prob.inference.draws.samples import Gaussian
from vrdp_prob.inference.samplers.curved_gaussian import CurvedGaussian
from vrdp_prob.inference.samplers.mixture import DEGREES_OF_FREEDOM, Mixture
from vrdp_prob.inference.samplers.proposals import LEAST_WEIGHT, proposals

WEIGHTS = np.array([0.3, 0.7])


def straight(mean: np.ndarray, root: np.ndarray) -> CurvedGaussian:
    return CurvedGaussian.straight(Gaussian(mean, root))


def bent(dimension: int) -> CurvedGaussian:
    """Bent along its first axis into the second, moved and shaped besides."""
    generator = np.random.default_rng(3)
    root = np.tril(generator.standard_normal((dimension, dimension))) + 2 * np.eye(dimension)
    bend = torch.zeros(1, 1, dimension, dtype=torch.float64)
    bend[0, 0, 1] = 1.5
    axes = torch.eye(dimension, 1, dtype=torch.float64)
    plain = straight(generator.standard_normal(dimension), root)
    curved = CurvedGaussian(plain.gaussian, axes, bend, plain.shift, plain.scale)
    return curved.moved(generator.standard_normal(dimension), np.diag([1.5, 0.7, 1.0]) ** 2 + 0.2)


def test_whitened_coordinates_are_the_inverse_of_points() -> None:
    whitened = np.random.default_rng(0).standard_normal((5, 7, 3))
    assert bent(3).whitened(bent(3).points(whitened)) == pytest.approx(whitened, abs=1e-12)


def test_density_of_straight_components_is_that_of_scipy() -> None:
    first, second = np.array([[1.0, 0.0], [0.5, 2.0]]), np.array([[0.3, 0.0], [-0.2, 0.4]])
    means = np.array([[0.0, 0.0], [3.0, -1.0]])
    mixture = Mixture.of(straight(means[0], first), straight(means[1], second), log_weights=np.log(WEIGHTS) + 5)
    points = np.random.default_rng(1).normal(size=(20, 2), scale=2)
    parts = [
        weight * multivariate_t.pdf(points, mean, root @ root.T, df=DEGREES_OF_FREEDOM)
        for weight, mean, root in zip(WEIGHTS, means, (first, second), strict=True)
    ]
    assert mixture.log_density(points) == pytest.approx(np.log(sum(parts)))
    assert mixture.weights.tolist() == pytest.approx([0.7, 0.3])
    assert pytest.approx(np.array(parts)[::-1] / sum(parts)) == mixture.memberships(points).T


def test_draws_of_a_bent_mixture_have_its_density() -> None:
    mixture = Mixture.of(bent(3), straight(np.array([4.0, 4.0, 4.0]), np.eye(3)), log_weights=np.log(WEIGHTS))
    points, chosen = mixture.draws(40_000, np.random.default_rng(2))
    assert np.mean(chosen == 0) == pytest.approx(0.7, abs=0.01)
    # The expectation of one density over another is 1.
    other = straight(np.array([4.0, 4.0, 4.0]), 0.8 * np.eye(3))
    inside = np.exp(Mixture.of(other).log_density(points) - mixture.log_density(points))
    assert inside.mean() == pytest.approx(1.0, abs=4 * inside.std() / 200)


def test_modes_weigh_what_their_evidence_says() -> None:
    sharp, broad = np.diag([100.0, 100.0]), np.diag([1.0, 1.0])
    modes = (
        Mode(np.zeros(2), sharp, 5.0),
        Mode(np.full(2, 9.0), broad, 1.0),
        Mode(np.full(2, -9.0), broad, -6.0),
        Mode(np.full(2, -30.0), broad, -60.0),
    )

    def residuals(points: np.ndarray) -> np.ndarray:
        return points

    mixture = proposals(modes, residuals)
    heavy = np.exp(5.0) / 100
    expected = np.array([np.exp(1.0), heavy]) / (np.exp(1.0) + heavy + np.exp(-6.0))
    assert len(mixture.components) == 3
    assert mixture.weights == pytest.approx(np.array([*expected, LEAST_WEIGHT]) / (expected.sum() + LEAST_WEIGHT))
    assert mixture.components[0].gaussian.mean.tolist() == [9.0, 9.0]

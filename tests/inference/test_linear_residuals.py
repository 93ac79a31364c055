"""The probability of residuals with the unknowns integrated out, against the normal density written out in full."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from vrdp_prob.inference.search.linear_residuals import LinearResiduals
from vrdp_prob.models.model_error import Strand, by_law

TIMES = np.linspace(0.0, 1.0, 12)
UNKNOWNS = 3


def residuals(seed: int) -> LinearResiduals:
    """Residuals of two strands of one body, at random, and a normal prior of their unknowns."""
    generator = np.random.default_rng(seed)
    places = np.arange(2 * len(TIMES)).reshape(-1, 2)
    variance = np.repeat(generator.uniform(1.0, 3.0, len(TIMES)), 2)
    strands = [Strand(places[:, axis], TIMES, 0.0, np.ones((len(TIMES), 1))) for axis in (0, 1)]
    return LinearResiduals(
        by_law(strands, variance),
        3 * generator.standard_normal(places.size),
        5 * generator.standard_normal((places.size, UNKNOWNS)),
        variance,
        generator.standard_normal(UNKNOWNS),
        np.diag(generator.uniform(0.5, 2.0, UNKNOWNS)),
    )


def covariance(linear: LinearResiduals, scale: float, size: float, duration: float) -> np.ndarray:
    """Noise and straying of all numbers."""
    whole = np.zeros((len(linear.residuals), len(linear.residuals)))
    for strand in (strand for alike in linear.strands for strand in alike):
        whole[np.ix_(strand.places, strand.places)] = scale**2 * strand.covariance(size, duration, linear.variance)
    return whole


ERRORS = [(1.0, 0.0, 0.3), (0.7, 20.0, 0.1), (2.0, 3.0, 1.0)]


def test_unknowns_are_integrated_out_exactly() -> None:
    linear = residuals(0)
    prior_root = np.linalg.inv(linear.prior_derivative)
    mean = linear.residuals - linear.derivative @ prior_root @ linear.prior_residuals
    spread = linear.derivative @ prior_root @ prior_root.T @ linear.derivative.T
    expected = [-multivariate_normal(mean, covariance(linear, *error) + spread).logpdf(0 * mean) for error in ERRORS]
    found = [linear.cost(*error) for error in ERRORS]
    np.testing.assert_allclose(np.diff(found), np.diff(expected), rtol=1e-7)


@pytest.mark.parametrize("known", ERRORS)
def test_what_others_say_of_the_unknowns_is_not_up_to_the_residuals(known: tuple[float, float, float]) -> None:
    angles, positions = residuals(1), residuals(2)
    prior_root = np.linalg.inv(angles.prior_derivative)
    derivative = np.concatenate([angles.derivative, positions.derivative])
    mean = np.concatenate([angles.residuals, positions.residuals])
    mean = mean - derivative @ prior_root @ angles.prior_residuals
    spread = derivative @ prior_root @ prior_root.T @ derivative.T
    count = len(angles.residuals)
    expected = []
    for error in ERRORS:
        whole = spread.copy()
        whole[:count, :count] += covariance(angles, *error)
        whole[count:, count:] += covariance(positions, *known)
        expected.append(-multivariate_normal(mean, whole).logpdf(0 * mean))
    found = [angles.beside(positions, *known).cost(*error) for error in ERRORS]
    np.testing.assert_allclose(np.diff(found), np.diff(expected), rtol=1e-7)

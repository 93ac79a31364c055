"""Derivatives by differences, on either side of an edge where residuals jump, and where nothing jumps."""

import numpy as np
import pytest

from vrdp_prob.inference.search.least_squares import Residuals, jacobian

SLOPE = 30.0


def with_a_jump(at: float) -> Residuals:
    """Residuals that are linear but for a jump beyond a value of the first coordinate."""

    def residuals(points: np.ndarray) -> np.ndarray:
        jumped = 100.0 * (points[:, 0] > at)
        return np.stack([SLOPE * points[:, 0] + jumped, points[:, 0] ** 2 + points[:, 1]], axis=1)

    return residuals


@pytest.mark.parametrize("at", [1.0 + 1e-9, 1.0 - 1e-9, 5.0])
def test_a_derivative_is_that_of_the_side_a_point_is_on(at: float) -> None:
    _, derivative = jacobian(with_a_jump(at), np.array([1.0, 0.0]), np.ones(2), central=True, own_side=True)
    np.testing.assert_allclose(derivative, [[SLOPE, 0.0], [2.0, 1.0]], atol=1e-4)


def test_a_side_on_which_the_world_fails_says_nothing() -> None:
    def residuals(points: np.ndarray) -> np.ndarray:
        return np.where(points > 1.0, np.nan, SLOPE * points)

    _, derivative = jacobian(residuals, np.ones(1), np.ones(1), central=True, own_side=True)
    np.testing.assert_allclose(derivative, [[SLOPE]])


def test_what_sets_in_without_a_jump_counts_half() -> None:
    def residuals(points: np.ndarray) -> np.ndarray:
        return SLOPE * np.maximum(points, 0.0)

    _, derivative = jacobian(residuals, np.zeros(1), np.ones(1), central=True, own_side=True)
    np.testing.assert_allclose(derivative, [[SLOPE / 2]])

from dataclasses import replace

import numpy as np
import pytest

from vrdp_prob.models.model_error import Strand, straying


@pytest.mark.parametrize("duration", [0.05, 0.4, 5.0])
def test_straying_is_the_double_integral_of_a_fading_acceleration(duration: float) -> None:
    release, times = 0.3, np.array([0.3, 0.5, 0.9, 1.7])
    grid, step = np.linspace(release, times[-1], 2801, retstep=True)
    middles = grid[:-1] + step / 2
    weights = step * np.clip(times[:, None] - middles, 0, None)
    alike = np.exp(-np.abs(middles[:, None] - middles) / duration)
    expected = weights @ alike @ weights.T
    found = straying(times, release, duration)
    np.testing.assert_allclose(found, expected, rtol=2e-3, atol=1e-12)
    assert found[0].tolist() == [0, 0, 0, 0]


def test_an_acceleration_that_lasts_bends_a_path_as_a_constant_one() -> None:
    times = np.array([0.5, 1.0])
    assert straying(times, 0.0, 100.0) == pytest.approx(np.outer(times**2, times**2) / 4, rel=2e-2)


def test_axes_of_a_body_stray_alike_unless_their_noise_differs() -> None:
    times = np.array([0.0, 0.1, 0.2])
    along_x, along_y = (Strand(np.array([0, 2, 4]) + axis, times, 0.0, np.ones((3, 1))) for axis in (0, 1))
    even = np.repeat([1.0, 9.0, 1.0], 2)
    assert along_y.strays_like(along_x, even)
    assert not along_y.strays_like(along_x, np.array([1.0, 1.0, 9.0, 1.0, 1.0, 1.0]))
    assert not replace(along_y, release=-0.1).strays_like(along_x, even)
    np.testing.assert_array_equal(along_x.covariance(2.0, 0.3, even), along_y.covariance(2.0, 0.3, even))

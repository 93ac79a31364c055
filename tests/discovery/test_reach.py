"""How far a parameter reaches whose density is no Gaussian."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.stats import norm

from vrdp_prob.discovery.selection.reach import reach


def _plain(edge: float, sd: float) -> Callable[[float], float]:
    """Flat but for a wide prior from an edge on, and steep below it."""

    def density(value: float) -> float:
        below = min(value - edge, 0.0) / sd
        return -(below**2) / 2 - value**2 / 2

    return density


def test_a_gaussian_says_it_all() -> None:
    assert reach(lambda value: -((value - 3.0) ** 2) / 2 / 0.1**2, 3.0, 0.1) is None


def test_a_value_from_which_on_only_the_prior_speaks_reaches_as_far_as_that() -> None:
    edge = 0.5
    found = reach(_plain(edge, 1e-3), edge, 1e-3)
    assert found is not None
    above = norm.sf(edge)
    for share in (0.025, 0.5, 0.975):
        assert found.quantile(share) == pytest.approx(norm.isf(above * (1 - share)), abs=0.03)
    mean, sd = found.moments(np.asarray)
    true_mean = norm.pdf(edge) / above
    assert mean == pytest.approx(true_mean, abs=0.03)
    assert sd == pytest.approx(math.sqrt(1 + edge * true_mean - true_mean**2), abs=0.03)


def test_a_top_that_is_elsewhere_is_found() -> None:
    found = reach(lambda value: -((value - 0.4) ** 2) / 2 / 0.05**2, 0.0, 0.1)
    assert found is not None
    assert found.moments(np.asarray) == pytest.approx((0.4, 0.05), rel=0.05)


def test_where_there_is_no_world_nothing_is_left() -> None:
    found = reach(lambda value: math.nan if value > 1.0 else 0.0 if value > 0.0 else -1e4 * value**2, 0.0, 1e-2)
    assert found is not None
    assert found.quantile(0.975) == pytest.approx(0.975, abs=0.05)
    assert found.quantile(0.999) <= 1.02

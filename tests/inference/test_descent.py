"""L-BFGS where some worlds fail."""

import numpy as np
import pytest
import torch
from jaxtyping import Float
from torch import Tensor

from vrdp_prob.inference.search.descent import _lbfgs

MINIMUM = 0.8


def cost(points: Float[Tensor, "point dimension"]) -> Float[Tensor, ""]:
    """A parabola, beyond whose minimum worlds fail."""
    failing = (points > MINIMUM + 0.1).any()
    return torch.where(failing, torch.nan, 2.5 * ((points - MINIMUM) ** 2).sum())


@pytest.mark.parametrize("count", [1, 3])
def test_a_failing_trial_ends_no_search(count: int) -> None:
    point, _, ended = _lbfgs(cost, np.zeros(count), np.ones(count), 100, 1e-3)
    assert ended
    np.testing.assert_allclose(point, MINIMUM, atol=1e-2)


def test_a_start_that_fails_stays() -> None:
    point, worlds, ended = _lbfgs(cost, np.full(1, 2.0), np.ones(1), 100, 1e-3)
    assert (point.tolist(), worlds, ended) == ([2.0], 1, False)

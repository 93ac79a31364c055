"""Worlds that nobody believes in are not simulated."""

import numpy as np
import pytest
import torch

from vrdp_prob.models.likelihood import FASTEST, Likelihood
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.unknowns import SPIN_SD, Structure, unknowns
from vrdp_prob.scene import Body, Shape, Tracks

MODEL = PhysicsModel.base()
BOTH = frozenset({0, 1})


@pytest.fixture(scope="module")
def likelihood() -> Likelihood:
    """A cube that a cylinder comes near to, of which nobody sees how it turns."""
    times = 0.04 * np.arange(20)
    still = np.zeros((20, 2))
    positions = np.stack([still, np.stack([1.0 - times, np.full(20, 0.6)], axis=-1)], axis=1)
    bodies = (Body("cube", Shape.CUBE, 0.2), Body("cylinder", Shape.CYLINDER, 0.2))
    tracks = Tracks.from_arrays("v", bodies, times, positions)
    return Likelihood(tracks, MODEL, unknowns(tracks, MODEL, Structure(moving=BOTH, colliding=BOTH)))


def test_a_cube_that_spins_beyond_belief_is_impossible_at_once(likelihood: Likelihood) -> None:
    """At 1e9 rad/s a simulation looks at its corners for an hour."""
    coordinates = likelihood.coordinates
    points = np.repeat(coordinates.prior_mean[None], 3, axis=0)
    points[:, coordinates.places["spin", 0]] = 1.0, 0.9 * FASTEST * SPIN_SD, 1e9
    points = torch.from_numpy(points).requires_grad_()
    density = likelihood.log_density(points)
    assert torch.isfinite(density[:2]).all()
    assert density[2] == -torch.inf
    (slope,) = torch.autograd.grad(density[:2].sum(), points)
    assert torch.isfinite(slope).all()
    residuals = likelihood.residuals(points.detach().numpy())
    assert np.isfinite(residuals[:2]).all()
    assert np.isnan(residuals[2]).all()

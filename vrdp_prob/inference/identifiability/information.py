"""How much the data narrow what was believed of a combination of unknowns: the contraction from prior to posterior.

It comes from the curvature of the log posterior at the most probable values, so it is known before any sampling.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Float

from vrdp_prob.inference.draws.mode import Mode
from vrdp_prob.inference.draws.samples import Gaussian
from vrdp_prob.models.coordinates import Coordinates

Weights = Mapping[tuple[str, int | None], float]
"""Weights of unknowns in a linear combination, by field and owner."""


@dataclass(frozen=True)
class Information:
    """What the data say about linear combinations of the unknowns around a mode.

    Parameters
    ----------
    coordinates
        The unknowns and their prior.
    mode
        The most probable values, with the curvature there.
    """

    coordinates: Coordinates
    mode: Mode

    def sd(self, weights: Weights) -> float:
        """Posterior standard deviation of a combination, in the coordinates' units (logarithms mostly)."""
        return float(np.linalg.norm(self._direction(weights) @ self._root))

    def contraction(self, weights: Weights) -> float:
        """Share of the prior variance of a combination that the data take away; 0 where they say nothing."""
        direction = self._direction(weights)
        prior = float(np.linalg.norm(direction * self.coordinates.prior_sd)) ** 2
        return float(np.clip(1 - self.sd(weights) ** 2 / prior, 0.0, 1.0)) if prior > 0 else 0.0

    @cached_property
    def _root(self) -> Float[np.ndarray, "dimension dimension"]:
        """Root of the covariance of what the data and the Gaussian part of the prior say; a prior's edge is no data."""
        point = torch.from_numpy(self.mode.point)[None]
        rows = point.repeat(self.coordinates.prior_residuals(point).shape[1], 1).requires_grad_()
        # One row per residual, so one pass backward is enough (`torch.func` imports a compiler, which takes seconds).
        (found,) = torch.autograd.grad(self.coordinates.prior_residuals(rows).diagonal().sum(), rows)
        slopes = found.numpy()
        precision = self.mode.precision - slopes.T @ slopes + np.diag(self.coordinates.prior_sd**-2)
        return Gaussian.from_precision(self.mode.point, precision).root

    def _direction(self, weights: Weights) -> Float[np.ndarray, "dimension"]:
        """The combination as a vector; what is not sampled is known and counts for nothing."""
        direction = np.zeros(len(self.coordinates))
        for key, weight in weights.items():
            place = self.coordinates.places.get(key)
            if place is not None:
                direction[place] += weight
        return direction

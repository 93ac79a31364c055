"""Residuals of frames that come early or late by chance, all bodies of a frame together.

A frame that is late by t seconds shifts every number of it by t times its rate, so that the residuals r of a frame have
the covariance 1 + jitter^2 s s' with s the rates in units of the noise: a matrix of rank one beside the noise, whose
root and determinant are known in closed form. Source: Woodbury, Inverting modified matrices, Princeton University
(1950); Harville, Matrix Algebra From a Statistician's Perspective (1997), theorem 18.1.1.
"""

from dataclasses import dataclass
from functools import cached_property

import torch
from jaxtyping import Float, Int
from torch import Tensor


@dataclass(frozen=True)
class Lateness:
    """Frames that come early or late by chance.

    Parameters
    ----------
    frame
        Frame of each number that was seen.
    rates
        Change of each number per second by which its frame is late, in units of the noise.
    jitter
        Standard deviation in s by which frames are late.
    frame_count
        Number of all frames.
    """

    frame: Int[Tensor, "number"]
    rates: Float[Tensor, "point number"]
    jitter: Float[Tensor, "point"]
    frame_count: int

    @cached_property
    def variance(self) -> Float[Tensor, "point time"]:
        """Variance that lateness adds along the rates of each frame, in units of the noise.

        Above 1 the numbers of a frame tell more of its lateness than was believed beforehand.
        """
        return self.jitter[:, None] ** 2 * self._by_frame(self.rates**2)

    def _by_frame(self, values: Float[Tensor, "point number"]) -> Float[Tensor, "point time"]:
        """Sums of the numbers of each frame."""
        return values.new_zeros((len(values), self.frame_count)).index_add(1, self.frame, values)

    def independent(self, residuals: Float[Tensor, "point number"]) -> Float[Tensor, "point number"]:
        """Residuals of unit variance that are independent, from those in units of the noise."""
        root = (1 + self.variance).sqrt()
        # (1 - 1 / root) / squares of the rates, which stays finite where nothing moves
        share = self.jitter[:, None] ** 2 / (root * (1 + root))
        along = share * self._by_frame(self.rates * residuals)
        return residuals - self.rates * along.index_select(1, self.frame)

    @cached_property
    def log_volumes(self) -> Float[Tensor, "point number"]:
        """Logarithm of the factor by which residuals are shrunk, that of a frame shared by its numbers alike."""
        numbers = self._by_frame(torch.ones((1, len(self.frame)), dtype=self.rates.dtype)).clamp_min(1.0)
        shares: Tensor = -torch.log1p(self.variance) / 2 / numbers
        return shares.index_select(1, self.frame)

    def expected(self, residuals: Float[Tensor, "point number"]) -> Float[Tensor, "point time"]:
        """Most probable lateness in s of each frame, from residuals (predicted less observed) in units of the noise."""
        return -(self.jitter[:, None] ** 2) * self._by_frame(self.rates * residuals) / (1 + self.variance)

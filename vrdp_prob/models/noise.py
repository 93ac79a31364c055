"""Families of measurement noise: Gaussian, and Student-t for tracks with gross outliers.

A Student-t density is a Gaussian one of shrunken residuals, which keeps the log posterior a sum of squares. For a
position, whose two numbers go astray together, the bivariate t-density has the constant `1 / (2 pi scale^2)`, whatever
its degrees of freedom. Source: Lange, Little and Taylor, Robust statistical modeling using the t distribution, Journal
of the American Statistical Association 84 (1989).
"""

import math
from enum import StrEnum

import torch
from jaxtyping import Float
from torch import Tensor

SMALLEST_SQUARE = 1e-12
"""Squared residual below which shrinking is replaced by its limit, so that its slope stays finite."""


class NoiseFamily(StrEnum):
    """Distribution of the errors of measured positions and angles."""

    GAUSSIAN = "gaussian"
    STUDENT_T = "student_t"

    def shrunk(
        self, residuals: Float[Tensor, "point observation number"], degrees_of_freedom: Float[Tensor, "point"]
    ) -> Float[Tensor, "point observation number"]:
        """Residuals whose half sum of squares is the negative log density, up to `log_constant`.

        The numbers of one observation (two for a position, one for an angle) share one fate.
        """
        if self is NoiseFamily.GAUSSIAN:
            return residuals
        degrees = degrees_of_freedom[:, None]
        squares = (residuals**2).sum(dim=-1).clamp_min(SMALLEST_SQUARE)
        factor = ((degrees + residuals.shape[-1]) * torch.log1p(squares / degrees) / squares).sqrt()
        return residuals * factor[..., None]

    def log_constant(self, numbers: int, degrees_of_freedom: Float[Tensor, "point"]) -> Float[Tensor, "point"]:
        """Log density (nats) of an observation of 1 or 2 numbers without residuals, at noise scale 1."""
        gaussian = torch.full_like(degrees_of_freedom, -numbers / 2 * math.log(2 * math.pi))
        if self is NoiseFamily.GAUSSIAN or numbers == 2:
            return gaussian
        half = degrees_of_freedom / 2
        return torch.lgamma(half + 0.5) - torch.lgamma(half) - torch.log(degrees_of_freedom * math.pi) / 2

    def information(
        self, residuals: Float[Tensor, "point observation number"], degrees_of_freedom: Float[Tensor, "point"]
    ) -> Float[Tensor, "point observation"]:
        """Share of a Gaussian observation's information that each observation carries; small for outliers."""
        if self is NoiseFamily.GAUSSIAN:
            return torch.ones(residuals.shape[:-1], dtype=residuals.dtype)
        degrees = degrees_of_freedom[:, None]
        return (degrees + residuals.shape[-1]) / (degrees + (residuals**2).sum(dim=-1))

"""Residuals near a fit as a linear function of the unknowns, and how probable they are once these are integrated out.

Source: Rasmussen and Williams, Gaussian Processes for Machine Learning (2006), section 2.7 (a Gaussian process beside
explicit basis functions, here the derivatives by the unknowns).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float
from scipy.linalg import solve_triangular

from vrdp_prob.models.model_error import Strand


@dataclass(frozen=True)
class LinearResiduals:
    """Residuals at noise scale 1 near a fit, as a linear function of the unknowns, with their prior.

    Parameters
    ----------
    strands
        The numbers that stray together, those side by side that do so by one law (the two axes of a body).
    residuals, derivative
        Values and derivative by the unknowns of all numbers.
    variance
        Variance factor of each number.
    prior_residuals, prior_derivative
        Those of the prior.
    """

    strands: Sequence[Sequence[Strand]]
    residuals: Float[np.ndarray, "number"]
    derivative: Float[np.ndarray, "number dimension"]
    variance: Float[np.ndarray, "number"]
    prior_residuals: Float[np.ndarray, "prior"]
    prior_derivative: Float[np.ndarray, "prior dimension"]

    def cost(self, scale: float, size: float, duration: float) -> float:
        """Negative log probability (nats, up to a constant) of the residuals, the unknowns integrated out."""
        values, slopes, log_volume = self._whitened(scale, size, duration)
        squares = float(values @ values + self.prior_residuals @ self.prior_residuals)
        curvature = slopes.T @ slopes + self._prior_curvature
        gradient = slopes.T @ values + self.prior_derivative.T @ self.prior_residuals
        factor = np.linalg.cholesky(curvature + 1e-12 * np.trace(curvature) * np.eye(len(curvature)))
        absorbed = solve_triangular(factor, gradient, lower=True)
        return log_volume + float(np.log(np.diag(factor)).sum()) + (squares - float(absorbed @ absorbed)) / 2

    def beside(self, other: "LinearResiduals", scale: float, size: float, duration: float) -> "LinearResiduals":
        """The same residuals where what others, of known error, say of the unknowns is known beforehand."""
        values, slopes, _ = other._whitened(scale, size, duration)
        return replace(
            self,
            prior_residuals=np.concatenate([self.prior_residuals, values]),
            prior_derivative=np.concatenate([self.prior_derivative, slopes]),
        )

    @cached_property
    def _prior_curvature(self) -> Float[np.ndarray, "dimension dimension"]:
        curvature: np.ndarray = self.prior_derivative.T @ self.prior_derivative
        return curvature

    def _whitened(
        self, scale: float, size: float, duration: float
    ) -> tuple[Float[np.ndarray, "number"], Float[np.ndarray, "number dimension"], float]:
        """Independent residuals of unit variance, their derivative, and by how much logarithms of volumes shrank."""
        values, slopes, log_volume = [], [], 0.0
        for alike in self.strands:
            root = scale * np.linalg.cholesky(alike[0].covariance(size, duration, self.variance))
            places = np.column_stack([strand.places for strand in alike])
            both = np.concatenate([self.residuals[places][..., None], self.derivative[places]], axis=-1)
            whitened = solve_triangular(root, both.reshape(len(root), -1), lower=True).reshape(places.size, -1)
            values.append(whitened[:, 0])
            slopes.append(whitened[:, 1:])
            log_volume += len(alike) * float(np.log(np.diag(root)).sum())
        return np.concatenate(values), np.concatenate(slopes), log_volume

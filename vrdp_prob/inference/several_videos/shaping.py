"""References that are moved and shaped by draws: a regression on the shared numbers, and a covariance around it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import solve_triangular

FEWEST_PER_DIMENSION = 8.0
"""A reference is shaped in equal parts by draws and as it was where there are so many effective draws per dimension."""
DRAWS_PER_EFFECTIVE = 6.0
"""Draws of a chain that are taken for one effective draw."""


@dataclass(frozen=True)
class Shape:
    """Affine map from a reference's coordinates to whitened ones.

    Parameters
    ----------
    shift, scale
        Mean and Cholesky factor of the covariance.
    along
        Change of the mean with the whitened shared numbers (none for the shared numbers themselves).
    """

    shift: Float[np.ndarray, "dimension"]
    scale: Float[np.ndarray, "dimension dimension"]
    along: Float[np.ndarray, "dimension shared"]

    @classmethod
    def unit(cls, dimension: int, shared: int) -> "Shape":
        """The map that changes nothing."""
        return cls(np.zeros(dimension), np.eye(dimension), np.zeros((dimension, shared)))

    @classmethod
    def of(cls, draws: Float[np.ndarray, "draw dimension"], shared: Float[np.ndarray, "draw shared"]) -> "Shape":
        """Regression of draws on the whitened shared numbers, drawn towards the map that changes nothing."""
        if not len(draws):
            return cls.unit(draws.shape[1], shared.shape[1])
        columns = np.column_stack([np.ones(len(draws)), shared])
        effective = len(draws) / DRAWS_PER_EFFECTIVE
        share = effective / (effective + FEWEST_PER_DIMENSION * (draws.shape[1] + columns.shape[1] - 1))
        coefficients = np.linalg.lstsq(columns, draws, rcond=None)[0]
        rest = draws - columns @ coefficients
        covariance = share * rest.T @ rest / len(rest) + (1 - share) * np.eye(draws.shape[1])
        return cls(share * coefficients[0], np.linalg.cholesky(covariance), share * coefficients[1:].T)

    def whitened(
        self, places: Float[np.ndarray, "chain dimension"], shared: Float[np.ndarray, "chain shared"]
    ) -> Float[np.ndarray, "chain dimension"]:
        """Whitened coordinates of places in the reference."""
        whitened: np.ndarray = self.shift + shared @ self.along.T + places @ self.scale.T
        return whitened

    def places(
        self, whitened: Float[np.ndarray, "chain dimension"], shared: Float[np.ndarray, "chain shared"]
    ) -> Float[np.ndarray, "chain dimension"]:
        """Places in the reference of whitened coordinates."""
        away = whitened - self.shift - shared @ self.along.T
        return np.ascontiguousarray(solve_triangular(self.scale, away.T, lower=True).T)

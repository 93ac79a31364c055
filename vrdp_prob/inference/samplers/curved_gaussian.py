"""A Gaussian around the MAP whose axes follow the bends of the posterior's ridges.

A release velocity and the drag that slows a body make up for each other along a curve; on the straight axis of a
Gaussian the density falls by tens of nats within one standard deviation. The curve to second order follows from how
the residuals bend. The map from standard normal coordinates is a shear, so it keeps volumes, and a sampler needs
nothing but the map. Source: Parno and Marzouk, Transport map accelerated Markov chain Monte Carlo, SIAM/ASA J.
Uncertainty Quantification 6 (2018); Bates and Watts, Relative curvature measures of nonlinearity, J. Royal
Statistical Society B 42 (1980).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Float
from scipy.linalg import solve_triangular
from torch import Tensor

from vrdp_prob.inference.draws.samples import Gaussian
from vrdp_prob.inference.samplers.contact_ridges import ContactRidge
from vrdp_prob.inference.samplers.second_differences import second_differences
from vrdp_prob.inference.samplers.straightening import Straightening, all_straightened
from vrdp_prob.inference.search.least_squares import Residuals, robust_cost

MOST_BENT = 4
"""Largest number of axes along which others are bent."""
SMALLEST_BEND = 0.5
"""Bend, in standard deviations at one standard deviation from the MAP, below which an axis counts as straight."""


@dataclass(frozen=True)
class CurvedGaussian:
    """Map from standard normal coordinates to points of the posterior.

    Parameters
    ----------
    gaussian
        The straight Gaussian.
    axes
        Directions, in its whitened coordinates, along which the others are bent; orthonormal.
    bend
        Displacement across all `axes` per product of two coordinates along them.
    shift, scale
        Affine map that comes before, by which later knowledge moves and shapes the whole.
    straightening
        Shear that comes next, and that bends what a Gaussian can only hold straight; None for none.
    ridges
        Shears that come last, one after the other.
    """

    gaussian: Gaussian
    axes: Float[Tensor, "dimension bent"]
    bend: Float[Tensor, "bent bent dimension"]
    shift: Float[Tensor, "dimension"]
    scale: Float[Tensor, "dimension dimension"]
    straightening: Straightening | None = None
    ridges: tuple[ContactRidge, ...] = ()

    @classmethod
    def straight(
        cls, gaussian: Gaussian, straightening: Straightening | None = None, ridges: Sequence[ContactRidge] = ()
    ) -> "CurvedGaussian":
        """A Gaussian as it is, with shears."""
        count = len(gaussian.mean)
        none = torch.zeros(count, 0, dtype=torch.float64)
        zero, unit = torch.zeros(count, dtype=torch.float64), torch.eye(count, dtype=torch.float64)
        flat = torch.zeros(0, 0, count, dtype=torch.float64)
        return cls(gaussian, none, flat, zero, unit, straightening, tuple(ridges))

    @classmethod
    def around(
        cls,
        gaussian: Gaussian,
        residuals: Residuals,
        straightening: Straightening | None = None,
        ridges: Sequence[ContactRidge] = (),
    ) -> "CurvedGaussian":
        """The Gaussian with its strongest bends, from second differences of the residuals around its mean."""
        straight = cls.straight(gaussian, straightening, ridges)
        tensor = _bends(straight, residuals)
        count = len(gaussian.mean)
        directions, sizes, _ = np.linalg.svd(tensor.reshape(count, -1), full_matrices=False)
        strongest = directions[:, : min(MOST_BENT, int((sizes >= SMALLEST_BEND).sum()))]
        kept = [axis for axis in strongest.T if straight._bent(axis[:, None], tensor).helps(straight, residuals)]
        return straight._bent(np.array(kept).reshape(-1, count).T, tensor)

    def _bent(
        self, axes: Float[np.ndarray, "dimension bent"], tensor: Float[np.ndarray, "dimension dimension dimension"]
    ) -> "CurvedGaussian":
        across = np.eye(len(axes)) - axes @ axes.T
        bend = np.einsum("ia,jb,ijk,kl->abl", axes, axes, tensor, across)
        return replace(self, axes=torch.from_numpy(axes.copy()), bend=torch.from_numpy(bend))

    def helps(self, straight: "CurvedGaussian", residuals: Residuals) -> bool:
        """Whether the residuals one standard deviation along the axes are smaller than without the bend.

        At contacts that come and go within a standard deviation second differences mean nothing.
        """
        ends = np.concatenate([self.axes.numpy().T, -self.axes.numpy().T])
        bent, unbent = (robust_cost(residuals(one.points(ends)), None) for one in (self, straight))
        return bool((bent < unbent).all())

    @cached_property
    def _mean(self) -> Float[Tensor, "dimension"]:
        return torch.from_numpy(self.gaussian.mean)

    @cached_property
    def _root(self) -> Float[Tensor, "dimension dimension"]:
        return torch.from_numpy(self.gaussian.root.T.copy())

    @property
    def dimension(self) -> int:
        """Number of coordinates."""
        return len(self.gaussian.mean)

    @cached_property
    def log_volume(self) -> float:
        """Logarithm of the volume of points per volume of standard normal coordinates."""
        return float(np.log(np.diag(self.gaussian.root)).sum() + torch.log(torch.diagonal(self.scale)).sum())

    def mapped(self, whitened: Float[Tensor, "*batch dimension"]) -> Float[Tensor, "*batch dimension"]:
        """Points of some standard normal coordinates; differentiable."""
        places = self.shift + whitened @ self.scale.T
        if self.axes.shape[1]:
            along = places @ self.axes
            # einsum would take longer to think about the order of three factors than all the rest.
            products = (along[..., :, None] * along[..., None, :]).flatten(-2)
            places = places + products @ self.bend.flatten(0, 1) / 2
        points = self._mean + places @ self._root
        if self.straightening is not None:
            points = self.straightening.bent(points)
        for ridge in self.ridges:
            points = ridge.bent(points)
        return points

    def points(self, whitened: Float[np.ndarray, "*batch dimension"]) -> Float[np.ndarray, "*batch dimension"]:
        """The same for arrays."""
        points: np.ndarray = self.mapped(torch.from_numpy(np.ascontiguousarray(whitened))).numpy()
        return points

    def whitened(self, points: Float[np.ndarray, "*batch dimension"]) -> Float[np.ndarray, "*batch dimension"]:
        """The inverse of `points`; bends leave the coordinates along their axes alone, so these can be read off."""
        flat = np.ascontiguousarray(points).reshape(-1, self.dimension)
        return self._inverse.whitened(flat)[0].reshape(points.shape)

    @cached_property
    def _inverse(self) -> "SeveralClouds":
        return SeveralClouds((self,))

    def moved(
        self, shift: Float[np.ndarray, "dimension"], covariance: Float[np.ndarray, "dimension dimension"]
    ) -> "CurvedGaussian":
        """The map for which a normal distribution of the present coordinates becomes the standard one."""
        scale = torch.from_numpy(np.linalg.cholesky(covariance))
        return replace(
            self, shift=self.shift + self.scale @ torch.from_numpy(np.asarray(shift)), scale=self.scale @ scale
        )


class SeveralClouds:
    """The inverse maps of several clouds at once: hundreds of them cost little more than one.

    Parameters
    ----------
    clouds
        The clouds, of one dimension; straightened along the same rates, as far as they are straightened.
    """

    def __init__(self, clouds: Sequence[CurvedGaussian]) -> None:
        count, dimension = len(clouds), clouds[0].dimension
        unit = np.eye(dimension)
        self._mean = np.stack([cloud.gaussian.mean for cloud in clouds])
        self._unroot = np.stack([solve_triangular(cloud.gaussian.root, unit, lower=True) for cloud in clouds])
        self._shift = np.stack([cloud.shift.numpy() for cloud in clouds])
        self._unscale = np.stack([solve_triangular(cloud.scale.numpy(), unit, lower=True) for cloud in clouds])
        bent = max(cloud.axes.shape[1] for cloud in clouds)
        self._axes = np.zeros((count, dimension, bent))
        self._bend = np.zeros((count, bent, bent, dimension))
        for index, cloud in enumerate(clouds):
            own = cloud.axes.shape[1]
            self._axes[index, :, :own] = cloud.axes.numpy()
            self._bend[index, :own, :own] = cloud.bend.numpy()
        self._ridges = [cloud.ridges for cloud in clouds]
        self._straightenings = [cloud.straightening for cloud in clouds]

    def whitened(self, points: Float[np.ndarray, "point dimension"]) -> Float[np.ndarray, "component point dimension"]:
        """Standard normal coordinates of points in each cloud."""
        straight = all_straightened(self._straightenings, self._beside_straight_ridges(points))
        bent = np.matmul(straight - self._mean[:, None], np.swapaxes(self._unroot, 1, 2))
        if self._axes.shape[2]:
            along = np.matmul(bent, self._axes)
            products = (along[..., :, None] * along[..., None, :]).reshape(*along.shape[:2], along.shape[2] ** 2)
            bent = bent - np.matmul(products, self._bend.reshape(len(bent), -1, bent.shape[2])) / 2
        return np.asarray(np.matmul(bent - self._shift[:, None], np.swapaxes(self._unscale, 1, 2)))

    def _beside_straight_ridges(
        self, points: Float[np.ndarray, "point dimension"]
    ) -> Float[np.ndarray, "component_or_one point dimension"]:
        """Points as they lie beside the ridges of each cloud before these are bent; once where no cloud has any."""
        if not any(self._ridges):
            return points[None]
        straight = np.tile(points, (len(self._ridges), 1, 1))
        for index, ridges in enumerate(self._ridges):
            for ridge in reversed(ridges):
                straight[index] = ridge.straightened(straight[index])
        return straight


def _bends(straight: CurvedGaussian, residuals: Residuals) -> Float[np.ndarray, "dimension dimension dimension"]:
    """Displacement, per product of two whitened coordinates, that keeps the residuals as small as they can be."""
    found = second_differences(lambda whitened: residuals(straight.points(whitened)), straight.dimension)
    return found.displacement(found.first_derivative)

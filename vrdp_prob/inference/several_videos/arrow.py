"""A Gaussian over shared numbers and the own numbers of many videos, whose precision has the shape of an arrow.

Given the shared numbers the videos know nothing of each other. So each video's own numbers are eliminated by
themselves, and nothing ever has the size of all videos together. They are eliminated by an orthogonal transformation of
the residuals' derivative: where bodies meet several times one number is known a million times better than another, and
the Schur complement, a difference of products of the derivative, would be all rounding error. Source: Triggs,
McLauchlan, Hartley and Fitzgibbon, Bundle adjustment: a modern synthesis, Vision Algorithms (2000), section 6.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float
from scipy.linalg import solve_triangular

from vrdp_prob.inference.draws.triangles import lower_root, upper_root

LARGEST_LOGARITHM = 5.0
LOG_TWO_PI = float(np.log(2 * np.pi))
STEEP = 5.0
"""Gain (nats) that its own step promises a video which has just looked for its best own numbers, from which on it is
taken to be at an edge: where two orders of events meet, or a contact just happens."""


@dataclass(frozen=True)
class Expansion:
    """Second-order expansion of a video's negative log density in the shared numbers and its own.

    Parameters
    ----------
    shared_gradient, local_gradient
        First derivatives.
    shared, local
        Derivatives of residuals (of any number of them), whose products are the Gauss-Newton curvature; the columns of
        `local` are independent.
    """

    shared_gradient: Float[np.ndarray, "shared"]
    local_gradient: Float[np.ndarray, "local"]
    shared: Float[np.ndarray, "residual shared"]
    local: Float[np.ndarray, "residual local"]

    @cached_property
    def _triangle(self) -> Float[np.ndarray, "number number"]:
        """Upper-triangular root of the curvature, the own numbers first."""
        return upper_root(np.concatenate([self.local, self.shared], axis=1))

    @property
    def _blocks(
        self,
    ) -> tuple[Float[np.ndarray, "local local"], Float[np.ndarray, "local shared"], Float[np.ndarray, "shared shared"]]:
        """Of the triangle: own numbers, how they go with the shared ones, and the shared ones by themselves."""
        own = self.local.shape[1]
        return self._triangle[:own, :own], self._triangle[:own, own:], self._triangle[own:, own:]

    @cached_property
    def local_root(self) -> Float[np.ndarray, "local local"]:
        """Lower-triangular root of the covariance of the video's own numbers, given the shared ones."""
        return _covariance_root(self._blocks[0])

    @cached_property
    def slope(self) -> Float[np.ndarray, "local shared"]:
        """How the best own numbers move with the shared ones."""
        own, cross, _ = self._blocks
        slope: np.ndarray = -solve_triangular(own, cross)
        return slope

    def around(self, local: Float[np.ndarray, "local"], logarithms: Bool[np.ndarray, "shared"]) -> "LocalGaussian":
        """The Gaussian of the own numbers around a maximum at which they were expanded."""
        return LocalGaussian(local, self.slope, self.local_root, logarithms)

    @cached_property
    def _pulled(self) -> Float[np.ndarray, "local"]:
        """Gradient of the own numbers in units of their standard deviations."""
        pulled: np.ndarray = solve_triangular(self._blocks[0], self.local_gradient, trans="T")
        return pulled

    @cached_property
    def local_step(self) -> Float[np.ndarray, "local"]:
        """Newton step of the own numbers where the shared ones stay."""
        step: np.ndarray = -solve_triangular(self._blocks[0], self._pulled)
        return step

    @property
    def promised(self) -> float:
        """Gain (nats) that the Newton step of the own numbers promises."""
        return float(self._pulled @ self._pulled) / 2

    @property
    def at_edge(self) -> bool:
        """Whether a video that has just looked for its best own numbers is at an edge, where gradients say nothing."""
        return self.promised > STEEP

    @cached_property
    def separate_steps(self) -> Float[np.ndarray, "direction local"]:
        """The Newton step of the own numbers in parts, one along each principal direction of the scaled curvature."""
        own = self._blocks[0]
        size = np.linalg.norm(own, axis=0)
        _, widths, directions = np.linalg.svd(own / size)
        along = directions @ (self.local_gradient / size) / widths**2
        steps: np.ndarray = -along[:, None] * directions / size
        return steps

    @property
    def reduced_rows(self) -> Float[np.ndarray, "shared shared"]:
        """Derivatives of residuals by the shared numbers when the own ones follow them."""
        return self._blocks[2]

    @property
    def reduced(self) -> Float[np.ndarray, "shared shared"]:
        """Curvature in the shared numbers when the own ones follow them."""
        return self.reduced_rows.T @ self.reduced_rows

    @property
    def reduced_gradient(self) -> Float[np.ndarray, "shared"]:
        """Gradient in the shared numbers when the own ones follow them."""
        return self.shared_gradient - self._blocks[1].T @ self._pulled


@dataclass(frozen=True)
class SharedExpansion:
    """Expansion of the negative log prior of the shared numbers.

    Parameters
    ----------
    gradient
        First derivative.
    rows
        Derivatives of residuals, whose products are the curvature.
    """

    gradient: Float[np.ndarray, "shared"]
    rows: Float[np.ndarray, "residual shared"]

    @property
    def curvature(self) -> Float[np.ndarray, "shared shared"]:
        """Second derivative."""
        return self.rows.T @ self.rows


def grown(
    departure: Float[np.ndarray, "*batch shared"], logarithms: Bool[np.ndarray, "shared"]
) -> Float[np.ndarray, "*batch shared"]:
    """Departures as they act: that of a logarithm by its exponential, held finite far off."""
    return np.where(logarithms, np.expm1(np.minimum(departure, LARGEST_LOGARITHM)), departure)


@dataclass(frozen=True)
class LocalGaussian:
    """A video's own numbers given the shared ones.

    Parameters
    ----------
    centre
        Their mean where the shared numbers are at their own mean.
    slope
        How the mean moves with the shared numbers.
    root
        Lower-triangular Cholesky factor of the covariance.
    logarithms
        Which shared numbers are logarithms: what follows them does so in proportion to their exponential.
    """

    centre: Float[np.ndarray, "local"]
    slope: Float[np.ndarray, "local shared"]
    root: Float[np.ndarray, "local local"]
    logarithms: Bool[np.ndarray, "shared"]

    def points(
        self, whitened: Float[np.ndarray, "*batch local"], departure: Float[np.ndarray, "*batch shared"]
    ) -> Float[np.ndarray, "*batch local"]:
        """Own numbers of standard normal coordinates, at a departure of the shared numbers from their mean."""
        follows = grown(departure, self.logarithms) @ self.slope.T
        points: np.ndarray = self.centre + follows + whitened @ self.root.T
        return points

    def whitened(
        self, points: Float[np.ndarray, "*batch local"], departure: Float[np.ndarray, "*batch shared"]
    ) -> Float[np.ndarray, "*batch local"]:
        """Standard normal coordinates of own numbers."""
        away = points - self.centre - grown(departure, self.logarithms) @ self.slope.T
        flat = solve_triangular(self.root, away.reshape(-1, away.shape[-1]).T, lower=True).T
        return np.ascontiguousarray(flat).reshape(away.shape)

    @cached_property
    def log_volume(self) -> float:
        """Logarithm of the volume of own numbers per volume of standard normal coordinates."""
        return float(np.log(np.diag(self.root)).sum())


@dataclass(frozen=True)
class ArrowGaussian:
    """Gaussian of the shared numbers, and of each video's own numbers given them.

    Parameters
    ----------
    mean, root
        Mean of the shared numbers and Cholesky factor of their covariance.
    locals
        One Gaussian per video.
    logarithms
        Which shared numbers are logarithms.
    """

    mean: Float[np.ndarray, "shared"]
    root: Float[np.ndarray, "shared shared"]
    locals: tuple[LocalGaussian, ...]
    logarithms: Bool[np.ndarray, "shared"]

    @property
    def sd(self) -> Float[np.ndarray, "shared"]:
        """Standard deviation of each shared number."""
        return np.sqrt((self.root**2).sum(axis=1))

    @property
    def log_volume(self) -> float:
        """Logarithm of the volume of all numbers per volume of standard normal coordinates."""
        return float(np.log(np.diag(self.root)).sum()) + sum(one.log_volume for one in self.locals)

    @property
    def dimension(self) -> int:
        """Number of all numbers."""
        return len(self.mean) + sum(len(one.centre) for one in self.locals)

    def shared_points(self, whitened: Float[np.ndarray, "*batch shared"]) -> Float[np.ndarray, "*batch shared"]:
        """Shared numbers of standard normal coordinates."""
        points: np.ndarray = self.mean + whitened @ self.root.T
        return points

    def shared_whitened(self, points: Float[np.ndarray, "point shared"]) -> Float[np.ndarray, "point shared"]:
        """Standard normal coordinates of shared numbers."""
        return np.ascontiguousarray(solve_triangular(self.root, (points - self.mean).T, lower=True).T)


@dataclass(frozen=True)
class Expansions:
    """Expansion of the negative log density of all videos together.

    Parameters
    ----------
    prior
        That of the shared numbers' prior.
    videos
        Those of the videos.
    """

    prior: SharedExpansion
    videos: tuple[Expansion, ...]

    @cached_property
    def _triangle(self) -> Float[np.ndarray, "shared shared"]:
        """Upper-triangular root of the curvature in the shared numbers when all own ones follow."""
        return upper_root(np.concatenate([self.prior.rows, *(one.reduced_rows for one in self.videos)]))

    @property
    def root(self) -> Float[np.ndarray, "shared shared"]:
        """Lower-triangular root of the covariance of the shared numbers."""
        return _covariance_root(self._triangle)

    @cached_property
    def gradient(self) -> Float[np.ndarray, "shared"]:
        """Gradient in the shared numbers when all own ones follow."""
        return self.prior.gradient + sum(one.reduced_gradient for one in self.videos)

    @cached_property
    def shared_step(self) -> Float[np.ndarray, "shared"]:
        """Newton step of the shared numbers when all own ones follow."""
        return -self._solve(self.gradient)

    def step_without(self, number: int) -> tuple[Float[np.ndarray, "shared"], float]:
        """Newton step of the shared numbers with one of them held, and the gain (nats) that it promises."""
        moved = np.delete(np.arange(len(self.gradient)), number)
        root, step = upper_root(self._triangle[:, moved]), np.zeros(len(self.gradient))
        pulled = solve_triangular(root, self.gradient[moved], trans="T")
        step[moved] = -solve_triangular(root, pulled)
        return step, float(pulled @ pulled) / 2

    @property
    def shared_gain(self) -> float:
        """Gain in log density (nats) that the Newton step of the shared numbers promises."""
        return -float(self.gradient @ self.shared_step) / 2

    @property
    def expected_gain(self) -> float:
        """Gain in log density (nats) that the Newton step of all numbers promises."""
        return self.shared_gain + sum(one.promised for one in self.videos)

    def consensus(
        self, prior_at: Float[np.ndarray, "shared"], places: Sequence[Float[np.ndarray, "shared"]]
    ) -> Float[np.ndarray, "shared"]:
        """Best shared numbers where each video was expanded around a place of its own, and the prior around another."""
        pull = self.prior.curvature @ prior_at - self.prior.gradient
        for one, place in zip(self.videos, places, strict=True):
            pull = pull + one.reduced @ place - one.reduced_gradient
        return self._solve(pull)

    def gaussian(
        self,
        shared: Float[np.ndarray, "shared"],
        locals_: Sequence[Float[np.ndarray, "_"]],
        logarithms: Bool[np.ndarray, "shared"],
    ) -> ArrowGaussian:
        """The Gaussian around a maximum at which all were expanded."""
        blocks = (one.around(local, logarithms) for local, one in zip(locals_, self.videos, strict=True))
        return ArrowGaussian(shared, self.root, tuple(blocks), logarithms)

    def _solve(self, vector: Float[np.ndarray, "shared"]) -> Float[np.ndarray, "shared"]:
        """A vector divided by the curvature in the shared numbers."""
        pulled = solve_triangular(self._triangle, vector, trans="T")
        solution: np.ndarray = solve_triangular(self._triangle, pulled)
        return solution


def _covariance_root(triangle: Float[np.ndarray, "number number"]) -> Float[np.ndarray, "number number"]:
    """Lower-triangular root of the covariance, from an upper-triangular root of the precision."""
    return lower_root(solve_triangular(triangle, np.eye(len(triangle))))

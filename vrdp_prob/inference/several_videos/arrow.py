"""A Gaussian over shared numbers and the own numbers of many videos, whose precision has the shape of an arrow.

Given the shared numbers the videos know nothing of each other. So each video's own numbers are eliminated by
themselves (Schur complement), and nothing ever has the size of all videos together. Source: Triggs, McLauchlan,
Hartley and Fitzgibbon, Bundle adjustment: a modern synthesis, Vision Algorithms (2000), section 6.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float
from scipy.linalg import solve_triangular

from vrdp_prob.inference.samples import Gaussian

LARGEST_LOGARITHM = 5.0
LOG_TWO_PI = float(np.log(2 * np.pi))


@dataclass(frozen=True)
class Expansion:
    """Second-order expansion of a video's negative log density in the shared numbers and its own.

    Parameters
    ----------
    shared_gradient, local_gradient
        First derivatives.
    shared, cross, local
        Blocks of the Gauss-Newton curvature; rows of `cross` are the video's own numbers.
    """

    shared_gradient: Float[np.ndarray, "shared"]
    local_gradient: Float[np.ndarray, "local"]
    shared: Float[np.ndarray, "shared shared"]
    cross: Float[np.ndarray, "local shared"]
    local: Float[np.ndarray, "local local"]

    def damped(self, damping: float) -> "Expansion":
        """With every number's curvature larger by a share of it."""
        return Expansion(
            self.shared_gradient,
            self.local_gradient,
            self.shared + damping * np.diag(np.diag(self.shared)),
            self.cross,
            self.local + damping * np.diag(np.diag(self.local)),
        )

    @cached_property
    def local_root(self) -> Float[np.ndarray, "local local"]:
        """Lower-triangular root of the covariance of the video's own numbers, given the shared ones."""
        return Gaussian.from_precision(np.zeros(len(self.local)), self.local).root

    @cached_property
    def slope(self) -> Float[np.ndarray, "local shared"]:
        """How the best own numbers move with the shared ones."""
        return -self.local_root @ (self.local_root.T @ self.cross)

    def around(self, local: Float[np.ndarray, "local"], logarithms: Bool[np.ndarray, "shared"]) -> "LocalGaussian":
        """The Gaussian of the own numbers around a maximum at which they were expanded."""
        return LocalGaussian(local, self.slope, self.local_root, logarithms)

    @cached_property
    def local_step(self) -> Float[np.ndarray, "local"]:
        """Newton step of the own numbers where the shared ones stay."""
        return -self.local_root @ (self.local_root.T @ self.local_gradient)

    @property
    def reduced(self) -> Float[np.ndarray, "shared shared"]:
        """Curvature in the shared numbers when the own ones follow them."""
        reduced = self.shared + self.cross.T @ self.slope
        return (reduced + reduced.T) / 2

    @property
    def reduced_gradient(self) -> Float[np.ndarray, "shared"]:
        """Gradient in the shared numbers when the own ones follow them."""
        return self.shared_gradient + self.cross.T @ self.local_step


@dataclass(frozen=True)
class SharedExpansion:
    """Expansion of the negative log prior of the shared numbers."""

    gradient: Float[np.ndarray, "shared"]
    curvature: Float[np.ndarray, "shared shared"]


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

    def damped(self, damping: float) -> "Expansions":
        """With every number's curvature larger by a share of it."""
        curvature = self.prior.curvature
        prior = SharedExpansion(self.prior.gradient, curvature + damping * np.diag(np.diag(curvature)))
        return Expansions(prior, tuple(one.damped(damping) for one in self.videos))

    @cached_property
    def curvature(self) -> Float[np.ndarray, "shared shared"]:
        """Curvature in the shared numbers when all own ones follow."""
        return self.prior.curvature + sum(one.reduced for one in self.videos)

    @cached_property
    def gradient(self) -> Float[np.ndarray, "shared"]:
        """Gradient in the shared numbers when all own ones follow."""
        return self.prior.gradient + sum(one.reduced_gradient for one in self.videos)

    @cached_property
    def shared_step(self) -> Float[np.ndarray, "shared"]:
        """Newton step of the shared numbers when all own ones follow."""
        return -_solve(self.curvature, self.gradient)

    @property
    def expected_gain(self) -> float:
        """Gain in log density (nats) that the Newton step promises."""
        own = sum(float(one.local_gradient @ one.local_step) for one in self.videos)
        return -(float(self.gradient @ self.shared_step) + own) / 2

    def consensus(
        self, prior_at: Float[np.ndarray, "shared"], places: Sequence[Float[np.ndarray, "shared"]]
    ) -> Float[np.ndarray, "shared"]:
        """Best shared numbers where each video was expanded around a place of its own, and the prior around another."""
        pull = self.prior.curvature @ prior_at - self.prior.gradient
        for one, place in zip(self.videos, places, strict=True):
            pull = pull + one.reduced @ place - one.reduced_gradient
        return _solve(self.curvature, pull)

    def gaussian(
        self,
        shared: Float[np.ndarray, "shared"],
        locals_: Sequence[Float[np.ndarray, "_"]],
        logarithms: Bool[np.ndarray, "shared"],
    ) -> ArrowGaussian:
        """The Gaussian around a maximum at which all were expanded."""
        root = Gaussian.from_precision(shared, self.curvature).root
        blocks = (one.around(local, logarithms) for local, one in zip(locals_, self.videos, strict=True))
        return ArrowGaussian(shared, root, tuple(blocks), logarithms)


def _solve(
    precision: Float[np.ndarray, "shared shared"], vector: Float[np.ndarray, "shared"]
) -> Float[np.ndarray, "shared"]:
    root = Gaussian.from_precision(np.zeros(len(vector)), precision).root
    solution: Float[np.ndarray, "shared"] = root @ (root.T @ vector)
    return solution

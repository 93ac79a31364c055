"""What is known of a posterior before it is sampled: a mixture of curved Student-t clouds, one around each mode.

It proposes, its density corrects what was proposed, and the coordinates of its components are those in which samplers
move.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int
from scipy.special import gammaln, logsumexp

from vrdp_prob.inference.samplers.curved_gaussian import CurvedGaussian, SeveralClouds

DEGREES_OF_FREEDOM = 30.0
"""Tails of the components: heavier than Gaussian, light enough to lose little in 40 dimensions."""


Random = np.random.Generator | np.random.RandomState
"""Source of randomness: that of the caller, or that of an emcee ensemble."""


@dataclass(frozen=True)
class Mixture:
    """Curved Student-t clouds with weights.

    Parameters
    ----------
    components
        One per mode, or several that share one.
    log_weights
        Logarithms of their weights, which add up to 1.
    """

    components: tuple[CurvedGaussian, ...]
    log_weights: Float[np.ndarray, "component"]

    @classmethod
    def of(cls, *components: CurvedGaussian, log_weights: Float[np.ndarray, "component"] | None = None) -> "Mixture":
        """Mixture of some components by any weights, equal ones where none are given; sorted and normalised."""
        weights = np.zeros(len(components)) if log_weights is None else np.asarray(log_weights, dtype=float)
        order = np.argsort(-weights, kind="stable")
        return cls(tuple(components[index] for index in order), weights[order] - logsumexp(weights))

    def joined(self, other: "Mixture", share: float) -> "Mixture":
        """Mixture of the components of both, a share of its weight on those of the other."""
        log_weights = np.concatenate([self.log_weights + np.log1p(-share), other.log_weights + np.log(share)])
        return Mixture.of(*self.components, *other.components, log_weights=log_weights)

    @property
    def dimension(self) -> int:
        """Number of coordinates."""
        return self.components[0].dimension

    @property
    def weights(self) -> Float[np.ndarray, "component"]:
        """Weights of the components."""
        return np.exp(self.log_weights)

    def log_densities(self, points: Float[np.ndarray, "point dimension"]) -> Float[np.ndarray, "component point"]:
        """Log density of each component, weights left out."""
        dimension, freedom = self.dimension, DEGREES_OF_FREEDOM
        constant = gammaln((freedom + dimension) / 2) - gammaln(freedom / 2) - dimension / 2 * np.log(freedom * np.pi)
        squares = (self._clouds.whitened(points) ** 2).sum(axis=2)
        falling = (freedom + dimension) / 2 * np.log1p(squares / freedom)
        return np.asarray(constant - self._log_volumes[:, None] - falling)

    @cached_property
    def _log_volumes(self) -> Float[np.ndarray, "component"]:
        return np.array([component.log_volume for component in self.components])

    @cached_property
    def _clouds(self) -> SeveralClouds:
        return SeveralClouds(self.components)

    def log_density(self, points: Float[np.ndarray, "point dimension"]) -> Float[np.ndarray, "point"]:
        """Log density of the mixture, normalised."""
        values: np.ndarray = logsumexp(self.log_densities(points) + self.log_weights[:, None], axis=0)
        return values

    def memberships(self, points: Float[np.ndarray, "point dimension"]) -> Float[np.ndarray, "point component"]:
        """Probability that a point comes from each component; rows add up to 1."""
        joint = self.log_densities(points) + self.log_weights[:, None]
        return np.exp(joint - logsumexp(joint, axis=0)).T

    def regions(self, points: Float[np.ndarray, "point dimension"]) -> Int[np.ndarray, "point"]:
        """The component that each point most probably comes from."""
        return np.asarray(self.memberships(points).argmax(axis=1))

    def draws(
        self, count: int, random: Random
    ) -> tuple[Float[np.ndarray, "point dimension"], Int[np.ndarray, "point"]]:
        """Points, and the component that each comes from."""
        chosen = random.choice(len(self.components), size=count, p=self.weights)
        whitened = _student_t(count, self.dimension, random)
        points = np.empty_like(whitened)
        for index in np.unique(chosen):
            points[chosen == index] = self.components[index].points(whitened[chosen == index])
        return points, chosen


@dataclass(frozen=True)
class Jumps:
    """Proposals that reach what lies beyond the clouds around the modes, and places there.

    Parameters
    ----------
    mixture
        What proposes.
    places
        Points in proportion to the posterior, as far as weighted draws tell.
    """

    mixture: Mixture
    places: Float[np.ndarray, "place dimension"]

    def starts(self, count: int, generator: np.random.Generator) -> Float[np.ndarray, "count dimension"]:
        """Places for chains to set out from."""
        return self.places[generator.choice(len(self.places), size=count)]


def _student_t(count: int, dimension: int, random: Random) -> Float[np.ndarray, "point dimension"]:
    normal = random.standard_normal((count, dimension))
    return np.asarray(normal / np.sqrt(random.chisquare(DEGREES_OF_FREEDOM, count) / DEGREES_OF_FREEDOM)[:, None])

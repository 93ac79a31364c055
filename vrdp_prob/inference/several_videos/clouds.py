"""What is known beforehand of a video's own numbers given the shared ones: one bent cloud around each mode."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.special import gammaln, logsumexp

from vrdp_prob.inference.several_videos.arrow import ArrowGaussian
from vrdp_prob.inference.several_videos.bends import BentLocal, bent_local
from vrdp_prob.inference.several_videos.joint_fit import JointFit, LocalMode
from vrdp_prob.inference.several_videos.linking import LinkedVideo
from vrdp_prob.inference.several_videos.shaping import Shape
from vrdp_prob.inference.several_videos.slice_steps import DEGREES_OF_FREEDOM, reference_draws, reference_log_density

LEAST_WEIGHT = 0.05
"""Weight that every mode has at least, since Laplace's approximation is a guess."""


@dataclass(frozen=True)
class Cloud:
    """A Student-t cloud of own numbers around one mode.

    Parameters
    ----------
    bent
        Map from whitened coordinates to own numbers.
    shape
        Affine map that comes before, shaped by draws.
    """

    bent: BentLocal
    shape: Shape

    def points(
        self, places: Float[np.ndarray, "point local"], shared: Float[np.ndarray, "point shared"]
    ) -> Float[np.ndarray, "point local"]:
        """Own numbers of places in the cloud."""
        return self.bent.points(self.shape.whitened(places, shared), shared)

    def places(
        self, points: Float[np.ndarray, "point local"], shared: Float[np.ndarray, "point shared"]
    ) -> Float[np.ndarray, "point local"]:
        """Places in the cloud of own numbers."""
        return self.shape.places(self.bent.whitened(points, shared), shared)

    def log_density(
        self, points: Float[np.ndarray, "point local"], shared: Float[np.ndarray, "point shared"]
    ) -> Float[np.ndarray, "point"]:
        """Log density of the cloud, normalised."""
        dimension, degrees = points.shape[1], DEGREES_OF_FREEDOM
        constant = gammaln((degrees + dimension) / 2) - gammaln(degrees / 2) - dimension / 2 * np.log(degrees * np.pi)
        volume = self.bent.gaussian.log_volume + float(np.log(np.diag(self.shape.scale)).sum())
        return float(constant) - volume + reference_log_density(self.places(points, shared))


@dataclass(frozen=True)
class Clouds:
    """Clouds around all modes of a video's own numbers.

    Parameters
    ----------
    clouds
        One per mode.
    log_weights
        Logarithms of their weights, which add up to 1.
    """

    clouds: tuple[Cloud, ...]
    log_weights: Float[np.ndarray, "mode"]

    @classmethod
    def of(
        cls,
        video: LinkedVideo,
        arrow: ArrowGaussian,
        modes: tuple[LocalMode, ...],
        generator: np.random.Generator,
    ) -> "Clouds":
        """Clouds that are bent as the density is."""
        unit = Shape.unit(len(modes[0].gaussian.centre), len(arrow.mean))
        clouds = tuple(Cloud(bent_local(video, arrow, mode.gaussian, generator), unit) for mode in modes)
        weights = np.exp([mode.log_weight for mode in modes])
        weights = np.maximum(weights / weights.sum(), LEAST_WEIGHT)
        return cls(clouds, np.log(weights / weights.sum()))

    @classmethod
    def of_fit(cls, fit: JointFit, index: int, generator: np.random.Generator) -> "Clouds":
        """Clouds of one video of a fit."""
        return cls.of(fit.videos[index], fit.gaussian, fit.modes(index), generator)

    @property
    def dimension(self) -> int:
        """Number of own numbers."""
        return len(self.clouds[0].bent.axes)

    def centres(self, shared: Float[np.ndarray, "point shared"]) -> Float[np.ndarray, "point local"]:
        """Middle of the first cloud for some whitened shared numbers."""
        return self.clouds[0].points(np.zeros((len(shared), self.dimension)), shared)

    def draws(
        self, shared: Float[np.ndarray, "point shared"], generator: np.random.Generator
    ) -> tuple[Float[np.ndarray, "point local"], Int[np.ndarray, "point"]]:
        """Own numbers for some whitened shared ones, and the cloud that each comes from."""
        labels = generator.choice(len(self.clouds), size=len(shared), p=np.exp(self.log_weights))
        return self.points(reference_draws(len(shared), self.dimension, generator), shared, labels), labels

    def points(
        self,
        places: Float[np.ndarray, "point local"],
        shared: Float[np.ndarray, "point shared"],
        labels: Int[np.ndarray, "point"],
    ) -> Float[np.ndarray, "point local"]:
        """Own numbers of places, each in its cloud."""
        return self._each(places, shared, labels, inverse=False)

    def places(
        self,
        points: Float[np.ndarray, "point local"],
        shared: Float[np.ndarray, "point shared"],
        labels: Int[np.ndarray, "point"],
    ) -> Float[np.ndarray, "point local"]:
        """Places of own numbers, each in its cloud."""
        return self._each(points, shared, labels, inverse=True)

    def log_joint(
        self, points: Float[np.ndarray, "point local"], shared: Float[np.ndarray, "point shared"]
    ) -> Float[np.ndarray, "mode point"]:
        """Log of weight times density of each cloud."""
        each = np.stack([cloud.log_density(points, shared) for cloud in self.clouds])
        values: np.ndarray = each + self.log_weights[:, None]
        return values

    def log_density(
        self, points: Float[np.ndarray, "point local"], shared: Float[np.ndarray, "point shared"]
    ) -> Float[np.ndarray, "point"]:
        """Log density of all clouds together, normalised."""
        values: np.ndarray = logsumexp(self.log_joint(points, shared), axis=0)
        return values

    def _each(
        self,
        numbers: Float[np.ndarray, "point local"],
        shared: Float[np.ndarray, "point shared"],
        labels: Int[np.ndarray, "point"],
        *,
        inverse: bool,
    ) -> Float[np.ndarray, "point local"]:
        result = np.empty_like(numbers)
        for label, cloud in enumerate(self.clouds):
            chosen = labels == label
            if chosen.any():
                change = cloud.places if inverse else cloud.points
                result[chosen] = change(numbers[chosen], shared[chosen])
        return result

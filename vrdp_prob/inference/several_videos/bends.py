"""Each video's own numbers given the shared ones, along the bends of the posterior's ridges.

The more drag all bodies have, the less friction explains the same motion, and not in proportion: a straight regression
of the own on the shared numbers leaves the ridge. The curve to second order follows from how the residuals bend. The
map is a shear, so it keeps volumes, and it can be undone. Source as in `curved_gaussian.py`: Parno and Marzouk (2018);
Bates and Watts (1980).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from vrdp_prob.inference.samplers.second_differences import second_differences
from vrdp_prob.inference.several_videos.arrow import ArrowGaussian, LocalGaussian
from vrdp_prob.inference.several_videos.linking import LinkedVideo

MOST_BENT = 4
"""Largest number of a video's own axes along which others are bent."""
SMALLEST_BEND = 0.3
"""Bend, in standard deviations at one standard deviation from the mode, below which an axis counts as straight."""
PROBES = 64
"""Places at which a bent map has to do better than a straight one."""


@dataclass(frozen=True)
class BentLocal:
    """Map from standard normal coordinates to a video's own numbers, given whitened shared numbers.

    Parameters
    ----------
    gaussian
        The straight Gaussian.
    root
        Cholesky factor of the shared numbers' covariance, which whitens them.
    axes
        Own directions along which the others are bent; orthonormal.
    bend
        Displacement, across `axes`, per product of two coordinates: the whitened shared ones, then those along `axes`.
    """

    gaussian: LocalGaussian
    root: Float[np.ndarray, "shared shared"]
    axes: Float[np.ndarray, "local bent"]
    bend: Float[np.ndarray, "pair_side pair_side local"]

    @classmethod
    def straight(cls, gaussian: LocalGaussian, root: Float[np.ndarray, "shared shared"]) -> "BentLocal":
        """A Gaussian as it is."""
        count, shared = len(gaussian.centre), len(root)
        return cls(gaussian, root, np.zeros((count, 0)), np.zeros((shared, shared, count)))

    def points(
        self, whitened: Float[np.ndarray, "*batch local"], shared: Float[np.ndarray, "*batch shared"]
    ) -> Float[np.ndarray, "*batch local"]:
        """Own numbers of standard normal coordinates."""
        return self.gaussian.points(whitened + self._displacement(whitened, shared), shared @ self.root.T)

    def whitened(
        self, points: Float[np.ndarray, "*batch local"], shared: Float[np.ndarray, "*batch shared"]
    ) -> Float[np.ndarray, "*batch local"]:
        """Standard normal coordinates of own numbers."""
        bent = self.gaussian.whitened(points, shared @ self.root.T)
        return bent - self._displacement(bent, shared)  # the coordinates along the axes are not displaced

    def _displacement(
        self, whitened: Float[np.ndarray, "*batch local"], shared: Float[np.ndarray, "*batch shared"]
    ) -> Float[np.ndarray, "*batch local"]:
        sides = np.concatenate([shared, whitened @ self.axes], axis=-1)
        displacement: np.ndarray = np.einsum("...a,...b,abk->...k", sides, sides, self.bend, optimize=True) / 2
        return displacement


def bent_local(
    video: LinkedVideo, arrow: ArrowGaussian, local: LocalGaussian, generator: np.random.Generator
) -> BentLocal:
    """The map around a mode of a video, bent along shared and own numbers, shared ones alone, or straight.

    It is the one that is nearest to the density at random places.
    """
    straight = BentLocal.straight(local, arrow.root)
    own, count = len(straight.axes), len(arrow.mean)
    tensor = _tensor(video, arrow, straight)
    directions, sizes, _ = np.linalg.svd(tensor[count:].reshape(own, -1), full_matrices=False)
    strongest = directions[:, : min(MOST_BENT, int((sizes >= SMALLEST_BEND).sum()))]
    shared, normal = generator.standard_normal((PROBES, count)), generator.standard_normal((PROBES, own))
    tried = [straight, *(_bent(straight, axes, tensor) for axes in (strongest[:, :0], strongest))]
    log_normal, points = (normal**2).sum(axis=1) / 2, arrow.shared_points(shared)
    spreads = [spread(video.log_density(points, one.points(normal, shared)) + log_normal) for one in tried]
    return tried[int(np.argmin(spreads))]


def spread(log_ratio: Float[np.ndarray, "place"]) -> float:
    """How far the log of density over map differs from place to place; places without support count as far off."""
    low, high = np.quantile(np.maximum(log_ratio, log_ratio.max() - 1e6), [0.1, 0.9])
    return float(high - low)


def _bent(
    straight: BentLocal,
    axes: Float[np.ndarray, "local bent"],
    tensor: Float[np.ndarray, "all all local"],
) -> BentLocal:
    count = len(straight.root)
    sides = np.block([[np.eye(count), np.zeros((count, axes.shape[1]))], [np.zeros((len(axes), count)), axes]])
    across = np.eye(len(axes)) - axes @ axes.T
    bend = np.einsum("ia,jb,ijk,kl->abl", sides, sides, tensor, across, optimize=True)
    return BentLocal(straight.gaussian, straight.root, axes, bend)


def _tensor(video: LinkedVideo, arrow: ArrowGaussian, straight: BentLocal) -> Float[np.ndarray, "all all local"]:
    """Displacement, per product of two whitened coordinates (shared, then own), that keeps the residuals small."""
    shared, own = len(arrow.mean), len(straight.axes)

    def residuals(places: Float[np.ndarray, "point all"]) -> Float[np.ndarray, "point residual"]:
        numbers = straight.points(places[:, shared:], places[:, :shared])
        return video.data.residuals(video.points(arrow.shared_points(places[:, :shared]), numbers))

    found = second_differences(residuals, shared + own)
    return found.displacement(found.first_derivative[shared:])

"""Coordinates in which the posterior of the shared numbers is nearly Gaussian.

Positive numbers are inferred as logarithms. There friction and drag make up for each other along an exponential curve,
and a drag that may as well be 0 has a plateau that never ends. So each shared number is regressed on those before it,
where the less well known come first and logarithms count by their exponential, and where it is nearer to the density
the numbers themselves are taken as normal, not their logarithms.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import solve_triangular

from vrdp_prob.inference.several_videos.arrow import ArrowGaussian, grown
from vrdp_prob.inference.several_videos.bends import spread
from vrdp_prob.inference.several_videos.clouds import Clouds
from vrdp_prob.inference.several_videos.joint_fit import JointFit

PROBES, PROBE_SPREAD = 128, 1.5
"""Places at which maps are compared, and their standard deviation: tails matter."""
LEAST_SUPPORT = 0.6
"""Share of these places that must have support."""
SMALLEST_SHARE = 1e-6
"""Share of the most probable value below which a positive number does not go."""


@dataclass(frozen=True)
class SharedRidge:
    """Map from standard normal coordinates to whitened shared numbers.

    Parameters
    ----------
    arrow
        The Gaussian that whitens.
    order
        Shared numbers, the least known first.
    slopes
        Regression of each on those before it, in that order.
    sd
        What is left of each one's standard deviation, in that order.
    curved
        Whether logarithms count by their exponential in the regression.
    linear
        Whether the exponentials of logarithms are normal.
    """

    arrow: ArrowGaussian
    order: Int[np.ndarray, "shared"]
    slopes: Float[np.ndarray, "shared shared"]
    sd: Float[np.ndarray, "shared"]
    curved: bool
    linear: bool

    @classmethod
    def of(cls, fit: JointFit, clouds: Sequence[Clouds], generator: np.random.Generator) -> "SharedRidge":
        """The Gaussian, or the map that is nearer to the density at random places."""
        arrow = fit.gaussian
        order = np.argsort(-arrow.sd, kind="stable")
        covariance = (arrow.root @ arrow.root.T)[np.ix_(order, order)]
        root = np.linalg.cholesky(covariance)
        sd = np.diag(root)
        slopes = np.eye(len(sd)) - np.linalg.inv(root / sd)
        kinds = ((False, False), (True, False), (True, True))
        tried = [cls(arrow, order, slopes, sd, curved, linear) for curved, linear in kinds]
        probes = PROBE_SPREAD * generator.standard_normal((PROBES, len(sd)))
        return min(tried, key=lambda one: _misfit(fit, clouds, one, probes))

    def whitened(
        self, places: Float[np.ndarray, "point shared"]
    ) -> tuple[Float[np.ndarray, "point shared"], Float[np.ndarray, "point"]]:
        """Whitened shared numbers of standard normal coordinates, and the log of the volume made of theirs.

        That is -inf (and the numbers are 0) where a positive number would be negative.
        """
        departure, log_volume = np.zeros_like(places), np.zeros(len(places))
        curved, linear = (self.arrow.logarithms & which for which in (self.curved, self.linear))
        for row, number in enumerate(self.order):
            before = self.order[:row]
            follows = grown(departure[:, before], curved[before]) @ self.slopes[row, :row]
            departure[:, number] = follows + self.sd[row] * places[:, row]
            if linear[number]:
                share = 1 + departure[:, number]
                departure[:, number] = np.log(np.maximum(share, SMALLEST_SHARE))
                log_volume -= np.where(share > SMALLEST_SHARE, departure[:, number], np.inf)
        departure[~np.isfinite(log_volume)] = 0.0
        return np.ascontiguousarray(solve_triangular(self.arrow.root, departure.T, lower=True).T), log_volume


def _misfit(
    fit: JointFit, clouds: Sequence[Clouds], ridge: SharedRidge, probes: Float[np.ndarray, "point shared"]
) -> float:
    """How far the log of density over map differs from place to place; infinite where many have no support."""
    whitened, log_volume = ridge.whitened(probes)
    ratio = (_log_density(fit, clouds, whitened) + log_volume + (probes**2).sum(axis=1) / 2)[np.isfinite(log_volume)]
    return spread(ratio) if len(ratio) > LEAST_SUPPORT * len(probes) else float("inf")


def _log_density(
    fit: JointFit, clouds: Sequence[Clouds], whitened: Float[np.ndarray, "point shared"]
) -> Float[np.ndarray, "point"]:
    """Log density at the videos' best own numbers."""
    shared = fit.gaussian.shared_points(whitened)
    total = fit.numbers.log_prior(shared)
    for video, one in zip(fit.videos, clouds, strict=True):
        total = total + video.log_density(shared, one.centres(whitened))
    return total

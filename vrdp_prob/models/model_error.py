"""The explicit term for what a model leaves unexplained: a random acceleration of every body.

The acceleration is a Gaussian process that forgets itself exponentially; the path strays by its double integral, more
and more after the release. So an unknown force leaves room where it acts, on velocities too, while noise stays what it
is. Source: Kennedy and O'Hagan, Bayesian calibration of computer models, Journal of the Royal Statistical Society B 63
(2001), equation 4 (a model's discrepancy as a Gaussian process); Singer, Estimating optimal tracking filter performance
for manned maneuvering targets, IEEE Transactions on Aerospace and Electronic Systems 6 (1970) (this process).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor

from vrdp_prob.models.observation import Observations


@dataclass(frozen=True)
class ModelError:
    """Size and duration of the accelerations that a model leaves out, and the noise beside it.

    The noise is no unknown where there is a model error, so its size belongs here.

    Parameters
    ----------
    noise_scale, angle_noise_scale
        Scales of the noise.
    acceleration
        Standard deviation of the acceleration along each axis, in units of the noise per s^2.
    angular_acceleration
        The same about the vertical axis, in units of the angle noise per s^2.
    duration
        Time in s after which the acceleration is another.
    position_variance, angle_variance
        Factor of the noise variance of each position and angle; above 1 for outliers.
    """

    noise_scale: float
    angle_noise_scale: float
    acceleration: float
    angular_acceleration: float
    duration: float
    position_variance: Float[np.ndarray, "observation"]
    angle_variance: Float[np.ndarray, "angle"]


def straying(times: Float[np.ndarray, "time"], release: float, duration: float) -> Float[np.ndarray, "time time"]:
    """Covariance (s^4) of the double integral, from a release time on, of an acceleration of unit variance.

    With the acceleration's correlation exp(-|u - v| / duration) the integrals over u and v have a closed form.
    """
    since = (times - release) / duration
    early, late = np.minimum(since[:, None], since), np.maximum(since[:, None], since)
    between = late - early
    fade = np.exp(-since)
    fade = np.maximum(fade[:, None], fade)
    forgotten = 1 - (1 + early) * fade
    together = (
        2 * (early**3 / 3 + between * early**2 / 2)
        - (1 + early) * (late * (1 - fade) - forgotten)
        + (between + 1 - fade * (late + 1))
    )
    afterwards = forgotten * (between - 1 + np.exp(-between))
    covariance: np.ndarray = duration**4 * (together + afterwards)
    return covariance


@dataclass(frozen=True)
class Strand:
    """The numbers of one body that stray together: its seen positions, or its measured angles.

    The two axes are strands of their own unless the noise mixes them; then x and y come in turn.

    Parameters
    ----------
    places
        Their places among all position (or angle) residuals.
    times
        Times in s at which it was seen.
    release
        Time in s of the body's release.
    sensitivity
        Change of each residual, at noise scale 1, per unit of straying along each of the strand's directions, where the
        unit is the noise that scale 1 stands for.
    """

    places: Int[np.ndarray, "number"]
    times: Float[np.ndarray, "seen"]
    release: float
    sensitivity: Float[np.ndarray, "number direction"]

    def covariance(
        self, size: float, duration: float, variance: Float[np.ndarray, "all_numbers"]
    ) -> Float[np.ndarray, "number number"]:
        """Covariance of the residuals in units of the noise: independent noise plus straying of a size."""
        if not size:
            return np.diag(variance[self.places])
        numbers = len(self.places) // len(self.times)
        paths = straying(self.times, self.release, duration)
        if numbers > 1:
            paths = np.kron(paths, np.ones((numbers, numbers)))
        covariance = size**2 * (self.sensitivity @ self.sensitivity.T) * paths
        covariance[np.diag_indices(len(covariance))] += variance[self.places]
        return covariance

    def strays_like(self, other: "Strand", variance: Float[np.ndarray, "all_numbers"]) -> bool:
        """Whether the covariance is that of another strand, whatever the size and duration."""
        moments = np.array_equal(self.times, other.times) and bool(self.release == other.release)
        response = np.array_equal(self.sensitivity, other.sensitivity)
        return moments and response and np.array_equal(variance[self.places], variance[other.places])


def by_law(strands: Sequence[Strand], variance: Float[np.ndarray, "number"]) -> list[list[Strand]]:
    """Strands in groups of one covariance."""
    groups: list[list[Strand]] = []
    for strand in strands:
        alike = (group for group in groups if strand.strays_like(group[0], variance))
        found = next(alike, None)
        if found is None:
            groups.append([strand])
        else:
            found.append(strand)
    return groups


@dataclass(frozen=True)
class Strands:
    """All residuals of a video, strand by strand."""

    positions: tuple[Strand, ...]
    angles: tuple[Strand, ...]

    @classmethod
    def of(cls, observations: Observations, times: Float[np.ndarray, "time"]) -> "Strands":
        """The strands of what was seen; in each the numbers are in order of time."""
        positions, angles = [], []
        whitening = observations.position_reference * observations.whitening
        axes = [[0], [1]] if not whitening[:, [0, 1], [1, 0]].any() else [[0, 1]]
        for body in range(observations.body_count):
            seen = np.flatnonzero(observations.body == body)
            if not len(seen):
                continue
            moments = times[observations.frame[seen]]
            for chosen in axes:
                places = (2 * seen[:, None] + np.array(chosen)).ravel()
                sensitivity = whitening[seen][:, chosen][:, :, chosen].reshape(len(places), len(chosen))
                positions.append(Strand(places, moments, moments[0], sensitivity))
            turned = np.flatnonzero(observations.angle_body == body)
            if len(turned):
                angle_moments = times[observations.angle_frame[turned]]
                angles.append(Strand(turned, angle_moments, moments[0], np.ones((len(turned), 1))))
        return cls(tuple(positions), tuple(angles))


Factors = tuple[tuple[Int[Tensor, "_"], Float[Tensor, "_ _"]], ...]


@dataclass(frozen=True)
class Whitening:
    """Turns residuals that stray into independent ones of unit variance.

    Parameters
    ----------
    positions, angles
        Per strand its places and the inverse of its covariance's Cholesky factor.
    """

    positions: Factors
    angles: Factors

    @classmethod
    def of(cls, error: ModelError, strands: Strands) -> "Whitening":
        """The whitening of a model error."""
        variance = np.repeat(error.position_variance, 2)
        return cls(
            factors(strands.positions, error.acceleration, error.duration, variance),
            factors(strands.angles, error.angular_acceleration, error.duration, error.angle_variance),
        )

    @cached_property
    def position_log_volume(self) -> Float[np.ndarray, "number"]:
        """Logarithm of the factor by which each position residual was stretched, in the order of the residuals."""
        return _log_diagonals(self.positions)

    @cached_property
    def angle_log_volume(self) -> Float[np.ndarray, "angle"]:
        """The same for each angle residual."""
        return _log_diagonals(self.angles)

    def whitened_positions(self, residuals: Float[Tensor, "point number"]) -> Float[Tensor, "point number"]:
        """Independent residuals of positions; of a video's first frames where only these are given."""
        return _whitened(residuals, self.positions)

    def whitened_angles(self, residuals: Float[Tensor, "point number"]) -> Float[Tensor, "point number"]:
        """Independent residuals of angles."""
        return _whitened(residuals, self.angles)


def factors(
    strands: Sequence[Strand], size: float, duration: float, variance: Float[np.ndarray, "all_numbers"]
) -> Factors:
    """The places of each strand and what makes its numbers independent; see `Strand.covariance`."""
    found: Factors = ()
    for alike in by_law(strands, variance):
        inverse = _inverse_root(alike[0].covariance(size, duration, variance))
        found += tuple((torch.from_numpy(strand.places), inverse) for strand in alike)
    return found


def _inverse_root(covariance: Float[np.ndarray, "number number"]) -> Float[Tensor, "number number"]:
    """Inverse of the Cholesky factor."""
    root = torch.from_numpy(np.linalg.cholesky(covariance))
    return torch.linalg.solve_triangular(root, torch.eye(len(root), dtype=torch.float64), upper=False)


def _whitened(residuals: Float[Tensor, "point number"], factors: Factors) -> Float[Tensor, "point number"]:
    """Each strand by its factor; the leading block where only the first numbers are given."""
    count = residuals.shape[1]
    result = residuals
    for places, inverse in factors:
        given = int((places < count).sum())
        chosen = places[:given]
        result = result.index_copy(1, chosen, residuals[:, chosen] @ inverse[:given, :given].T)
    return result


def _log_diagonals(factors: Factors) -> Float[np.ndarray, "number"]:
    count = sum(len(places) for places, _ in factors)
    values = np.zeros(count)
    for places, inverse in factors:
        values[places.numpy()] = torch.log(torch.diagonal(inverse)).numpy()
    return values

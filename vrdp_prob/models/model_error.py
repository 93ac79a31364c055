"""The explicit term for what a model leaves unexplained: every body strays from its simulated path by a random process.

The process is Gaussian with a Matern covariance of order 3/2: smooth, so it is a force that nobody wrote down and not
noise. Source: Kennedy and O'Hagan, Bayesian calibration of computer models, Journal of the Royal Statistical Society
B 63 (2001), equation 4; Rasmussen and Williams, Gaussian Processes for Machine Learning (2006), equation 4.17.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor

from vrdp_prob.models.observation import Observations


@dataclass(frozen=True)
class ModelError:
    """Size and duration of the errors of a model.

    Both sizes are in units of the noise, whose scale is inferred: noise and model error grow together.

    Parameters
    ----------
    position
        Standard deviation of the straying of a position, in units of the position noise.
    angle
        Standard deviation of the straying of an angle, in units of the angle noise.
    duration
        Time in s over which the straying keeps its direction.
    position_variance, angle_variance
        Factor of the noise variance of each position and angle; above 1 for outliers.
    """

    position: float
    angle: float
    duration: float
    position_variance: Float[np.ndarray, "observation"]
    angle_variance: Float[np.ndarray, "angle"]

    def correlation(self, times: Float[np.ndarray, "time"]) -> Float[np.ndarray, "time time"]:
        """Correlation of the straying at some times (s)."""
        distance = np.sqrt(3) * np.abs(times[:, None] - times[None]) / self.duration
        return (1 + distance) * np.exp(-distance)


@dataclass(frozen=True)
class Strand:
    """The numbers of one body that stray together: its seen positions (x and y in turn) or its measured angles.

    Parameters
    ----------
    places
        Their places among all position (or angle) residuals.
    times
        Time in s of each number.
    sensitivity
        Change of each residual, at noise scale 1, per unit of straying along each of the strand's directions, where the
        unit is the noise that scale 1 stands for.
    """

    places: Int[np.ndarray, "number"]
    times: Float[np.ndarray, "number"]
    sensitivity: Float[np.ndarray, "number direction"]

    def covariance(
        self, error: ModelError, size: float, variance: Float[np.ndarray, "all_numbers"]
    ) -> Float[np.ndarray, "number number"]:
        """Covariance of the residuals in units of the noise: independent noise plus straying of a size."""
        alike = self.sensitivity @ self.sensitivity.T
        return np.diag(variance[self.places]) + size**2 * alike * error.correlation(self.times)


@dataclass(frozen=True)
class Strands:
    """All residuals of a video, strand by strand."""

    positions: tuple[Strand, ...]
    angles: tuple[Strand, ...]

    @classmethod
    def of(cls, observations: Observations, times: Float[np.ndarray, "time"]) -> "Strands":
        """The strands of what was seen; in each the numbers are in order of time."""
        positions, angles = [], []
        for body in range(observations.body_count):
            seen = np.flatnonzero(observations.body == body)
            if len(seen):
                places = np.stack([2 * seen, 2 * seen + 1], axis=1).ravel()
                whitening = observations.position_reference * observations.whitening[seen]
                moments = np.repeat(times[observations.frame[seen]], 2)
                positions.append(Strand(places, moments, whitening.reshape(-1, 2)))
            turned = np.flatnonzero(observations.angle_body == body)
            if len(turned):
                angles.append(Strand(turned, times[observations.angle_frame[turned]], np.ones((len(turned), 1))))
        return cls(tuple(positions), tuple(angles))


@dataclass(frozen=True)
class Whitening:
    """Turns residuals that stray into independent ones of unit variance.

    Parameters
    ----------
    positions, angles
        Per strand its places and the inverse of its covariance's Cholesky factor.
    """

    positions: tuple[tuple[Int[Tensor, "_"], Float[Tensor, "_ _"]], ...]
    angles: tuple[tuple[Int[Tensor, "_"], Float[Tensor, "_ _"]], ...]

    @classmethod
    def of(cls, error: ModelError, strands: Strands) -> "Whitening":
        """The whitening of a model error."""
        variance = np.repeat(error.position_variance, 2)
        return cls(
            tuple(_factor(strand, strand.covariance(error, error.position, variance)) for strand in strands.positions),
            tuple(_factor(one, one.covariance(error, error.angle, error.angle_variance)) for one in strands.angles),
        )

    @cached_property
    def position_log_volume(self) -> Float[np.ndarray, "number"]:
        """Logarithm of the factor by which each position residual was stretched, in the order of the residuals."""
        return _log_diagonals(self.positions)

    def whitened_positions(self, residuals: Float[Tensor, "point number"]) -> Float[Tensor, "point number"]:
        """Independent residuals of positions; of a video's first frames where only these are given."""
        return _whitened(residuals, self.positions)

    def whitened_angles(self, residuals: Float[Tensor, "point number"]) -> Float[Tensor, "point number"]:
        """Independent residuals of angles."""
        return _whitened(residuals, self.angles)


Factors = tuple[tuple[Int[Tensor, "_"], Float[Tensor, "_ _"]], ...]


def _factor(strand: Strand, covariance: Float[np.ndarray, "number number"]) -> tuple[Tensor, Tensor]:
    root = np.linalg.cholesky(covariance)
    inverse = torch.linalg.solve_triangular(
        torch.from_numpy(root), torch.eye(len(root), dtype=torch.float64), upper=False
    )
    return torch.from_numpy(strand.places), inverse


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

"""How large and how lasting the error of a model is: the values that make the residuals of the best fit most probable.

The unknowns are integrated out in the linear approximation around the fit, so that what they absorb of the error is
not lost (restricted likelihood). Source: Rasmussen and Williams, Gaussian Processes for Machine Learning (2006),
section 2.7; Kennedy and O'Hagan, Journal of the Royal Statistical Society B 63 (2001), section 4.4.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from scipy.optimize import OptimizeResult, minimize

from vrdp_prob.inference.search.clues import Clues
from vrdp_prob.inference.search.least_squares import jacobian
from vrdp_prob.inference.search.linear_residuals import LinearResiduals
from vrdp_prob.inference.search.misfit import Misfit, isolated
from vrdp_prob.inference.search.noise_fit import NOISE_FIELDS
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.measurement import jitters
from vrdp_prob.models.model_error import ModelError, by_law
from vrdp_prob.models.roughness import untold_noise
from vrdp_prob.models.unknowns import ANGLE_NOISE

TURNS = 4
"""Times that a model error and a fit are found in turn, the expected error being the first."""
NEEDED = 6.0
"""Gain (nats) in the probability of the residuals from which on the model is said to have an error."""
LARGEST_SHARE = 3.0
"""A model leaves out at most so many times the accelerations that its bodies show..."""
EXPECTED_SHARE, SHARE_LOG_SD = 0.3, 1.0
"""...and is expected to leave out this share of them, within a factor e."""
EXPECTED_DURATION = 0.3
"""Duration (s) of a model error before it is looked for."""
NOISE_LOG_SD = 0.1
"""How well the tracks' roughness tells the noise, in the logarithm."""
STARTS = ((0.1, 0.2), (0.1, 2.0), (1.0, 0.2))
"""Where the search begins: share of the accelerations, and duration in s."""
EVALUATIONS = 100
LARGEST_VARIANCE = 1e8
"""Variance factor of the worst outlier."""


def next_model_error(
    likelihood: Likelihood, point: Float[np.ndarray, "dimension"], clues: Clues, misfit: Misfit
) -> ModelError | None:
    """What a fit is to allow for next: nothing, or what one expects of a model error, or what the residuals show.

    Nothing where frames are late by chance, which is known of the model and not looked for beside an error of it.

    Parameters
    ----------
    likelihood
        The density that was fitted.
    point
        The fit.
    clues
        Noise and accelerations that the tracks show by themselves.
    misfit
        How the residuals of the first fit, without a model error, compare with the noise.
    """
    if jitters(likelihood.model):  # frames that are late by chance tie bodies together, and strands stray by themselves
        return None
    if likelihood.model_error is not None:
        return fit_model_error(likelihood, point, clues) or likelihood.model_error
    told = untold_noise(likelihood.tracks) is None  # else residuals smaller than the noise mean nothing
    if misfit.large or (told and fit_model_error(likelihood, point, clues) is not None):
        return expected_model_error(likelihood, point, clues)
    return None


def expected_model_error(likelihood: Likelihood, point: Float[np.ndarray, "dimension"], clues: Clues) -> ModelError:
    """A model error as large as one expects beforehand.

    A first fit that lacks it may have its contacts at wrong times, which would look like much larger accelerations.
    """
    share = EXPECTED_SHARE * clues.acceleration / clues.noise
    position, angle = _variances(likelihood, point, clues)
    scales = likelihood.coordinates.quantities(torch.from_numpy(point[None]))
    return ModelError(
        noise_scale=clues.noise / likelihood.observations.position_reference,
        angle_noise_scale=float(scales[ANGLE_NOISE][0, 0]),
        acceleration=share,
        angular_acceleration=share,
        duration=EXPECTED_DURATION,
        position_variance=position,
        angle_variance=angle,
    )


def fit_model_error(likelihood: Likelihood, point: Float[np.ndarray, "dimension"], clues: Clues) -> ModelError | None:
    """The error of the model that the residuals of a fit show; None where noise explains them as well.

    Parameters
    ----------
    likelihood
        The density that was fitted.
    point
        The fit.
    clues
        Noise and accelerations that the tracks show by themselves.
    """
    positions, angles = _linear(likelihood, point, clues)
    found = _search(likelihood, clues).run(positions)
    if found is None:
        return None
    scale, size, duration = found
    angle_scale, angle_size = 1.0, 0.0
    if len(angles.residuals):
        # what positions say of the unknowns is not up to the angles: else all that derivatives promise were explained
        angles = angles.beside(positions, *found)
        angle_scale, angle_size = _spread(angles), 0.0
        turning = _Search(np.log(angle_scale), 10.0, np.log(clues.acceleration / clues.noise), (duration, duration))
        angle_scale, angle_size, _ = turning.run(angles) or (angle_scale, angle_size, duration)
    return ModelError(scale, angle_scale, size, angle_size, duration, positions.variance[::2], angles.variance)


def _search(likelihood: Likelihood, clues: Clues) -> "_Search":
    times = likelihood.tracks.times
    step = float(np.median(np.diff(times)))
    durations = (step, max(float(times[-1] - times[0]), 3 * step))
    log_noise = np.log(clues.noise / likelihood.observations.position_reference)
    if likelihood.tracks.position_covariance is None:
        return _Search(log_noise, NOISE_LOG_SD, np.log(clues.acceleration / clues.noise), durations)
    # stated noise may be alike in neighbouring frames: the noise proper is somewhere between roughness and statement
    between = abs(log_noise) / 2
    return _Search(log_noise / 2, NOISE_LOG_SD + between, np.log(clues.acceleration / clues.noise), durations)


@dataclass(frozen=True)
class _Search:
    """Where the scale of the noise and the size and duration of a model error are looked for.

    Parameters
    ----------
    log_noise, noise_log_sd
        Normal prior of the log noise scale.
    log_acceleration
        Logarithm of the accelerations that bodies show, in units of the noise per s^2.
    durations
        Shortest and longest duration (s).
    """

    log_noise: float
    noise_log_sd: float
    log_acceleration: float
    durations: tuple[float, float]

    def run(self, linear: LinearResiduals) -> tuple[float, float, float] | None:
        """Most probable scale of the noise, size and duration; None where noise explains the residuals as well."""
        starts = self._starts
        costs = [self._with_error(linear, np.array(start)) for start in starts]
        best = self._minimum(lambda values: self._with_error(linear, values), starts[int(np.argmin(costs))])
        if self._plain(linear) - best.fun < NEEDED:
            return None
        return float(np.exp(best.x[0])), self._size(best.x), self._duration(best.x)

    @property
    def _starts(self) -> list[list[float]]:
        """First guesses: log noise scale, log size, log duration."""
        return [[self.log_noise, np.log(share) + self.log_acceleration, np.log(lasting)] for share, lasting in STARTS]

    def _plain(self, linear: LinearResiduals) -> float:
        """Cost without a model error, at the best scale of the noise."""
        return float(self._minimum(lambda values: self._cost(linear, values[0]), [np.log(_spread(linear))]).fun)

    def _minimum(self, cost: Callable[[np.ndarray], float], start: list[float]) -> OptimizeResult:
        options = {"maxfev": EVALUATIONS, "xatol": 0.03, "fatol": 0.03}
        return minimize(cost, start, method="Nelder-Mead", options=options)

    def _with_error(self, linear: LinearResiduals, values: Float[np.ndarray, "3"]) -> float:
        size, duration = self._size(values), self._duration(values)
        expected = np.log(EXPECTED_SHARE) + self.log_acceleration
        prior = ((np.log(size) - expected) / SHARE_LOG_SD) ** 2 / 2
        outside = (values[1:] - np.log([size, duration])) ** 2
        return self._cost(linear, values[0], size, duration) + prior + float(outside.sum())

    def _cost(self, linear: LinearResiduals, log_scale: float, size: float = 0.0, duration: float = 1.0) -> float:
        prior = ((log_scale - self.log_noise) / self.noise_log_sd) ** 2 / 2
        try:
            return linear.cost(float(np.exp(log_scale)), size, duration) + float(prior)
        except np.linalg.LinAlgError:  # an error so large and lasting that its covariance loses all digits
            return math.inf

    def _size(self, values: Float[np.ndarray, "3"]) -> float:
        return float(np.exp(min(values[1], np.log(LARGEST_SHARE) + self.log_acceleration)))

    def _duration(self, values: Float[np.ndarray, "3"]) -> float:
        return float(np.clip(np.exp(np.clip(values[2], -10, 10)), *self.durations))


def _spread(linear: LinearResiduals) -> float:
    """Root mean square of the residuals, outliers discounted."""
    return float(np.sqrt(np.mean(linear.residuals**2 / linear.variance)))


def _linear(
    likelihood: Likelihood, point: Float[np.ndarray, "dimension"], clues: Clues
) -> tuple[LinearResiduals, LinearResiduals]:
    """The residuals of positions and of angles as functions of what the worlds depend on."""
    coordinates = likelihood.coordinates
    free = ~coordinates.mask(NOISE_FIELDS)

    def discrepancies(points: Float[np.ndarray, "point dimension"]) -> Float[np.ndarray, "point number"]:
        with torch.no_grad():
            found = likelihood.discrepancies(torch.from_numpy(np.ascontiguousarray(points)))
            return torch.cat([found.positions.flatten(1), found.angles], dim=1).numpy()

    def prior(points: Float[np.ndarray, "point dimension"]) -> Float[np.ndarray, "point residual"]:
        return coordinates.prior_residuals(torch.from_numpy(np.ascontiguousarray(points))).numpy()

    values, derivative = jacobian(discrepancies, point, coordinates.scale, active=free, central=True)
    prior_values, prior_derivative = jacobian(prior, point, coordinates.scale, active=free, central=True)
    position, angle = _variances(likelihood, point, clues)
    count = 2 * len(position)
    strands = likelihood.strands
    return (
        LinearResiduals(
            by_law(strands.positions, np.repeat(position, 2)),
            values[:count],
            derivative[:count][:, free],
            np.repeat(position, 2),
            prior_values,
            prior_derivative[:, free],
        ),
        LinearResiduals(
            by_law(strands.angles, angle),
            values[count:],
            derivative[count:][:, free],
            angle,
            prior_values,
            prior_derivative[:, free],
        ),
    )


def _variances(
    likelihood: Likelihood, point: Float[np.ndarray, "dimension"], clues: Clues
) -> tuple[Float[np.ndarray, "observation"], Float[np.ndarray, "angle"]]:
    """Variance factors of positions and angles: those of an earlier model error, else by how far off they are.

    A position that is off as those before and after is what the model error is for.
    """
    if likelihood.model_error is not None:
        return likelihood.model_error.position_variance, likelihood.model_error.angle_variance
    draws = torch.from_numpy(point[None])
    position, angle = likelihood.information_shares(draws)
    residuals = likelihood.tracks.positions - likelihood.predicted(draws)[0, :, :, :2]
    alone = clues.outliers | isolated(residuals, clues)
    alone = alone[likelihood.observations.frame, likelihood.observations.body]
    variance = np.where(alone, np.minimum(1 / position[0], LARGEST_VARIANCE), 1.0)
    return variance, np.minimum(1 / angle[0], LARGEST_VARIANCE)

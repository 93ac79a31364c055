"""How large and how lasting the error of a model is: the values that make the residuals of the best fit most probable.

The unknowns are integrated out in the linear approximation around the fit, so that what they absorb of the error is
not lost (restricted likelihood). Source: Rasmussen and Williams, Gaussian Processes for Machine Learning (2006),
section 2.7; Kennedy and O'Hagan, Journal of the Royal Statistical Society B 63 (2001), section 4.4.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from scipy.linalg import solve_triangular
from scipy.optimize import minimize

from vrdp_prob.inference.least_squares import jacobian
from vrdp_prob.inference.noise_fit import NOISE_FIELDS
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.model_error import ModelError, Strand

NEEDED = 6.0
"""Gain (nats) in the probability of the residuals from which on the model is said to have an error."""
SIZES = (1e-3, 1e4)
"""Range of the size of a model error in units of the noise."""
FIRST_SIZE, FIRST_DURATION = 1.0, 0.3
"""Where the search begins: in units of the noise, and s."""
EVALUATIONS = 120
LARGEST_VARIANCE = 1e8
"""Variance factor of the worst outlier."""


@dataclass(frozen=True)
class _Linear:
    """Residuals at noise scale 1 near a fit, as a linear function of the unknowns, with their prior.

    Parameters
    ----------
    strands
        The numbers that stray together.
    residuals, derivative
        Values and derivative by the unknowns of all numbers.
    variance
        Variance factor of each number.
    prior_residuals, prior_derivative
        Those of the prior.
    """

    strands: Sequence[Strand]
    residuals: Float[np.ndarray, "number"]
    derivative: Float[np.ndarray, "number dimension"]
    variance: Float[np.ndarray, "number"]
    prior_residuals: Float[np.ndarray, "prior"]
    prior_derivative: Float[np.ndarray, "prior dimension"]

    def cost(self, scale: float, error: ModelError | None) -> float:
        """Negative log probability (nats, up to a constant) of the residuals, the unknowns integrated out."""
        squares = float(self.prior_residuals @ self.prior_residuals)
        curvature = self.prior_derivative.T @ self.prior_derivative
        gradient = self.prior_derivative.T @ self.prior_residuals
        log_volume = 0.0
        for strand in self.strands:
            places = strand.places
            covariance = (
                np.diag(self.variance[places])
                if error is None
                else strand.covariance(error, error.position, self.variance)
            )
            root = scale * np.linalg.cholesky(covariance)
            both = np.column_stack([self.residuals[places], self.derivative[places]])
            whitened = solve_triangular(root, both, lower=True)
            values, slopes = whitened[:, 0], whitened[:, 1:]
            squares += float(values @ values)
            curvature += slopes.T @ slopes
            gradient += slopes.T @ values
            log_volume += float(np.log(np.diag(root)).sum())
        factor = np.linalg.cholesky(curvature + 1e-12 * np.trace(curvature) * np.eye(len(curvature)))
        absorbed = solve_triangular(factor, gradient, lower=True)
        return log_volume + float(np.log(np.diag(factor)).sum()) + (squares - float(absorbed @ absorbed)) / 2


def fit_model_error(likelihood: Likelihood, point: Float[np.ndarray, "dimension"]) -> ModelError | None:
    """The error of the model that the residuals of a fit show; None where noise explains them as well.

    Parameters
    ----------
    likelihood
        The density that was fitted.
    point
        The fit.
    """
    positions, angles = _linear(likelihood, point)
    step = float(np.median(np.diff(likelihood.tracks.times)))
    span = float(likelihood.tracks.times[-1] - likelihood.tracks.times[0])
    size, duration = _searched(positions, step, max(span, 3 * step), None)
    if size is None or duration is None:
        return None
    angle_size = 0.0
    if len(angles.residuals):
        angle_size = _searched(angles, step, span, duration)[0] or 0.0
    return ModelError(size, angle_size, duration, positions.variance[::2], angles.variance)


def _searched(
    linear: _Linear, shortest: float, longest: float, duration: float | None
) -> tuple[float | None, float | None]:
    """Most probable size and duration (given one where it is not searched); None where none is needed."""
    low, high = np.log([SIZES[0], shortest]), np.log([SIZES[1], longest])

    def error(values: Float[np.ndarray, "value"]) -> ModelError:
        size = float(np.exp(np.clip(values[1], low[0], high[0])))
        lasting = duration if duration is not None else float(np.exp(np.clip(values[2], low[1], high[1])))
        return ModelError(size, size, lasting, np.ones(0), np.ones(0))

    def cost(values: Float[np.ndarray, "value"]) -> float:
        return linear.cost(float(np.exp(values[0])), error(values))

    scale = np.log(np.sqrt(np.mean(linear.residuals**2 / linear.variance)))
    plain = minimize(
        lambda values: linear.cost(float(np.exp(values[0])), None),
        [scale],
        method="Nelder-Mead",
        options={"maxfev": EVALUATIONS // 3, "xatol": 0.01, "fatol": 0.01},
    )
    first = [scale - 0.5, np.log(FIRST_SIZE), *([] if duration is not None else [np.log(FIRST_DURATION)])]
    options = {"maxfev": EVALUATIONS, "xatol": 0.02, "fatol": 0.02}
    found = minimize(cost, first, method="Nelder-Mead", options=options)
    if plain.fun - found.fun < NEEDED:
        return None, None
    best = error(found.x)
    return best.position, best.duration


def _linear(likelihood: Likelihood, point: Float[np.ndarray, "dimension"]) -> tuple[_Linear, _Linear]:
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
    position, angle = _variances(likelihood, point)
    count = 2 * len(position)
    strands = likelihood.strands
    return (
        _Linear(
            strands.positions,
            values[:count],
            derivative[:count][:, free],
            np.repeat(position, 2),
            prior_values,
            prior_derivative[:, free],
        ),
        _Linear(
            strands.angles,
            values[count:],
            derivative[count:][:, free],
            angle,
            prior_values,
            prior_derivative[:, free],
        ),
    )


def _variances(
    likelihood: Likelihood, point: Float[np.ndarray, "dimension"]
) -> tuple[Float[np.ndarray, "observation"], Float[np.ndarray, "angle"]]:
    """Variance factors of positions and angles: those of an earlier model error, else by how far off they are."""
    if likelihood.model_error is not None:
        return likelihood.model_error.position_variance, likelihood.model_error.angle_variance
    position, angle = likelihood.information_shares(torch.from_numpy(point[None]))
    return np.minimum(1 / position[0], LARGEST_VARIANCE), np.minimum(1 / angle[0], LARGEST_VARIANCE)

"""The last steps to a maximum of the log posterior, on all frames and with the noise scale."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from scipy.optimize import minimize as scipy_minimize

from vrdp_prob.inference.descent import Descent
from vrdp_prob.inference.least_squares import jacobian
from vrdp_prob.inference.mode import Mode
from vrdp_prob.inference.noise_fit import NOISE_FIELDS, best_noise, noise_curvature
from vrdp_prob.inference.samples import Gaussian, evaluate
from vrdp_prob.models.likelihood import Likelihood

ROUNDS = 4
"""Times that the noise and the rest are refined in turn."""
ITERATIONS = 12
STANDING_STILL = 1e-3
"""Largest step, in units of the coordinates' scales, after which nothing changes any more."""


@dataclass(frozen=True)
class Refined:
    """Where a refinement ended.

    Parameters
    ----------
    point
        The values.
    log_density
        Log posterior (nats) there.
    converged
        Whether it ended by itself.
    evaluations
        Number of worlds simulated.
    """

    point: Float[np.ndarray, "dimension"]
    log_density: float
    converged: bool
    evaluations: int


def refine(descent: Descent, start: Float[np.ndarray, "dimension"]) -> Refined:
    """Least squares and the most probable noise in turn."""
    likelihood = descent.likelihood
    point, converged, evaluations = start, False, 0
    free = ~likelihood.coordinates.mask(NOISE_FIELDS)
    scale = likelihood.coordinates.scale
    for _ in range(ROUNDS):
        point = best_noise(likelihood, point)
        (minimum,) = descent(point[None], free, iterations=ITERATIONS)
        evaluations += minimum.evaluations
        if not np.isfinite(minimum.cost):
            break
        moved = float(np.abs((minimum.point - point) / scale).max())
        point, converged = minimum.point, minimum.converged
        if moved < STANDING_STILL:
            break
    return Refined(point, _log_density(likelihood, point), converged, evaluations)


def climb(likelihood: Likelihood, start: Mode, iterations: int) -> Refined:
    """Climb the log posterior by L-BFGS in whitened coordinates; never ends lower than it began."""
    gaussian = Gaussian.from_precision(start.point, start.precision)
    mean, root = torch.from_numpy(gaussian.mean), torch.from_numpy(gaussian.root)

    def descend(whitened: Float[np.ndarray, "dimension"]) -> tuple[float, Float[np.ndarray, "dimension"]]:
        position = torch.from_numpy(whitened).requires_grad_()
        value = -likelihood.log_density((mean + root @ position)[None])[0]
        if not bool(torch.isfinite(value)):
            return 1e30, np.zeros_like(whitened)
        (gradient,) = torch.autograd.grad(value, position)
        return float(value.detach()), np.nan_to_num(gradient.numpy())

    result = scipy_minimize(
        descend,
        np.zeros(len(start.point)),
        jac=True,
        method="L-BFGS-B",
        options={"maxiter": iterations, "maxcor": 20, "ftol": 1e-10},
    )
    if not -result.fun > start.log_density:
        return Refined(start.point, start.log_density, False, int(result.nfev))
    return Refined(gaussian.points(result.x), -float(result.fun), bool(result.success), int(result.nfev))


def mode_at(likelihood: Likelihood, refined: Refined) -> Mode:
    """The mode of a maximum, with the curvature around it."""
    _, derivative = jacobian(likelihood.residuals, refined.point, likelihood.coordinates.scale, central=True)
    return Mode(refined.point, with_noise(likelihood, refined.point, derivative), refined.log_density)


def with_noise(
    likelihood: Likelihood, point: Float[np.ndarray, "dimension"], derivative: Float[np.ndarray, "residual dimension"]
) -> Float[np.ndarray, "dimension dimension"]:
    """Gauss-Newton curvature, with that of the noise scales in place of what the residuals say of them."""
    precision = derivative.T @ derivative
    places, curvature = noise_curvature(likelihood, point)
    precision[places, :] = precision[:, places] = 0.0
    precision[np.ix_(places, places)] = curvature
    return precision


def _log_density(likelihood: Likelihood, point: Float[np.ndarray, "dimension"]) -> float:
    return float(evaluate(likelihood.log_density, point[None])[0])

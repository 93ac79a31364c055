"""Levenberg-Marquardt for rollouts: whole batches of worlds give the Jacobian and try many step lengths at once.

The residuals come from a simulator whose event order may change under a step, so no step is trusted before it was
evaluated, and a world that fails counts as infinitely bad.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

Residuals = Callable[[Float[np.ndarray, "point dimension"]], Float[np.ndarray, "point residual"]]
"""Residuals (unit variance) of a batch of points; a row that holds NaN marks a point that could not be simulated."""

DAMPINGS = 10.0 ** np.array([-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0])
"""Factors on the current damping that one batch of trial steps covers."""
SMALLEST_DAMPING, LARGEST_DAMPING = 1e-9, 1e9
STEP = 1e-4
"""Finite-difference step in units of the coordinates' scale: large against the simulator's error of 1e-11."""


@dataclass(frozen=True)
class Minimum:
    """Where a search ended.

    Parameters
    ----------
    point
        The best point found.
    cost
        Half the (robust) sum of squared residuals there; infinite where the start could not be simulated.
    jacobian
        Derivative of the residuals there, one column per active coordinate (zero for the others).
    converged
        Whether the last step lowered the cost by less than the tolerance.
    evaluations
        Number of points simulated.
    """

    point: Float[np.ndarray, "dimension"]
    cost: float
    jacobian: Float[np.ndarray, "residual dimension"]
    converged: bool
    evaluations: int


def robust_cost(
    residuals: Float[np.ndarray, "*point residual"], threshold: float | None
) -> Float[np.ndarray, "*point"]:
    """Half the sum of squares, beyond `threshold` growing linearly (Huber); infinite where a residual is not finite."""
    size = np.abs(residuals)
    terms = size**2 / 2
    if threshold is not None:
        terms = np.where(size > threshold, threshold * size - threshold**2 / 2, terms)
    cost = terms.sum(axis=-1)
    return np.where(np.isfinite(cost), cost, np.inf)


def jacobian(
    residuals: Residuals,
    point: Float[np.ndarray, "dimension"],
    scale: Float[np.ndarray, "dimension"],
    *,
    active: np.ndarray | None = None,
    central: bool = False,
) -> tuple[Float[np.ndarray, "residual"], Float[np.ndarray, "residual dimension"]]:
    """Residuals and their derivative at a point by differences in one batch; columns of inactive coordinates are 0."""
    columns = np.flatnonzero(np.ones(len(point), bool) if active is None else active)
    steps = STEP * scale[columns]
    moves = np.zeros((len(columns), len(point)))
    moves[np.arange(len(columns)), columns] = steps
    batch = [point[None], point + moves, point - moves] if central else [point[None], point + moves]
    values = residuals(np.concatenate(batch))
    base, forward = values[0], values[1 : 1 + len(columns)]
    derivative = np.zeros((len(base), len(point)))
    if central:
        difference = (forward - values[1 + len(columns) :]) / (2 * steps[:, None])
    else:
        difference = (forward - base) / steps[:, None]
    derivative[:, columns] = np.where(np.isfinite(difference), difference, 0.0).T
    return base, derivative


def minimise(
    residuals: Residuals,
    start: Float[np.ndarray, "dimension"],
    scale: Float[np.ndarray, "dimension"],
    *,
    active: np.ndarray | None = None,
    iterations: int = 10,
    tolerance: float = 1e-3,
    threshold: float | None = None,
) -> Minimum:
    """Lower half the sum of squared residuals from a start.

    Parameters
    ----------
    residuals
        Residuals of a batch of points, those of the prior included.
    start
        Where to begin.
    scale
        Typical size of each coordinate, for the difference steps and the damping.
    active
        Coordinates that may move; all where None.
    iterations
        At most so many accepted or refused rounds of trial steps.
    tolerance
        Decrease of the cost (nats) below which the search has converged.
    threshold
        Residuals beyond it count linearly (Huber), so that outliers and unfinished parts of a fit do not pull; None for
        plain least squares.
    """
    point, damping, evaluations, converged = start.copy(), 1e-2, 0, False
    current, derivative = jacobian(residuals, point, scale, active=active)
    cost = float(robust_cost(current, threshold))
    evaluations += 1 + derivative.shape[1]
    for _ in range(iterations):
        if not np.isfinite(cost):
            break
        weight = _huber_weight(current, threshold)
        gradient = derivative.T @ (weight * current)
        curvature = (derivative * weight[:, None]).T @ derivative
        trial_dampings = np.clip(damping * DAMPINGS, SMALLEST_DAMPING, LARGEST_DAMPING)
        trials = point + _steps(curvature, gradient, scale, trial_dampings)
        costs = robust_cost(residuals(trials), threshold)
        evaluations += len(trials)
        best = int(np.argmin(costs))
        if not costs[best] < cost:
            damping *= 1e3
            converged = damping > LARGEST_DAMPING / 1e2
            if converged:
                break
            continue
        decrease = cost - float(costs[best])
        point, damping = trials[best], float(trial_dampings[best])
        current, derivative = jacobian(residuals, point, scale, active=active)
        cost = float(robust_cost(current, threshold))
        evaluations += 1 + derivative.shape[1]
        if decrease < tolerance:
            converged = True
            break
    return Minimum(point, cost, derivative, converged, evaluations)


def _huber_weight(residuals: Float[np.ndarray, "residual"], threshold: float | None) -> Float[np.ndarray, "residual"]:
    if threshold is None:
        return np.ones_like(residuals)
    return np.minimum(1.0, threshold / np.maximum(np.abs(residuals), 1e-300))


def _steps(
    curvature: Float[np.ndarray, "dimension dimension"],
    gradient: Float[np.ndarray, "dimension"],
    scale: Float[np.ndarray, "dimension"],
    dampings: Float[np.ndarray, "trial"],
) -> Float[np.ndarray, "trial dimension"]:
    """Damped Gauss-Newton steps; the damping is relative to the curvature of each coordinate."""
    diagonal = np.maximum(np.diag(curvature), 1e-6 / scale**2)
    root = 1 / np.sqrt(diagonal)
    values, vectors = np.linalg.eigh(root[:, None] * curvature * root)
    rotated = vectors.T @ (root * gradient)
    scaled = rotated / (np.maximum(values, 0) + dampings[:, None])
    steps: Float[np.ndarray, "trial dimension"] = -(scaled @ vectors.T) * root
    return steps

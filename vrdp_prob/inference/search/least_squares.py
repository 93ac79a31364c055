"""Levenberg-Marquardt for rollouts: whole batches of worlds give the Jacobian and try many step lengths at once.

The residuals come from a simulator whose event order may change under a step, so no step is trusted before it was
evaluated, and a world that fails counts as infinitely bad.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

Residuals = Callable[[Float[np.ndarray, "point dimension"]], Float[np.ndarray, "point residual"]]
"""Residuals (unit variance) of a batch of points; a row that holds NaN marks a point that could not be simulated."""

DAMPINGS = 10.0 ** np.array([-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0])
"""Factors on the current damping that one batch of trial steps covers."""
SMALLEST_DAMPING, LARGEST_DAMPING = 1e-9, 1e9
STEP = 1e-5
"""Finite-difference step in units of the coordinates' scale: large against the simulator's error of 1e-9."""
JUMP, LEAST_JUMP = 10.0, 1.0
"""A difference is a jump where it is so many times that on the other side, and so large (in standard deviations)."""


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
    own_side: bool = False,
) -> tuple[Float[np.ndarray, "residual"], Float[np.ndarray, "residual dimension"]]:
    """Residuals and their derivative at a point by differences in one batch; columns of inactive coordinates are 0.

    Central ones are one-sided, where asked for, if a step to one side leads past an edge, beyond which residuals are
    quite other ones. Without that a derivative there is so large that it shows the edge.
    """
    columns = np.flatnonzero(np.ones(len(point), bool) if active is None else active)
    steps = STEP * scale[columns]
    moves = np.zeros((len(columns), len(point)))
    moves[np.arange(len(columns)), columns] = steps
    batch = [point[None], point + moves, point - moves] if central else [point[None], point + moves]
    values = residuals(np.concatenate(batch))
    base, forward = values[0], values[1 : 1 + len(columns)]
    derivative = np.zeros((len(base), len(point)))
    if central:
        ahead, behind = forward - base, base - values[1 + len(columns) :]
        difference = one_sided(ahead, behind, least=LEAST_JUMP if own_side else np.inf) / steps[:, None]
    else:
        difference = (forward - base) / steps[:, None]
    derivative[:, columns] = np.where(np.isfinite(difference), difference, 0.0).T
    return base, derivative


def one_sided(
    ahead: Float[np.ndarray, "step number"], behind: Float[np.ndarray, "step number"], *, least: float
) -> Float[np.ndarray, "step number"]:
    """Mean of the changes on both sides of a point; that of one side where the other's is a jump, or is not known.

    Parameters
    ----------
    ahead, behind
        Changes of some numbers by steps forward, and by steps backward.
    least
        Size (Euclidean) of a jump at least.
    """
    sizes = np.stack([np.linalg.norm(side, axis=1) for side in (ahead, behind)])
    sizes = np.where(np.isfinite(sizes), sizes, np.inf)
    jumps = (sizes > JUMP * sizes[::-1]) & (sizes > least)
    return np.where(jumps[0, :, None], behind, np.where(jumps[1, :, None], ahead, (ahead + behind) / 2))


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
    """Lower half the sum of squared residuals from one start; see `minimise_all`."""
    return minimise_all(
        residuals,
        start[None],
        scale,
        active=active,
        iterations=iterations,
        tolerance=tolerance,
        threshold=threshold,
    )[0]


def minimise_all(
    residuals: Residuals,
    starts: Float[np.ndarray, "start dimension"],
    scale: Float[np.ndarray, "dimension"],
    *,
    active: np.ndarray | None = None,
    iterations: int = 10,
    tolerance: float = 1e-3,
    threshold: float | None = None,
) -> list[Minimum]:
    """Lower half the sum of squared residuals from several starts side by side.

    Parameters
    ----------
    residuals
        Residuals of a batch of points, those of the prior included.
    starts
        Where to begin.
    scale
        Typical size of each coordinate, for the difference steps and the damping.
    active
        Coordinates that may move; all where None.
    iterations
        At most so many accepted or refused rounds of trial steps.
    tolerance
        Decrease of the cost (nats) below which a search has converged.
    threshold
        Residuals beyond it count linearly (Huber), so that outliers and unfinished parts of a fit do not pull; None for
        plain least squares.

    Returns
    -------
    Where each search ended, in the order of the starts.
    """
    columns = np.flatnonzero(np.ones(len(scale), bool) if active is None else active)
    searches = [_Search(start.copy(), row, threshold) for start, row in zip(starts, residuals(starts), strict=True)]
    running = [search for search in searches if np.isfinite(search.cost)]
    _differentiate(residuals, running, scale, columns)
    for _ in range(iterations):
        if not running:
            break
        trials = np.concatenate([search.trials(scale, columns) for search in running])
        values = residuals(trials).reshape(len(running), len(DAMPINGS), -1)
        moved = [
            search
            for search, points, rows in zip(
                running, trials.reshape(len(running), len(DAMPINGS), -1), values, strict=True
            )
            if search.judge(points, rows, tolerance)
        ]
        _differentiate(residuals, moved, scale, columns)
        running = [search for search in running if not search.converged]
    return [search.minimum for search in searches]


class _Search:
    """One search that runs beside others."""

    def __init__(
        self, point: Float[np.ndarray, "dimension"], values: Float[np.ndarray, "residual"], threshold: float | None
    ) -> None:
        self.point, self.values, self._threshold = point, values, threshold
        self.cost = float(robust_cost(values, threshold))
        self.derivative = np.zeros((len(values), len(point)))
        self.converged, self.evaluations, self._damping = False, 1, 1e-2

    @property
    def minimum(self) -> Minimum:
        return Minimum(self.point, self.cost, self.derivative, self.converged, self.evaluations)

    def trials(
        self, scale: Float[np.ndarray, "dimension"], columns: Int[np.ndarray, "active"]
    ) -> Float[np.ndarray, "trial dimension"]:
        """Points that steps of different damping lead to."""
        weight = _huber_weight(self.values, self._threshold)
        derivative = self.derivative[:, columns]
        gradient = derivative.T @ (weight * self.values)
        curvature = (derivative * weight[:, None]).T @ derivative
        points = np.tile(self.point, (len(DAMPINGS), 1))
        points[:, columns] += _steps(curvature, gradient, scale[columns], self._dampings)
        return points

    @property
    def _dampings(self) -> Float[np.ndarray, "trial"]:
        return np.clip(self._damping * DAMPINGS, SMALLEST_DAMPING, LARGEST_DAMPING)

    def judge(
        self,
        points: Float[np.ndarray, "trial dimension"],
        values: Float[np.ndarray, "trial residual"],
        tolerance: float,
    ) -> bool:
        """Take the best of the trials if it is better; whether it was."""
        self.evaluations += len(points)
        costs = robust_cost(values, self._threshold)
        best = int(np.argmin(costs))
        if not costs[best] < self.cost:
            self._damping *= 1e3
            self.converged = self._damping > LARGEST_DAMPING / 1e2
            return False
        self.converged = bool(self.cost - costs[best] < tolerance)
        self._damping = float(self._dampings[best])
        self.point, self.values, self.cost = points[best], values[best], float(costs[best])
        return True


def _differentiate(
    residuals: Residuals,
    searches: Sequence[_Search],
    scale: Float[np.ndarray, "dimension"],
    columns: Int[np.ndarray, "active"],
) -> None:
    """Derivatives of all searches by forward differences in one batch."""
    if not searches:
        return
    steps = STEP * scale[columns]
    moves = np.zeros((len(columns), len(scale)))
    moves[np.arange(len(columns)), columns] = steps
    values = residuals(np.concatenate([search.point + moves for search in searches]))
    for search, rows in zip(searches, values.reshape(len(searches), len(columns), -1), strict=True):
        difference = (rows - search.values) / steps[:, None]
        search.derivative = np.zeros((rows.shape[1], len(scale)))
        search.derivative[:, columns] = np.where(np.isfinite(difference), difference, 0.0).T
        search.evaluations += len(columns)


def _huber_weight(residuals: Float[np.ndarray, "residual"], threshold: float | None) -> Float[np.ndarray, "residual"]:
    if threshold is None:
        return np.ones_like(residuals)
    return np.minimum(1.0, threshold / np.maximum(np.abs(residuals), 1e-300))


def _steps(
    curvature: Float[np.ndarray, "active active"],
    gradient: Float[np.ndarray, "active"],
    scale: Float[np.ndarray, "active"],
    dampings: Float[np.ndarray, "trial"],
) -> Float[np.ndarray, "trial active"]:
    """Damped Gauss-Newton steps; the damping is relative to the curvature of each coordinate."""
    diagonal = np.maximum(np.diag(curvature), 1e-6 / scale**2)
    root = 1 / np.sqrt(diagonal)
    values, vectors = np.linalg.eigh(root[:, None] * curvature * root)
    rotated = vectors.T @ (root * gradient)
    scaled = rotated / (np.maximum(values, 0) + dampings[:, None])
    steps: Float[np.ndarray, "trial active"] = -(scaled @ vectors.T) * root
    return steps

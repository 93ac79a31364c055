"""Lower the cost of the first frames of a video from several starts, by the optimiser of a plan."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float
from scipy.optimize import minimize as scipy_minimize
from torch import Tensor

from vrdp_prob.inference.search.least_squares import Minimum, jacobian, minimise_all, robust_cost
from vrdp_prob.inference.search.plan import Optimiser
from vrdp_prob.models.likelihood import Likelihood

STEPS = 8
"""L-BFGS iterations that count as one of Levenberg-Marquardt."""
MEMORY = 20
FAILED = 1e6
"""Nats by which a world that fails costs more than the start of L-BFGS. With much more, as 1e30, its line search would
lose the slope to rounding and step back to where it was, and it would call that an end."""


@dataclass(frozen=True)
class Descent:
    """A way to refine starts.

    Parameters
    ----------
    likelihood
        Whose residuals are lowered.
    optimiser
        How.
    """

    likelihood: Likelihood
    optimiser: Optimiser

    def __call__(
        self,
        starts: Float[np.ndarray, "start dimension"],
        active: Bool[np.ndarray, "dimension"],
        *,
        frame_count: int | None = None,
        weights: Float[np.ndarray, "residual"] | None = None,
        iterations: int,
        tolerance: float = 1e-3,
        threshold: float | None = None,
    ) -> list[Minimum]:
        """Refine each start.

        Parameters
        ----------
        starts
            Where to begin.
        active
            Coordinates that may move.
        frame_count
            Frames that count; all where None.
        weights
            Factors of the residuals; 1 where None.
        iterations
            At most so many steps of Levenberg-Marquardt, or `STEPS` times as many of L-BFGS.
        tolerance
            Decrease of the cost (nats) below which a search has converged.
        threshold
            Residuals beyond it count linearly (Huber); None for plain least squares.
        """

        def residuals(points: Float[np.ndarray, "point dimension"]) -> Float[np.ndarray, "point residual"]:
            values = self.likelihood.residuals(points, frame_count)
            return values if weights is None else values * weights

        scale = self.likelihood.coordinates.scale
        if self.optimiser is Optimiser.GAUSS_NEWTON:
            return minimise_all(
                residuals,
                starts,
                scale,
                active=active,
                iterations=iterations,
                tolerance=tolerance,
                threshold=threshold,
            )
        factors = torch.ones(()) if weights is None else torch.from_numpy(weights)

        def cost(points: Float[Tensor, "point dimension"]) -> Float[Tensor, ""]:
            values = self.likelihood.differentiable_residuals(points, frame_count)[0] * factors
            return (values**2).sum() / 2 if threshold is None else _huber(values, threshold)

        found = []
        for start in starts:
            point, steps, ended = _lbfgs(cost, start, scale * active, STEPS * iterations, tolerance)
            values, derivative = jacobian(residuals, point, scale, active=active)
            evaluations = steps + 1 + int(active.sum())
            found.append(Minimum(point, float(robust_cost(values, threshold)), derivative, ended, evaluations))
        return found


def _lbfgs(
    cost: Callable[[Float[Tensor, "point dimension"]], Float[Tensor, ""]],
    start: Float[np.ndarray, "dimension"],
    scale: Float[np.ndarray, "dimension"],
    iterations: int,
    tolerance: float,
) -> tuple[Float[np.ndarray, "dimension"], int, bool]:
    """Where it ends, worlds simulated, and whether it ended by itself; the start where its world fails."""
    units, origin = torch.from_numpy(scale), torch.from_numpy(start)

    def moved(moves: Float[Tensor, "dimension"]) -> Float[Tensor, ""]:
        return cost((origin + units * moves)[None])

    before, _ = with_gradient(moved, math.inf)(np.zeros(len(start)))
    if not math.isfinite(before):
        return start, 1, False
    options = {"maxiter": iterations, "maxcor": MEMORY, "ftol": tolerance / max(before, 1.0) / STEPS, "gtol": 1e-6}
    lowered = with_gradient(moved, before + FAILED)
    result = scipy_minimize(lowered, np.zeros(len(start)), jac=True, method="L-BFGS-B", options=options)
    if not result.fun < before:
        return start, int(result.nfev) + 1, False
    return start + scale * result.x, int(result.nfev) + 1, bool(result.success)


def with_gradient(
    cost: Callable[[Float[Tensor, "dimension"]], Float[Tensor, ""]], failed: float
) -> Callable[[Float[np.ndarray, "dimension"]], tuple[float, Float[np.ndarray, "dimension"]]]:
    """A cost together with its gradient; a given one, and no slope, where it is not finite."""

    def both(values: Float[np.ndarray, "dimension"]) -> tuple[float, Float[np.ndarray, "dimension"]]:
        variables = torch.from_numpy(values).requires_grad_()
        loss = cost(variables)
        if not bool(torch.isfinite(loss)):
            return failed, np.zeros_like(values)
        (gradient,) = torch.autograd.grad(loss, variables)
        return float(loss.detach()), np.nan_to_num(gradient.numpy())

    return both


def _huber(values: Float[Tensor, "residual"], threshold: float) -> Float[Tensor, ""]:
    """Half the sum of squares, beyond a threshold growing linearly."""
    return torch.nn.functional.huber_loss(values, torch.zeros_like(values), reduction="sum", delta=threshold)

"""The last steps to a maximum of the log posterior, on all frames and with the noise scale."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float
from scipy.optimize import minimize as scipy_minimize
from torch import Tensor

from vrdp_prob.inference.draws.mode import Mode
from vrdp_prob.inference.draws.samples import Gaussian, evaluate
from vrdp_prob.inference.search.descent import FAILED, Descent, with_gradient
from vrdp_prob.inference.search.least_squares import Minimum, jacobian
from vrdp_prob.inference.search.noise_fit import NOISE_FIELDS, best_noise, noise_curvature
from vrdp_prob.models.likelihood import Likelihood

ROUNDS = 4
"""Times that the noise and the rest are refined in turn."""
ITERATIONS = 12
"""Steps of a turn; with fewer in the first one, fits of a model that lacks something end in other courses of events."""
STANDING_STILL = 1e-3
"""Gain (nats) of a turn after which another one is not worth its while; L-BFGS comes after it."""
SAME_PLACE = 0.5
"""Minima whose residuals differ by less (their norm, of unit variance) are one."""
CLIMBED = 1e-4
"""Gain (nats) of a step of L-BFGS after which the top is reached."""
NEAR_THE_TOP = 0.1
"""Nats that all steps of L-BFGS may gain together where they end at their limit, and still have reached the top."""


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


Refine = Callable[[Likelihood, Sequence[Float[np.ndarray, "dimension"]], Likelihood], list[Refined]]
"""Refines starts in the unknowns of one density in those of another one, or of the same; the best first."""


def best_first(found: Sequence[Refined]) -> list[Refined]:
    """Maxima, the most probable first."""
    return sorted(found, key=lambda one: -one.log_density)


@dataclass(frozen=True)
class Searched:
    """Maxima among which there are now others than before.

    Parameters
    ----------
    found
        The maxima, those from which the others were found among them, best first.
    evaluations
        Worlds simulated on the way.
    complete
        Whether all was looked at that might lead to others.
    """

    found: list[Refined]
    evaluations: int
    complete: bool = True

    def beside(self, others: Sequence[Refined], evaluations: int, *, complete: bool = True) -> "Searched":
        """With further maxima, from starts that took so many worlds to find."""
        worlds = self.evaluations + evaluations + sum(one.evaluations for one in others)
        return Searched(best_first([*self.found, *others]), worlds, self.complete and complete)


def refine(descent: Descent, starts: Sequence[Float[np.ndarray, "dimension"]], *, hopeless: float) -> list[Refined]:
    """Least squares and the most probable noise in turn, from several starts side by side.

    Parameters
    ----------
    descent
        How to lower the cost.
    starts
        Where to begin.
    hopeless
        Nats by which a start may be worse than the best one after a turn; one that is worse goes no further.
    """
    likelihood = descent.likelihood
    free = ~likelihood.coordinates.mask(NOISE_FIELDS)
    found = [Refined(start, -np.inf, False, 0) for start in starts]
    running = list(range(len(starts)))
    for _ in range(ROUNDS):
        if not running:
            break
        quiet = np.array([best_noise(likelihood, found[index].point) for index in running])
        minima = descent(quiet, free, iterations=ITERATIONS)
        lowered = np.array(
            [one.point if np.isfinite(one.cost) else point for one, point in zip(minima, quiet, strict=True)]
        )
        values = evaluate(likelihood.log_density, lowered)
        before = np.array([found[index].log_density for index in running])
        gains = np.subtract(values, before, out=np.zeros(len(running)), where=np.isfinite(values))
        for index, point, value, minimum in zip(running, lowered, values, minima, strict=True):
            worlds = found[index].evaluations + minimum.evaluations
            found[index] = Refined(point, float(value), minimum.converged, worlds)
        best = max(one.log_density for one in found)
        apart = _apart(minima, values)
        running = [
            index
            for index, alone, gained in zip(running, apart, gains, strict=True)
            if alone and gained > STANDING_STILL and found[index].log_density > best - hopeless
        ]
    return found


def _apart(minima: Sequence[Minimum], values: Float[np.ndarray, "start"]) -> Bool[np.ndarray, "start"]:
    """Which minima are not at the place of a better one, as far as the residuals tell places apart."""
    points, apart = np.array([one.point for one in minima]), np.ones(len(minima), dtype=bool)
    for index in np.argsort(-values, kind="stable"):
        if not apart[index]:
            continue
        near = np.linalg.norm((points - points[index]) @ minima[index].jacobian.T, axis=1) < SAME_PLACE
        apart &= ~near | (values > values[index]) | (np.arange(len(minima)) == index)
    return apart


def climb(likelihood: Likelihood, start: Mode, iterations: int) -> Refined:
    """Climb the log posterior by L-BFGS in whitened coordinates; never ends lower than it began."""
    gaussian = Gaussian.from_precision(start.point, start.precision)
    mean, root = torch.from_numpy(gaussian.mean), torch.from_numpy(gaussian.root)

    def cost(whitened: Float[Tensor, "dimension"]) -> Float[Tensor, ""]:
        return -likelihood.log_density((mean + root @ whitened)[None])[0]

    result = scipy_minimize(
        with_gradient(cost, FAILED - start.log_density),
        np.zeros(len(start.point)),
        jac=True,
        method="L-BFGS-B",
        options={"maxiter": iterations, "maxcor": 20, "ftol": CLIMBED / max(abs(start.log_density), 1.0)},
    )
    if not -result.fun > start.log_density:
        return Refined(start.point, start.log_density, False, int(result.nfev))
    at_limit = result.nit >= iterations
    converged = bool(result.success) or (at_limit and -result.fun < start.log_density + NEAR_THE_TOP)
    return Refined(gaussian.points(result.x), -float(result.fun), converged, int(result.nfev))


def at_the_top(found: Sequence[Refined], climbed: Sequence[Refined]) -> bool:
    """Whether the best of some maxima, and of what was climbed from there, is where a search ended by itself.

    Least squares end where only small steps help them; what L-BFGS gains from there is no small step.
    """
    before, best = (max(some, key=lambda one: one.log_density) for some in (found, climbed))
    return best.converged or (before.converged and best.log_density < before.log_density + NEAR_THE_TOP)


def mode_at(likelihood: Likelihood, refined: Refined) -> Mode:
    """The mode of a maximum, with the curvature around it."""
    _, derivative = jacobian(
        likelihood.residuals, refined.point, likelihood.coordinates.scale, central=True, own_side=True
    )
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

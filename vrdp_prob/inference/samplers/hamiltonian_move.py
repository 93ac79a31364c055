"""Hamiltonian Monte Carlo as a move of an emcee ensemble: all walkers follow the gradient at once, in one batch.

Source: Neal, MCMC using Hamiltonian dynamics, Handbook of Markov Chain Monte Carlo (2011), chapter 5.
"""

from collections.abc import Callable
from typing import Any

import emcee
import numpy as np
from jaxtyping import Bool, Float

FIRST_STEP = 0.2
"""Length of a leapfrog step before it is tuned, in units of the whitened coordinates."""
FEWEST_STEPS, MOST_STEPS = 8, 20
"""Leapfrog steps of a trajectory, drawn anew each time so that no oscillation of the density is met in phase."""
STEP_SPREAD = 0.2
"""Relative half width in which the step lengths of the walkers lie."""
ACCEPTANCE = 0.8
"""Acceptance that tuning aims at (Neal advises 0.65 and more; kinks at contacts make caution pay)."""
FARTHEST = 30.0
"""Whitened coordinate beyond which no trajectory goes, so that no wild world is simulated."""
TUNING_RATE = 0.7
"""Change of the log step per unit of excess acceptance."""

DensityAndGradient = Callable[
    [Float[np.ndarray, "walker dimension"]],
    tuple[Float[np.ndarray, "walker"], Float[np.ndarray, "walker dimension"]],
]
"""Log density and its gradient of a batch; the gradient is 0 where the density is not finite."""


class HamiltonianMove(emcee.moves.Move):  # type: ignore[misc]  # emcee has no types
    """Leapfrog trajectories of all walkers with unit masses.

    Parameters
    ----------
    density_and_gradient
        Log density of whitened coordinates with its gradient.
    steps
        Fewest and most leapfrog steps of a trajectory.
    """

    def __init__(
        self, density_and_gradient: DensityAndGradient, steps: tuple[int, int] = (FEWEST_STEPS, MOST_STEPS)
    ) -> None:
        self._density_and_gradient, self._steps = density_and_gradient, steps
        self.log_step = float(np.log(FIRST_STEP))

    @property
    def step(self) -> float:
        """Mean length of a leapfrog step."""
        return float(np.exp(self.log_step))

    def propose(self, model: Any, state: emcee.State) -> tuple[emcee.State, Bool[np.ndarray, "walker"]]:
        """Move every walker along a trajectory and accept or reject it by its error in energy."""
        walkers, dimension = state.coords.shape
        random = model.random
        steps = random.randint(self._steps[0], self._steps[1] + 1)
        length = self.step * (1 + STEP_SPREAD * random.uniform(-1, 1, size=(walkers, 1)))
        place, momentum = state.coords.copy(), random.standard_normal((walkers, dimension))
        energy = (momentum**2).sum(axis=1) / 2 - state.log_prob
        log_density, gradient = self._density_and_gradient(place)
        for _ in range(steps):
            half = momentum + length / 2 * gradient
            ahead = place + length * half
            near = np.abs(ahead).max(axis=1) < FARTHEST
            values, slopes = self._density_and_gradient(np.where(near[:, None], ahead, place))
            # Where there is no support ahead the walker turns round, which keeps the trajectory reversible.
            goes = near & np.isfinite(values)
            momentum = np.where(goes[:, None], half + length / 2 * slopes, -momentum)
            place = np.where(goes[:, None], ahead, place)
            log_density = np.where(goes, values, log_density)
            gradient = np.where(goes[:, None], slopes, gradient)
        with np.errstate(over="ignore"):  # what gains so much momentum is refused
            gain = energy - (momentum**2).sum(axis=1) / 2 + log_density
        # No trajectory leads back to a place that is too far off, so a walker there waits for other moves.
        near = np.abs(state.coords).max(axis=1) < FARTHEST
        accepted = (np.log(random.uniform(size=walkers)) < gain) & near
        return self.update(state, emcee.State(place, log_prob=log_density), accepted), accepted

    def tune(self, state: emcee.State, accepted: Bool[np.ndarray, "walker"]) -> None:
        """Lengthen or shorten the steps towards the acceptance that is aimed at; called while warming up only."""
        del state
        self.log_step += TUNING_RATE * (float(np.mean(accepted)) - ACCEPTANCE)

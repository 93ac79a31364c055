"""Moves of an emcee ensemble in the coordinates of a mixture's components, and jumps between these.

The ensemble lives in the whitened coordinates of the first component. A step takes place in those of a component that
is drawn without a look at the walkers, so it leaves the posterior as it is; the maps keep volumes up to a constant.
"""

from typing import Any

import emcee
import numpy as np
from jaxtyping import Bool, Float
from numpy.random import RandomState

from vrdp_prob.inference.draws.samples import LogDensity, evaluate
from vrdp_prob.inference.samplers.curved_gaussian import CurvedGaussian
from vrdp_prob.inference.samplers.mixture import Mixture


class ComponentMove(emcee.moves.Move):  # type: ignore[misc]  # emcee has no types
    """One of several moves, each in the coordinates of its component.

    Parameters
    ----------
    density
        The log posterior.
    mixture
        The components.
    moves
        One move per component.
    """

    def __init__(self, density: LogDensity, mixture: Mixture, moves: list[emcee.moves.Move]) -> None:
        self._density, self._mixture, self._moves = density, mixture, moves
        self._last = 0

    def propose(self, model: Any, state: emcee.State) -> tuple[emcee.State, Bool[np.ndarray, "walker"]]:
        """Move all walkers in the coordinates of one component."""
        components = self._mixture.components
        self._last = int(model.random.choice(len(components), p=self._mixture.weights))
        if self._last == 0:
            return self._moves[0].propose(model, state)
        component = components[self._last]

        def log_probability(
            whitened: Float[np.ndarray, "walker dimension"],
        ) -> tuple[Float[np.ndarray, "walker"], None]:
            return evaluate(self._density, component.points(whitened)), None

        inside = emcee.State(component.whitened(components[0].points(state.coords)), log_prob=state.log_prob)
        there = emcee.model.Model(None, log_probability, map, model.random)
        moved, accepted = self._moves[self._last].propose(there, inside)
        coordinates = components[0].whitened(component.points(moved.coords))
        kept = np.where(accepted[:, None], coordinates, state.coords)
        return emcee.State(kept, log_prob=moved.log_prob, random_state=state.random_state), accepted

    def tune(self, state: emcee.State, accepted: Bool[np.ndarray, "walker"]) -> None:
        """Tune the move that was made last."""
        self._moves[self._last].tune(state, accepted)


class IndependentProposal:
    """Proposals that forget the place, from the mixture, with the log ratio of their densities.

    Where the posterior is like the mixture an accepted proposal is an independent draw, in whichever mode.

    Parameters
    ----------
    mixture
        Where proposals come from.
    coordinates
        Whose whitened coordinates the walkers live in.
    """

    def __init__(self, mixture: Mixture, coordinates: CurvedGaussian) -> None:
        self._mixture, self._coordinates = mixture, coordinates

    def __call__(
        self, places: Float[np.ndarray, "walker dimension"], random: RandomState
    ) -> tuple[Float[np.ndarray, "walker dimension"], Float[np.ndarray, "walker"]]:
        """Proposals for walkers at some places."""
        points, _ = self._mixture.draws(len(places), random)
        ratio = self._mixture.log_density(self._coordinates.points(places)) - self._mixture.log_density(points)
        return self._coordinates.whitened(points), ratio

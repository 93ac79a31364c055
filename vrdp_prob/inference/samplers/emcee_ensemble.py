"""One emcee ensemble: its moves, what it has cost, and how it is kept on disk."""

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import emcee
import h5py
import numpy as np
from jaxtyping import Float
from numpy.random import RandomState

from vrdp_prob.files import write_atomically
from vrdp_prob.inference.draws.samples import LogDensity, evaluate, evaluate_with_gradient
from vrdp_prob.inference.samplers.component_move import ComponentMove, IndependentProposal
from vrdp_prob.inference.samplers.hamiltonian_move import DensityAndGradient, HamiltonianMove
from vrdp_prob.inference.samplers.mixture import Mixture
from vrdp_prob.inference.samplers.rate_steps import RateProposal, RateSteps
from vrdp_prob.models.simulator.work import metered

GROUP = "ensemble"
HAMILTONIAN, INDEPENDENT, DIFFERENCE, JUMP = 0.1, 0.4, 0.3, 0.1
"""Shares of the moves. One along the gradient costs as much as thirty of the others."""
TRADE, FAR = 0.4, 0.6
"""...and those of steps that trade rates, and of jumps between the islands of a posterior, beside them."""
MOVES_PER_STEP, WITH_JUMPS = 2, 3
"""Moves of all walkers between two draws that are kept, and as many where some of them are jumps."""


class Ensemble:
    """Walkers in the whitened coordinates of a mixture's first component.

    Parameters
    ----------
    density
        The log posterior, differentiable.
    mixture
        What is known of it.
    places
        Where the walkers set out from.
    seed
        Seed of all that it draws.
    file
        Where its chain is kept after every run; nowhere if None. What is there already is gone on with.
    jumps
        Proposals that reach what lies beyond the clouds of the mixture, if anything does.
    rate_steps
        Steps that trade rates of slowing down, if there are any.
    """

    def __init__(
        self,
        density: LogDensity,
        mixture: Mixture,
        places: Float[np.ndarray, "walker dimension"],
        seed: int,
        file: Path | None,
        *,
        jumps: Mixture | None = None,
        rate_steps: RateSteps | None = None,
    ) -> None:
        self._density, self._mixture, self._file = density, mixture, file
        self.evaluations = self.gradients = self.work = 0
        self._hamiltonian = [HamiltonianMove(self._with_gradient(index)) for index in range(len(mixture.components))]
        difference = [[emcee.moves.DEMove(gamma0=gamma) for _ in mixture.components] for gamma in (None, 1.0)]
        moves = [
            (ComponentMove(density, mixture, self._hamiltonian), HAMILTONIAN),
            (emcee.moves.MHMove(IndependentProposal(mixture, mixture.components[0])), INDEPENDENT),
            (ComponentMove(density, mixture, difference[0]), DIFFERENCE),
            (ComponentMove(density, mixture, difference[1]), JUMP),
        ]
        self._moves_per_step = MOVES_PER_STEP if jumps is None else WITH_JUMPS
        if rate_steps is not None:
            moves.append((emcee.moves.MHMove(RateProposal(rate_steps, mixture.components[0])), TRADE))
        if jumps is not None:
            moves.append((emcee.moves.MHMove(IndependentProposal(jumps, mixture.components[0])), FAR))
        whitened = mixture.components[0].whitened(places)
        self._sampler = emcee.EnsembleSampler(*whitened.shape, self._log_probability, moves=moves, vectorize=True)
        self._state = emcee.State(whitened, random_state=RandomState(seed).get_state())
        self._chain: Float[np.ndarray, "step walker dimension"] = np.empty((0, *whitened.shape))
        self._values: Float[np.ndarray, "step walker"] = np.empty((0, len(whitened)))
        self._accepted = np.zeros(len(whitened))
        self._kept = 0
        if file is not None:
            self._take_up(file)

    def _log_probability(self, whitened: Float[np.ndarray, "walker dimension"]) -> Float[np.ndarray, "walker"]:
        self.evaluations += len(whitened)
        return evaluate(self._density, self._mixture.components[0].points(whitened))

    def _with_gradient(self, index: int) -> DensityAndGradient:
        component = self._mixture.components[index]

        def density_and_gradient(
            whitened: Float[np.ndarray, "walker dimension"],
        ) -> tuple[Float[np.ndarray, "walker"], Float[np.ndarray, "walker dimension"]]:
            self.evaluations += len(whitened)
            self.gradients += len(whitened)
            return evaluate_with_gradient(lambda places: self._density(component.mapped(places)), whitened)

        return density_and_gradient

    @property
    def walkers(self) -> int:
        """Number of walkers."""
        return self._chain.shape[1]

    @property
    def steps(self) -> int:
        """Steps done so far."""
        return len(self._chain)

    def run(self, steps: int, *, tune: bool) -> None:
        """Do some more steps."""
        self._sampler.reset()
        with metered() as meter:
            self._state = self._sampler.run_mcmc(
                self._state,
                steps,
                tune=tune,
                thin_by=self._moves_per_step,
                skip_initial_state_check=True,
                progress=False,
            )
        self.work += meter.rows
        self._accepted += self._sampler.backend.accepted
        self._chain = np.concatenate([self._chain, self._sampler.get_chain()])
        self._values = np.concatenate([self._values, self._sampler.get_log_prob()])

    def keep(self) -> None:
        """Add the steps since the last time to the file, whole or not at all."""
        if self._file is None or self._kept == self.steps:
            return
        with write_atomically(self._file) as temporary:
            backend = emcee.backends.HDFBackend(str(temporary), name=GROUP)
            if self._kept:
                shutil.copyfile(self._file, temporary)
            else:
                temporary.unlink(missing_ok=True)
                backend.reset(*self._chain.shape[1:])
            backend.grow(self.steps - self._kept, None)
            for coords, values in zip(self._chain[self._kept :], self._values[self._kept :], strict=True):
                state = emcee.State(coords, log_prob=values, random_state=self._state.random_state)
                backend.save_step(state, np.zeros(len(coords), dtype=bool))
            with backend.open("a") as opened:
                opened[GROUP]["accepted"][:] = self._accepted
                opened[GROUP].attrs["log_steps"] = [move.log_step for move in self._hamiltonian]
                opened[GROUP].attrs["costs"] = [self.evaluations, self.gradients, self.work]
        self._kept = self.steps

    def _take_up(self, file: Path) -> None:
        """Go on from what a file holds, if there is one that can be read."""
        backend = emcee.backends.HDFBackend(str(file), name=GROUP, read_only=True)
        try:
            with h5py.File(file, "r") as opened:
                log_steps = list(opened[GROUP].attrs["log_steps"])
                costs = [int(cost) for cost in opened[GROUP].attrs["costs"]]
            last = backend.get_last_sample()
            chain, values, accepted = backend.get_chain(), backend.get_log_prob(), backend.accepted
        except (OSError, KeyError, AttributeError):
            return
        self._chain, self._values, self._accepted = chain, values, accepted
        self.evaluations, self.gradients, self.work = costs
        for move, log_step in zip(self._hamiltonian, log_steps, strict=True):
            move.log_step = float(log_step)
        self._state = emcee.State(last.coords, log_prob=last.log_prob, random_state=_random_state(last.random_state))
        self._kept = self.steps

    @property
    def acceptance(self) -> float:
        """Share of the moves that were accepted, of each step the last one."""
        return float(self._accepted.mean() / max(self.steps, 1))

    def chain(self, discard: int) -> Float[np.ndarray, "step walker dimension"]:
        """Whitened coordinates after the first steps."""
        return self._chain[discard:]

    def log_density(self, discard: int) -> Float[np.ndarray, "step walker"]:
        """Log density after the first steps."""
        return self._values[discard:]


def _random_state(found: Sequence[Any]) -> tuple[Any, ...]:
    """State of the generator from a file; emcee ignores one that it does not understand, so it is tried here."""
    state = tuple(found)
    RandomState().set_state(state)
    return state

"""Sampling with emcee: independent ensembles of walkers, each merged into one chain before anything is judged.

Moves along the gradient do most of the mixing; differential evolution and proposals that forget the place jump between
what gradients do not connect.

Walkers of one ensemble propose from one another, so they are no independent chains; whole ensembles are.
No snooker moves: in emcee 3.1.6 they shrink a Gaussian's standard deviation to 0.77 of what it is.
Source: Foreman-Mackey, Hogg, Lang and Goodman, emcee: The MCMC Hammer, PASP 125 (2013); ter Braak, A Markov chain
Monte Carlo version of the genetic algorithm differential evolution, Statistics and Computing 16 (2006).
"""

import os
from concurrent.futures import ThreadPoolExecutor

import emcee
import numpy as np
from jaxtyping import Float
from numpy.random import RandomState

from vrdp_prob.inference.curved_gaussian import CurvedGaussian
from vrdp_prob.inference.hamiltonian_move import HamiltonianMove
from vrdp_prob.inference.laplace import DEGREES_OF_FREEDOM, adapted, starting_places, tail_log_density
from vrdp_prob.inference.mixture import Mixture
from vrdp_prob.inference.samples import (
    ESS_GOAL,
    R_HAT_GOAL,
    LogDensity,
    Samples,
    chain_statistics,
    evaluate,
    evaluate_with_gradient,
)
from vrdp_prob.progress import ProgressDisplay, SilentProgress

ENSEMBLES = 4
WARM_UP = 16
"""Steps that tune the Hamiltonian move and are thrown away."""
STEPS_PER_ROUND = 24
STEPS_TOGETHER = 2
"""Steps after which the ensembles, one thread each, wait for one another, so that an interruption is soon noticed."""
ROUNDS = 5
"""Rounds after which sampling stops even if it has not converged; a number of steps and not a time, so that the same
seed gives the same draws on every machine."""
START_POOL = 16
"""Importance-sampled candidates per walker from which the starting places are taken."""


def sample_emcee(
    density: LogDensity,
    start: Mixture,
    *,
    draws: int,
    generator: np.random.Generator,
    progress: ProgressDisplay | None = None,
    rounds: int = ROUNDS,
) -> Samples:
    """Draw with several independent ensembles.

    Parameters
    ----------
    density
        The log posterior, differentiable.
    start
        What is known of the posterior, from which the walkers set out.
    draws
        Number of draws that are wanted over all ensembles; ensembles are run until they have converged, which gives
        more.
    generator
        Source of randomness.
    progress
        Told how many steps are done.
    rounds
        At most so many rounds of 24 steps.

    Returns
    -------
    One chain per ensemble, walker after walker so that autocorrelation within a walker shows; all steps after warm-up.
    The R-hat that goes with it compares the ensembles' earlier with their later steps.
    """
    del draws
    cloud, adapting = adapted(density, start.components[0], generator, lambda _steps: None)
    walkers = 2 * (cloud.dimension + 1)
    ensembles = [_Ensemble(density, cloud, walkers, generator) for _ in range(ENSEMBLES)]
    workers = ThreadPoolExecutor(max_workers=min(ENSEMBLES, os.cpu_count() or 1))
    display = (progress or SilentProgress()).stage("Sampling (emcee)", total=WARM_UP + rounds * STEPS_PER_ROUND)
    with workers, display as advance:

        def run(steps: int, *, tune: bool) -> None:
            for _ in range(steps // STEPS_TOGETHER):
                list(workers.map(lambda ensemble: ensemble.run(STEPS_TOGETHER, tune=tune), ensembles))
                advance(STEPS_TOGETHER)

        run(WARM_UP, tune=True)
        for _round in range(rounds):
            run(STEPS_PER_ROUND, tune=False)
            points = cloud.points(np.stack([ensemble.chain() for ensemble in ensembles]))
            drift = _drift(points)
            r_hat, ess = chain_statistics(_by_walker(points))
            if max(r_hat, drift) <= R_HAT_GOAL and ess >= 1.25 * ESS_GOAL:
                break
    log_density = np.stack([ensemble.log_density() for ensemble in ensembles])
    acceptance = [np.full(log_density[0].size, ensemble.acceptance) for ensemble in ensembles]
    return Samples(
        _by_walker(points),
        _by_walker(log_density[..., None])[..., 0],
        {"acceptance_rate": np.stack(acceptance)},
        r_hat=drift,
        evaluations=adapting + sum(ensemble.evaluations for ensemble in ensembles),
        gradients=sum(ensemble.gradients for ensemble in ensembles),
    )


class _Ensemble:
    """One emcee ensemble in whitened coordinates."""

    def __init__(
        self, density: LogDensity, start: CurvedGaussian, walkers: int, generator: np.random.Generator
    ) -> None:
        self._density, self._gaussian = density, start
        self.evaluations, self.gradients = START_POOL * walkers, 0
        moves = [
            (HamiltonianMove(self._with_gradient), 0.4),
            (emcee.moves.MHMove(_independent), 0.2),
            (emcee.moves.DEMove(), 0.3),
            (emcee.moves.DEMove(gamma0=1.0), 0.1),
        ]
        self._sampler = emcee.EnsembleSampler(
            walkers, start.dimension, self._log_probability, moves=moves, vectorize=True
        )
        state = RandomState(int(generator.integers(2**31))).get_state()
        places = starting_places(density, start, walkers, START_POOL * walkers, generator)
        self._state = emcee.State(places, random_state=state)

    def _log_probability(self, whitened: Float[np.ndarray, "walker dimension"]) -> Float[np.ndarray, "walker"]:
        self.evaluations += len(whitened)
        return evaluate(self._density, self._gaussian.points(whitened))

    def _with_gradient(
        self, whitened: Float[np.ndarray, "walker dimension"]
    ) -> tuple[Float[np.ndarray, "walker"], Float[np.ndarray, "walker dimension"]]:
        self.evaluations += len(whitened)
        self.gradients += len(whitened)
        return evaluate_with_gradient(lambda places: self._density(self._gaussian.mapped(places)), whitened)

    def run(self, steps: int, *, tune: bool) -> None:
        self._state = self._sampler.run_mcmc(
            self._state, steps, tune=tune, skip_initial_state_check=True, progress=False
        )

    @property
    def acceptance(self) -> float:
        return float(np.mean(self._sampler.acceptance_fraction))

    def chain(self) -> Float[np.ndarray, "step walker dimension"]:
        steps: np.ndarray = self._sampler.get_chain(discard=WARM_UP)
        return steps

    def log_density(self) -> Float[np.ndarray, "step walker"]:
        values: np.ndarray = self._sampler.get_log_prob(discard=WARM_UP)
        return values


def _by_walker(values: Float[np.ndarray, "chain step walker axis"]) -> Float[np.ndarray, "chain draw axis"]:
    """Ensembles as chains, walker after walker."""
    return np.swapaxes(values, 1, 2).reshape(len(values), -1, values.shape[-1])


def _drift(points: Float[np.ndarray, "chain step walker dimension"]) -> float:
    """Largest R-hat of the ensembles, each split into its earlier and its later steps."""
    return chain_statistics(points.reshape(len(points), -1, points.shape[-1]))[0]


def _independent(
    places: Float[np.ndarray, "walker dimension"], random: RandomState
) -> tuple[Float[np.ndarray, "walker dimension"], Float[np.ndarray, "walker"]]:
    """Proposals that forget the place, from the Student-t around the MAP, with the log ratio of their densities.

    Where the posterior is nearly Gaussian an accepted proposal is an independent draw; other moves serve the rest.
    """
    count, dimension = places.shape
    chi_square = random.chisquare(DEGREES_OF_FREEDOM, size=count) / DEGREES_OF_FREEDOM
    proposed = random.standard_normal((count, dimension)) / np.sqrt(chi_square)[:, None]
    return proposed, tail_log_density(places) - tail_log_density(proposed)

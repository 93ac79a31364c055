"""Give a mixture the place and shape of the posterior before it proposes anything.

The curvature at a mode says little where contacts come and go within a standard deviation, or where an unseen yaw may
turn freely until a corner would touch. So, around each mode, many walkers follow the gradient for a short while, all in
one batch, and the cloud takes their mean and covariance; draws with weights then set right what is left.

Source: Cappe, Douc, Guillin, Marin and Robert, Adaptive importance sampling in general mixture classes, Statistics and
Computing 18 (2008).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import torch
from emcee import State
from emcee.model import Model
from jaxtyping import Bool, Float, Int
from numpy.random import RandomState

from vrdp_prob.inference.draws.samples import PARETO_K_GOAL, LogDensity, evaluate, evaluate_with_gradient
from vrdp_prob.inference.samplers.curved_gaussian import CurvedGaussian
from vrdp_prob.inference.samplers.hamiltonian_move import HamiltonianMove
from vrdp_prob.inference.samplers.importance import Weighted, effective_count, flattened, smoothed_weights
from vrdp_prob.inference.samplers.mixture import Mixture
from vrdp_prob.inference.samplers.proposals import LEAST_WEIGHT
from vrdp_prob.progress import Advance

TRIAL_DRAWS = 1500
GOOD_ENOUGH = 0.08
"""Effective share of the draws from which on a proposal is left as it is."""
WALKERS = 64
ROUNDS = 6
"""Times that walkers run and the cloud takes their shape."""
TRANSITIONS = 3
"""Trajectories per round."""
MEMORY = 3
"""Rounds back whose places still shape the cloud."""
STEPS = (6, 12)
PROBES = np.array([0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0])
"""Places along every axis, on both sides of the mode, at which walls within a standard deviation show."""
NEAR = 0.7
"""Scale at which walkers set out around the mode, where nothing has come between."""
CANDIDATES = 4
"""Candidates per walker, from which those with support are taken."""
PLAUSIBLE = 30.0
"""Walkers whose log density is lower than the best one's by this and the number of coordinates are given up."""
CORRELATION = 2.0
"""Places of walkers that are worth one independent draw."""
EFFECTIVE_PER_DIMENSION = 8.0
"""Weights are flattened until so many effective draws per dimension shape the next proposal."""
REFINEMENTS = 2
JITTER = 0.1
"""Distance, in standard deviations, by which chains set out from where a walker was."""
LEAST_VARIANCE = 1e-4
"""Variance along an axis, relative to what it was, that is left at least after the cloud has taken a new shape."""
CUT = 0.7
"""Variance along an axis, relative to the curvature's, below which something else than curvature bounds it."""


@dataclass(frozen=True)
class Shaped:
    """A mixture that has the posterior's shape, and what that cost.

    Parameters
    ----------
    mixture
        The mixture.
    places
        Points with support that walkers ended at, for chains to set out from, with the component of each.
    component
        Component around which each place was found.
    evaluations, gradients
        Log densities computed, and how many of them with their gradient.
    """

    mixture: Mixture
    places: Float[np.ndarray, "place dimension"]
    component: Int[np.ndarray, "place"]
    evaluations: int
    gradients: int

    def arrays(self) -> dict[str, np.ndarray]:
        """Everything that the clouds from which it set out do not know."""
        return {
            "shift": np.stack([cloud.shift.numpy() for cloud in self.mixture.components]),
            "scale": np.stack([cloud.scale.numpy() for cloud in self.mixture.components]),
            "log_weights": self.mixture.log_weights,
            "places": self.places,
            "component": self.component,
            "costs": np.array([self.evaluations, self.gradients]),
        }

    @classmethod
    def of_arrays(cls, arrays: Mapping[str, np.ndarray], start: Mixture) -> "Shaped":
        """What `arrays` was made of, with the clouds from which it set out."""
        clouds = [
            replace(cloud, shift=torch.from_numpy(shift), scale=torch.from_numpy(scale))
            for cloud, shift, scale in zip(start.components, arrays["shift"], arrays["scale"], strict=True)
        ]
        evaluations, gradients = (int(cost) for cost in arrays["costs"])
        mixture = Mixture(tuple(clouds), arrays["log_weights"])
        return cls(mixture, arrays["places"], arrays["component"], evaluations, gradients)


def starting_places(
    density: LogDensity, form: Shaped, count: int, generator: np.random.Generator, *, mode: int | None = None
) -> Float[np.ndarray, "count dimension"]:
    """Places for chains to set out from, near those where walkers have been, in one mode or all by their weights."""
    modes = np.full(count, mode or 0)
    if mode is None:
        modes = np.asarray(generator.choice(len(form.mixture.components), size=count, p=form.mixture.weights))
    chosen = [generator.choice(np.flatnonzero(form.component == mode)) for mode in modes]
    places = form.places[chosen]
    moved = places.copy()
    jitter = np.asarray(JITTER * generator.standard_normal(places.shape))
    for index, cloud in enumerate(form.mixture.components):
        own = modes == index
        moved[own] = cloud.points(cloud.whitened(places[own]) + jitter[own])
    near = evaluate(density, moved) > evaluate(density, places) - PLAUSIBLE
    return np.where(near[:, None], moved, places)


def shaped(density: LogDensity, start: Mixture, generator: np.random.Generator, advance: Advance) -> Shaped:
    """Shape a mixture by short runs of walkers and weighted draws.

    Parameters
    ----------
    density
        The log posterior, differentiable.
    start
        One cloud per mode.
    generator
        Source of randomness.
    advance
        Told how many worlds were simulated.
    """
    trial = Weighted.drawn(density, start, TRIAL_DRAWS, generator, advance)
    if _good_share(trial) >= GOOD_ENOUGH:
        return _as_it_is(start, trial, generator)
    swarms = []
    for cloud in start.components:
        swarm = _Swarm(density, cloud, generator)
        for _ in range(ROUNDS):
            swarm.run(advance)
        swarms.append(swarm)
    mixture = Mixture(tuple(swarm.cloud for swarm in swarms), start.log_weights)
    mixture, refining = _refined(density, mixture, [swarm.pool for swarm in swarms], generator, advance)
    return Shaped(
        mixture,
        np.concatenate([swarm.places for swarm in swarms]),
        np.repeat(np.arange(len(swarms)), [len(swarm.places) for swarm in swarms]),
        TRIAL_DRAWS + refining + sum(swarm.evaluations for swarm in swarms),
        sum(swarm.evaluations for swarm in swarms),
    )


def _as_it_is(start: Mixture, trial: Weighted, generator: np.random.Generator) -> Shaped:
    """A mixture that needs no shaping, with places from draws that were weighted by its own components."""
    weights, _ = smoothed_weights(trial.log_ratio)
    shares = start.memberships(trial.points) * weights[:, None]
    heavy = np.maximum(shares.sum(axis=0), LEAST_WEIGHT)
    places = [
        trial.points[generator.choice(len(weights), size=WALKERS, p=own / own.sum())]
        for own in np.maximum(shares, 1e-300).T
    ]
    mixture = Mixture(start.components, np.log(heavy / heavy.sum()))
    component = np.repeat(np.arange(len(heavy)), WALKERS)
    return Shaped(mixture, np.concatenate(places), component, TRIAL_DRAWS, 0)


class _Swarm:
    """Walkers around one mode, and the cloud that takes their shape."""

    def __init__(self, density: LogDensity, cloud: CurvedGaussian, generator: np.random.Generator) -> None:
        self._density, self._generator = density, generator
        self.cloud, self.evaluations = _probed(density, cloud), CANDIDATES * WALKERS
        self._move = HamiltonianMove(self._with_gradient, steps=STEPS)
        candidates = NEAR * generator.standard_normal((CANDIDATES * WALKERS, cloud.dimension))
        candidates[0] = 0.0
        log_density = evaluate(density, self.cloud.points(candidates))
        chosen = generator.choice(np.flatnonzero(self._plausible(log_density)), size=WALKERS)
        self._state = State(candidates[chosen], log_prob=log_density[chosen])
        self._model = Model(None, None, map, RandomState(int(generator.integers(2**31))))
        self._seen: list[Float[np.ndarray, "place dimension"]] = []

    def _plausible(self, log_density: Float[np.ndarray, "walker"]) -> Bool[np.ndarray, "walker"]:
        return np.asarray(log_density >= log_density.max() - PLAUSIBLE - self.cloud.dimension)

    def _with_gradient(
        self, whitened: Float[np.ndarray, "walker dimension"]
    ) -> tuple[Float[np.ndarray, "walker"], Float[np.ndarray, "walker dimension"]]:
        self.evaluations += len(whitened)
        return evaluate_with_gradient(lambda places: self._density(self.cloud.mapped(places)), whitened)

    @property
    def places(self) -> Float[np.ndarray, "walker dimension"]:
        """Where the walkers are."""
        return self.cloud.points(self._state.coords)

    @property
    def pool(self) -> Float[np.ndarray, "place dimension"]:
        """Where the walkers have been of late."""
        return np.concatenate(self._seen[-MEMORY * TRANSITIONS :])

    def run(self, advance: Advance) -> None:
        """Let the walkers run and give the cloud their shape."""
        for _ in range(TRANSITIONS):
            before = self.evaluations
            self._state, accepted = self._move.propose(self._model, self._state)
            self._move.tune(self._state, accepted)
            self._replace_lost()
            self._seen.append(self.places)
            advance(self.evaluations - before)
        # Early places tell where the walkers came from.
        self._seen = self._seen[len(self._seen) // 3 :]
        places, whitened = self.places, self.cloud.whitened(self.pool)
        weights = np.full(len(whitened), 1 / len(whitened))
        self.cloud = _fitted(self.cloud, whitened, weights, len(whitened) / CORRELATION)
        self._state = State(self.cloud.whitened(places), log_prob=self._state.log_prob)

    def _replace_lost(self) -> None:
        """Walkers behind a wall, where the posterior has next to no mass, go on from the place of another one."""
        good = self._plausible(self._state.log_prob)
        instead = self._generator.choice(np.flatnonzero(good), size=int((~good).sum()))
        self._state.coords[~good] = self._state.coords[instead]
        self._state.log_prob[~good] = self._state.log_prob[instead]


def _probed(density: LogDensity, cloud: CurvedGaussian) -> CurvedGaussian:
    """The cloud with each axis as long as the density along it says, where that is shorter than the curvature's."""
    steps = np.concatenate([-PROBES[::-1], [0.0], PROBES])
    places = steps[:, None, None] * np.eye(cloud.dimension)
    log_density = evaluate(density, cloud.points(places.reshape(-1, cloud.dimension))).reshape(len(steps), -1)
    values = np.exp(np.maximum(log_density - log_density.max(axis=0), -700.0))
    moments = [np.trapezoid(values * steps[:, None] ** power, steps, axis=0) for power in range(3)]
    mean = moments[1] / moments[0]
    variance = np.clip(moments[2] / moments[0] - mean**2, PROBES[0] ** 2, 1.0)
    cut = variance < CUT
    return cloud.moved(np.where(cut, mean, 0.0), np.diag(np.where(cut, variance, 1.0)))


def _refined(
    density: LogDensity,
    mixture: Mixture,
    pools: list[Float[np.ndarray, "place dimension"]],
    generator: np.random.Generator,
    advance: Advance,
) -> tuple[Mixture, int]:
    """The best of a mixture and those that weighted draws of it and the walkers' places shape."""
    best, most, evaluations = mixture, 0.0, 0
    for _ in range(REFINEMENTS + 1):
        drawn = Weighted.drawn(density, mixture, TRIAL_DRAWS, generator, advance)
        evaluations += TRIAL_DRAWS
        share = _good_share(drawn)
        if share > most:
            best, most = mixture, share
        if share >= GOOD_ENOUGH:
            break
        mixture = _updated(mixture, drawn, pools)
    return best, evaluations


def _updated(mixture: Mixture, drawn: Weighted, pools: list[Float[np.ndarray, "place dimension"]]) -> Mixture:
    weights = flattened(drawn.log_ratio, EFFECTIVE_PER_DIMENSION * mixture.dimension)
    shares = mixture.memberships(drawn.points) * weights[:, None]
    clouds = []
    for index, (cloud, pool) in enumerate(zip(mixture.components, pools, strict=True)):
        own = shares[:, index] / shares[:, index].sum()
        count = effective_count(own)
        places = cloud.whitened(np.concatenate([pool, drawn.points]))
        trust = count / (count + len(pool))
        both = np.concatenate([np.full(len(pool), (1 - trust) / len(pool)), trust * own])
        clouds.append(_fitted(cloud, places, both, count + len(pool)))
    heavy = np.maximum(mixture.memberships(drawn.points).T @ smoothed_weights(drawn.log_ratio)[0], LEAST_WEIGHT)
    return Mixture(tuple(clouds), np.log(heavy / heavy.sum()))


def _fitted(
    cloud: CurvedGaussian,
    whitened: Float[np.ndarray, "place dimension"],
    weights: Float[np.ndarray, "place"],
    independent: float,
) -> CurvedGaussian:
    """The cloud with the mean and covariance of weighted places, as far as these differ by more than chance.

    Eigenvalues that so many draws of the cloud itself would show by chance are taken for 1, the others freed of what
    chance adds to them. Source: Donoho, Gavish and Johnstone, Optimal shrinkage of eigenvalues in the spiked covariance
    model, Annals of Statistics 46 (2018). Walkers that hardly moved lie in fewer places than there are axes, and say
    nothing of how short an axis is.
    """
    lengths_are_told = len(np.unique(whitened, axis=0)) > cloud.dimension
    mean = weights @ whitened
    centred = whitened - mean
    values, vectors = np.linalg.eigh((centred * weights[:, None]).T @ centred)
    ratio = min(cloud.dimension / independent, 0.9)
    beyond = (values > (1 + ratio**0.5) ** 2) | (lengths_are_told & (values < (1 - ratio**0.5) ** 2))
    sums = values + 1 - ratio
    roots = np.sqrt(np.maximum(sums**2 - 4 * values, 0.0))
    freed = np.where(beyond, (sums + np.where(values > 1, roots, -roots)) / 2, 1.0)
    variances = np.maximum(np.maximum(freed, values / 4), LEAST_VARIANCE)
    return cloud.moved(mean, (vectors * variances) @ vectors.T)


def _good_share(drawn: Weighted) -> float:
    """Effective share of the draws; much less where their weights cannot be trusted."""
    weights, pareto_k = smoothed_weights(drawn.log_ratio)
    if not np.isfinite(pareto_k):
        return 0.0
    return effective_count(weights) / len(weights) * (1.0 if pareto_k <= PARETO_K_GOAL else 0.1)

"""Sampling with Pyro's NUTS on the log posterior, whitened, several independent chains.

Source: Hoffman and Gelman, The No-U-Turn Sampler, JMLR 15 (2014); Bingham et al., Pyro, JMLR 20 (2019).
"""

import warnings

import numpy as np
import pyro
import torch
from jaxtyping import Float
from pyro.infer.mcmc import MCMC, NUTS
from torch import Tensor

from vrdp_prob.inference.curved_gaussian import CurvedGaussian
from vrdp_prob.inference.laplace import adapted, starting_places
from vrdp_prob.inference.mixture import Mixture
from vrdp_prob.inference.samples import LogDensity, Samples, evaluate
from vrdp_prob.progress import Advance, ProgressDisplay, SilentProgress

CHAINS = 4
WARM_UP = 60
"""Steps that only adapt the step size: the mass matrix is the whitening, which weighted draws have already shaped."""
TREE_DEPTH = 6
ACCEPTANCE = 0.85
START_POOL = 200
OUT_OF_SUPPORT = 1e10
"""Potential where a world has no support; finite, because Pyro compares energies."""


def sample_nuts(
    density: LogDensity,
    start: Mixture,
    *,
    draws: int,
    generator: np.random.Generator,
    progress: ProgressDisplay | None = None,
    warm_up: int = WARM_UP,
) -> Samples:
    """Draw with several NUTS chains, one after another.

    Parameters
    ----------
    density
        The log posterior, differentiable.
    start
        What is known of the posterior; chains set out from points drawn near it.
    draws
        Number of draws over all chains.
    generator
        Source of randomness.
    progress
        Told how many transitions are done.
    warm_up
        Adaptation steps per chain.

    Returns
    -------
    The chains, with the number of divergences.
    """
    per_chain = -(-draws // CHAINS)
    cloud, adapting = adapted(density, start.components[0], generator, lambda _steps: None)
    potential = _Potential(density, cloud)
    starts = starting_places(density, cloud, CHAINS, START_POOL, generator)
    chains: list[np.ndarray] = []
    divergences = 0
    with (progress or SilentProgress()).stage("Sampling (NUTS)", total=CHAINS * (warm_up + per_chain)) as advance:
        for place in starts:
            seed = int(generator.integers(2**31))
            whitened, divergent = _chain(potential, place, warm_up=warm_up, draws=per_chain, seed=seed, advance=advance)
            chains.append(whitened)
            divergences += divergent
    whitened_chains = np.stack(chains)
    points = cloud.points(whitened_chains)
    log_density = np.stack([evaluate(density, chain) for chain in points])
    return Samples(points, log_density, divergences=divergences, evaluations=adapting, gradients=potential.gradients)


class _Potential:
    """Negative log density in whitened coordinates, as Pyro wants it; counts its calls."""

    def __init__(self, density: LogDensity, start: CurvedGaussian) -> None:
        self._density = density
        self._start = start
        self.gradients = 0

    def __call__(self, parameters: dict[str, Tensor]) -> Tensor:
        self.gradients += 1
        value = -self._density(self._start.mapped(parameters["whitened"][None]))[0]
        if bool(torch.isfinite(value)):
            return value
        return OUT_OF_SUPPORT + 0.0 * parameters["whitened"].sum()


def _chain(
    potential: _Potential,
    place: Float[np.ndarray, "dimension"],
    *,
    warm_up: int,
    draws: int,
    seed: int,
    advance: Advance,
) -> tuple[Float[np.ndarray, "draw dimension"], int]:
    kernel = NUTS(
        potential_fn=potential,
        adapt_mass_matrix=False,
        full_mass=False,
        max_tree_depth=TREE_DEPTH,
        target_accept_prob=ACCEPTANCE,
    )
    state = torch.get_rng_state()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            pyro.set_rng_seed(seed)
            sampler = MCMC(
                kernel,
                num_samples=draws,
                warmup_steps=warm_up,
                initial_params={"whitened": torch.from_numpy(place)},
                disable_progbar=True,
                hook_fn=lambda *_: advance(1),
            )
            sampler.run()
    finally:
        torch.set_rng_state(state)
    diverging = sampler.diagnostics()["divergences"]
    return sampler.get_samples()["whitened"].detach().numpy(), sum(len(places) for places in diverging.values())

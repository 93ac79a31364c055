"""Pieces of a NUTS chain, each with a seed of its own, so that a chain can be broken off and gone on with anywhere.

Source: Hoffman and Gelman, The No-U-Turn Sampler, JMLR 15 (2014); Bingham et al., Pyro, JMLR 20 (2019).
"""

import warnings
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from pyro.infer.mcmc import NUTS
from torch import Tensor

from vrdp_prob.inference.curved_gaussian import CurvedGaussian
from vrdp_prob.inference.samples import LogDensity
from vrdp_prob.models.simulator.work import metered

TREE_DEPTH = 6
ACCEPTANCE = 0.85
OUT_OF_SUPPORT = 1e10
"""Potential where a world has no support; finite, because Pyro compares energies."""


@dataclass(frozen=True)
class Task:
    """A piece of a chain that is to be made.

    Parameters
    ----------
    density
        The log posterior, differentiable.
    cloud
        Whitens its coordinates.
    place
        Whitened coordinates from which the chain goes on.
    step_size
        Length of a leapfrog step; None where it is to be found, which uses the transitions up.
    transitions
        How many there are to be.
    seed
        Seed of the piece.
    """

    density: LogDensity
    cloud: CurvedGaussian
    place: Float[np.ndarray, "dimension"]
    step_size: float | None
    transitions: int
    seed: int


@dataclass(frozen=True)
class Piece:
    """What a task gave: the places after every transition in whitened coordinates, and what they cost."""

    whitened: Float[np.ndarray, "draw dimension"]
    step_size: float
    divergences: int
    gradients: int
    work: int

    def arrays(self) -> dict[str, np.ndarray]:
        """The same as arrays."""
        costs = np.array([self.divergences, self.gradients, self.work])
        return {"whitened": self.whitened, "step_size": np.array(self.step_size), "costs": costs}

    @classmethod
    def of_arrays(cls, arrays: dict[str, np.ndarray]) -> "Piece":
        """What `arrays` was made of."""
        divergences, gradients, work = (int(cost) for cost in arrays["costs"])
        return cls(arrays["whitened"], float(arrays["step_size"]), divergences, gradients, work)


class _Potential:
    """Negative log density in whitened coordinates, as Pyro wants it; counts its calls."""

    def __init__(self, density: LogDensity, cloud: CurvedGaussian) -> None:
        self._density, self._cloud = density, cloud
        self.gradients = 0

    def __call__(self, parameters: dict[str, Tensor]) -> Tensor:
        self.gradients += 1
        value = -self._density(self._cloud.mapped(parameters["whitened"][None]))[0]
        if bool(torch.isfinite(value)):
            return value
        return OUT_OF_SUPPORT + 0.0 * parameters["whitened"].sum()


def make(task: Task) -> Piece:
    """Make a piece of a chain."""
    potential = _Potential(task.density, task.cloud)
    finding = task.step_size is None
    kernel = NUTS(
        potential_fn=potential,
        step_size=task.step_size or 1.0,
        adapt_step_size=finding,
        adapt_mass_matrix=False,
        full_mass=False,
        max_tree_depth=TREE_DEPTH,
        target_accept_prob=ACCEPTANCE,
    )
    places = []
    with torch.random.fork_rng(devices=[]), warnings.catch_warnings(), metered() as meter:
        warnings.simplefilter("ignore")
        torch.manual_seed(task.seed)
        parameters = {"whitened": torch.from_numpy(task.place.copy())}
        kernel.initial_params = parameters
        kernel.setup(warmup_steps=task.transitions if finding else 0)
        for _ in range(task.transitions):
            parameters = kernel.sample(parameters)
            places.append(parameters["whitened"].detach().numpy().copy())
        diverged = 0 if finding else len(kernel.diagnostics()["divergences"])
    return Piece(np.array(places), float(kernel.step_size), diverged, potential.gradients, meter.rows)

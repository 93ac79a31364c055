"""Pieces of several NUTS chains with a seed each, so that they can be broken off and gone on with anywhere.

Source: Hoffman and Gelman, The No-U-Turn Sampler, JMLR 15 (2014); Bingham et al., Pyro, JMLR 20 (2019).
"""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import torch
from jaxtyping import Float
from pyro.infer.mcmc import NUTS
from torch import Tensor

from vrdp_prob.inference.draws.samples import LogDensity, evaluate_with_gradient
from vrdp_prob.inference.samplers.curved_gaussian import CurvedGaussian
from vrdp_prob.inference.samplers.mixture import Mixture
from vrdp_prob.inference.samplers.nuts_lockstep import Ask, in_lockstep
from vrdp_prob.inference.samplers.rate_steps import RateSteps
from vrdp_prob.models.simulator.work import metered

TREE_DEPTH = 6
ACCEPTANCE = 0.85
TRIES = 4
"""Steps of either kind that are tried before every transition."""
OUT_OF_SUPPORT = 1e10
"""Potential where a world has no support; finite, because Pyro compares energies."""

Courses = Callable[[Float[Tensor, "point dimension"]], Sequence[object]]
"""The course of events at each of some points: equal where the density is smooth from one point to another."""


@dataclass(frozen=True)
class Task:
    """A piece of some chains of one mode that is to be made.

    Parameters
    ----------
    density
        The log posterior, differentiable.
    cloud
        Whitens its coordinates.
    places
        Whitened coordinates from which each chain goes on.
    step_sizes
        Length of a leapfrog step of each; None where they are to be found, which uses the transitions up.
    transitions
        How many there are to be.
    seeds
        Seed of each chain's piece.
    jumps
        Proposals that reach what trajectories do not, tried before every transition; None for none.
    rate_steps
        Steps that trade rates of slowing down, tried before every transition; None for none.
    courses
        Tells divergences at a contact that comes or goes from others; None to count all alike.
    """

    density: LogDensity
    cloud: CurvedGaussian
    places: Float[np.ndarray, "chain dimension"]
    step_sizes: Float[np.ndarray, "chain"] | None
    transitions: int
    seeds: tuple[int, ...]
    jumps: Mixture | None = None
    rate_steps: RateSteps | None = None
    courses: Courses | None = None


@dataclass(frozen=True)
class Piece:
    """What a task gave, and what it cost.

    Parameters
    ----------
    whitened
        The places after every transition in whitened coordinates.
    step_sizes
        Length of a leapfrog step of each chain.
    divergences
        Transitions that ended where the energy flew away within the course of events that they had begun in.
    cliffs
        Transitions that ended where it did so behind a change of that course.
    gradients, work
        Gradients of all chains, and what their simulations had to do.
    """

    whitened: Float[np.ndarray, "chain draw dimension"]
    step_sizes: Float[np.ndarray, "chain"]
    divergences: int
    cliffs: int
    gradients: int
    work: int

    def arrays(self) -> dict[str, np.ndarray]:
        """The same as arrays."""
        counts = np.array([self.divergences, self.cliffs, self.gradients, self.work])
        return {"whitened": self.whitened, "step_sizes": self.step_sizes, "counts": counts}

    @classmethod
    def of_arrays(cls, arrays: dict[str, np.ndarray]) -> "Piece":
        """What `arrays` was made of."""
        return cls(arrays["whitened"], arrays["step_sizes"], *(int(count) for count in arrays["counts"]))


class _Answered(torch.autograd.Function):
    """A log density that was computed elsewhere, with its gradient."""

    @staticmethod
    def forward(ctx: Any, place: Tensor, value: float, gradient: Tensor) -> Tensor:
        del place
        ctx.save_for_backward(gradient)
        return gradient.new_tensor(value)

    @staticmethod
    def backward(ctx: Any, *outer: Tensor) -> tuple[Tensor, None, None]:
        (gradient,) = ctx.saved_tensors
        return outer[0] * gradient, None, None


def make(task: Task) -> Piece:
    """Make a piece of some chains."""
    gradients = 0

    def density_and_gradient(
        whitened: Float[np.ndarray, "chain dimension"],
    ) -> tuple[Float[np.ndarray, "chain"], Float[np.ndarray, "chain dimension"]]:
        nonlocal gradients
        gradients += len(whitened)
        return evaluate_with_gradient(lambda places: task.density(task.cloud.mapped(places)), whitened)

    sizes = [None] * len(task.places) if task.step_sizes is None else [float(size) for size in task.step_sizes]
    functions = [
        partial(_run, place, size, task.transitions, _walks(task, seed))
        for place, size, seed in zip(task.places, sizes, task.seeds, strict=True)
    ]
    with warnings.catch_warnings(), metered() as meter:
        warnings.simplefilter("ignore")
        made = in_lockstep(functions, task.seeds, density_and_gradient)
    whitened, found, diverged = zip(*made, strict=True)
    ends = [end for chain in diverged for end in chain]
    cliffs = _changes_of_course(task, ends)
    return Piece(np.stack(whitened), np.array(found), len(ends) - cliffs, cliffs, gradients, meter.rows)


_Leap = tuple[Float[np.ndarray, "dimension"], Float[np.ndarray, "dimension"]]
"""Where a divergent transition began and where it ended, in whitened coordinates."""


def _changes_of_course(task: Task, diverged: Sequence[_Leap]) -> int:
    """How many divergent transitions ended in another course of events than they began in."""
    if task.courses is None or not diverged:
        return 0
    begins, ends = (torch.from_numpy(task.cloud.points(np.stack(places))) for places in zip(*diverged, strict=True))
    return sum(one != other for one, other in zip(task.courses(begins), task.courses(ends), strict=True))


_Walk = Callable[[Float[np.ndarray, "dimension"], float, Ask], tuple[Float[np.ndarray, "dimension"], float]]
"""Where Metropolis steps before a transition end, from a place in whitened coordinates; both with their log density."""


def _walks(task: Task, seed: int) -> tuple[_Walk, ...]:
    """Those of a chain of a task."""
    found: list[_Walk] = []
    if task.rate_steps is not None:
        found.append(_Trading(task.rate_steps, task.cloud, np.random.default_rng([seed, 2])))
    if task.jumps is not None:
        found.append(_Jumping(task.jumps, task.cloud, np.random.default_rng([seed, 1])))
    return tuple(found)


@dataclass(frozen=True)
class _Trading:
    """Steps that trade one rate of slowing down against the others.

    Parameters
    ----------
    steps
        The steps.
    cloud
        Whitens the chain's coordinates.
    generator
        Source of randomness.
    """

    steps: RateSteps
    cloud: CurvedGaussian
    generator: np.random.Generator

    def __call__(
        self, place: Float[np.ndarray, "dimension"], value: float, ask: Ask
    ) -> tuple[Float[np.ndarray, "dimension"], float]:
        """Where they end, and the log density there."""
        for _ in range(TRIES):
            moved, volume = self.steps.moved(self.cloud.points(place[None]), self.generator)
            if not np.isfinite(volume[0]):
                continue
            proposed = self.cloud.whitened(moved)[0]
            there, _ = ask(proposed)
            if np.log(self.generator.random()) < there - value + volume[0]:
                value, place = there, proposed
        return place, value


@dataclass(frozen=True)
class _Jumping:
    """Steps whose proposals forget the place.

    Parameters
    ----------
    mixture
        Where proposals come from.
    cloud
        Whitens the chain's coordinates.
    generator
        Source of the proposals.
    """

    mixture: Mixture
    cloud: CurvedGaussian
    generator: np.random.Generator

    def __call__(
        self, place: Float[np.ndarray, "dimension"], value: float, ask: Ask
    ) -> tuple[Float[np.ndarray, "dimension"], float]:
        """Where they end, and the log density there."""
        points, _ = self.mixture.draws(TRIES, self.generator)
        proposed = self.cloud.whitened(points)
        ways = self.mixture.log_density(np.concatenate([self.cloud.points(place[None]), points]))
        here = 0
        for number, whitened in enumerate(proposed, start=1):
            there, _ = ask(whitened)
            if np.log(self.generator.random()) < there - value + ways[here] - ways[number]:
                value, place, here = there, whitened, number
        return place, value


def _run(
    place: Float[np.ndarray, "dimension"],
    step_size: float | None,
    transitions: int,
    walks: tuple[_Walk, ...],
    ask: Ask,
) -> tuple[Float[np.ndarray, "draw dimension"], float, list[_Leap]]:
    """Places and step size of one chain, and where its divergent transitions began and ended."""
    finding = step_size is None
    last = place

    def potential(parameters: dict[str, Tensor]) -> Tensor:
        nonlocal last
        there = parameters["whitened"]
        last = there.detach().numpy().copy()
        value, gradient = ask(last)
        # torch's stubs leave `apply` untyped
        answered: Tensor = _Answered.apply(there, value, torch.from_numpy(gradient))  # type: ignore[no-untyped-call]
        return -answered if np.isfinite(value) else OUT_OF_SUPPORT + 0.0 * there.sum()

    kernel = NUTS(
        potential_fn=potential,
        step_size=step_size or 1.0,
        adapt_step_size=finding,
        adapt_mass_matrix=False,
        full_mass=False,
        max_tree_depth=TREE_DEPTH,
        target_accept_prob=ACCEPTANCE,
    )
    parameters = {"whitened": torch.from_numpy(place.copy())}
    kernel.initial_params = parameters
    kernel.setup(warmup_steps=transitions if finding else 0)
    places: list[Float[np.ndarray, "dimension"]] = []
    diverged: list[_Leap] = []
    for _ in range(transitions):
        before = walked = parameters["whitened"].detach().numpy()
        value = ask(before)[0] if walks else 0.0
        for walk in walks:
            walked, value = walk(walked, value, ask)
        if walked is not before:
            parameters = {"whitened": torch.from_numpy(walked.copy())}
            kernel.clear_cache()
        parameters = kernel.sample(parameters)
        places.append(parameters["whitened"].detach().numpy().copy())
        # a transition ends with the leap that diverges
        if not finding and len(kernel.diagnostics()["divergences"]) > len(diverged):
            diverged.append((walked, last))
    return np.array(places), float(kernel.step_size), diverged

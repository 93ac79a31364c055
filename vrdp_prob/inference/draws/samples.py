"""What a sampler is given and what it hands back, and how far the result can be trusted."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from vrdp_prob.inference.draws.diagnostics import Reported, Statistics, chain_statistics
from vrdp_prob.inference.draws.triangles import lower_root
from vrdp_prob.spread import evenly_spread

R_HAT_GOAL = 1.01
ESS_GOAL = 400.0
PARETO_K_GOAL = 0.7
"""Above it importance weights have no usable variance (Vehtari et al., Pareto smoothed importance sampling, 2024)."""
DIVERGENT_GOAL = 0.01
"""Share of NUTS transitions that may diverge within a course of events; more mean a neck that is not explored."""


LogDensity = Callable[[Float[Tensor, "point dimension"]], Float[Tensor, "point"]]
"""Log density (nats, up to a constant) of a batch of points; differentiable, -inf where there is no support."""


@dataclass(frozen=True)
class Gaussian:
    """The Gaussian around the MAP that starts every sampler and whitens its coordinates.

    Parameters
    ----------
    mean
        The MAP.
    root
        Lower-triangular Cholesky factor of the covariance.
    """

    mean: Float[np.ndarray, "dimension"]
    root: Float[np.ndarray, "dimension dimension"]

    @classmethod
    def from_precision(
        cls, mean: Float[np.ndarray, "dimension"], precision: Float[np.ndarray, "dimension dimension"]
    ) -> "Gaussian":
        """The Gaussian with a given inverse covariance; directions without any curvature are held to variance 1e6."""
        scale = 1 / np.sqrt(np.maximum(np.diag(precision), 1e-12))
        values, vectors = np.linalg.eigh(scale[:, None] * precision * scale)
        return cls(mean, lower_root(scale[:, None] * vectors / np.sqrt(np.maximum(values, 1e-9))))

    @property
    def sd(self) -> Float[np.ndarray, "dimension"]:
        """Standard deviation of each coordinate."""
        return np.sqrt((self.root**2).sum(axis=1))

    def points(self, whitened: Float[np.ndarray, "*batch dimension"]) -> Float[np.ndarray, "*batch dimension"]:
        """Points that belong to whitened coordinates."""
        return self.mean + whitened @ self.root.T


@dataclass(frozen=True)
class ModeWeight:
    """Share of the posterior's mass in one mode.

    Parameters
    ----------
    weight
        The share.
    error
        Its Monte Carlo standard error.
    """

    weight: float
    error: float

    @property
    def effective(self) -> float:
        """Independent draws that would tell the weight as well."""
        spread = self.weight * (1 - self.weight)
        return spread / self.error**2 if self.error > 0 else float("inf")


@dataclass(frozen=True)
class Samples:
    """Draws of one sampler, all of equal weight.

    Parameters
    ----------
    points
        The draws.
    log_density
        Their log density.
    statistics
        More about each draw, by name.
    divergences
        Number of divergent transitions (NUTS), else None.
    cliffs
        Number of further transitions that ended where a contact comes or goes (NUTS), else None. The log density falls
        by thousands there within no distance, so what is behind has no mass, and nothing is left out.
    transitions
        Number of transitions that they are among; as many as there are draws where 0.
    pareto_k
        Pareto k-hat of the importance weights, else None.
    known
        What the draws are worth where the sampler knows it better than the chains tell, else None.
    r_hat
        Largest R-hat where the sampler knows it better than the chains tell, else None.
    evaluations, gradients
        Log densities computed, and how many of them with their gradient.
    work
        What the simulations had to do (see `work.py` of the simulator).
    modes
        Weights of the modes that the sampler set out from, in their order.
    notes
        Plain sentences: handed on to another sampler, stopped at a budget.
    doubts
        Plain sentences on what forbids to trust the draws though chains agree: modes that could not be weighted, or
        that no draw is in.
    ess_goal
        Effective draws that every reported quantity needs.
    sampler
        Name of the sampler that made the draws, where another one was asked for.
    """

    points: Float[np.ndarray, "chain draw dimension"]
    log_density: Float[np.ndarray, "chain draw"]
    statistics: Mapping[str, Float[np.ndarray, "chain draw"]] = field(default_factory=dict)
    divergences: int | None = None
    cliffs: int | None = None
    transitions: int = 0
    pareto_k: float | None = None
    known: Statistics | None = None
    r_hat: float | None = None
    evaluations: int = 0
    gradients: int = 0
    work: int = 0
    modes: tuple[ModeWeight, ...] = ()
    notes: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    ess_goal: float = ESS_GOAL
    sampler: str | None = None

    def thinned(self, draws: int) -> "Samples":
        """About `draws` draws, evenly spaced within the chains."""
        chains, length = self.points.shape[:2]
        per_chain = min(length, max(1, -(-draws // chains)))
        chosen = evenly_spread(per_chain, length)
        return replace(
            self,
            points=self.points[:, chosen],
            log_density=self.log_density[:, chosen],
            statistics={name: values[:, chosen] for name, values in self.statistics.items()},
        )


@dataclass(frozen=True)
class Convergence:
    """Whether the draws can be trusted, in numbers and in words: all that were made, of which a posterior keeps some.

    Parameters
    ----------
    sampler
        `nuts`, `emcee` or `laplace`: the one that made the draws.
    converged
        Whether every criterion that applies is met.
    r_hat
        Largest split R-hat over the reported quantities; None for importance sampling.
    ess_bulk
        Smallest bulk effective sample size over the reported quantities.
    divergences
        Divergent transitions (NUTS) but for those at `cliffs`, else None.
    pareto_k
        k-hat of the importance weights (laplace), else None.
    collision_order_changes
        Share of the draws whose sequence of collisions differs from the MAP's.
    ess_tail
        Smallest effective sample size of the 5 % and 95 % quantiles over the reported quantities.
    worst
        Name of the reported quantity that the draws tell least of.
    modes
        Weights of the modes, with their errors; empty where the sampler set out from one.
    notes
        Plain sentences on how the draws came about, and on what forbids to trust them though chains agree.
    ess_goal
        Effective sample size that every reported quantity needs.
    transitions
        Transitions that the divergences are among; 0 where they are not counted.
    cliffs
        Transitions that ended where a contact comes or goes, behind which there is no mass (NUTS), else None.
    """

    sampler: str
    converged: bool
    r_hat: float | None
    ess_bulk: float | None
    divergences: int | None
    pareto_k: float | None
    collision_order_changes: float | None = None
    ess_tail: float | None = None
    worst: str | None = None
    modes: tuple[ModeWeight, ...] = ()
    notes: tuple[str, ...] = ()
    ess_goal: float = ESS_GOAL
    transitions: int = 0
    cliffs: int | None = None

    @classmethod
    def of_document(cls, document: Mapping[str, Any]) -> "Convergence":
        """What `dataclasses.asdict` made a document of."""
        modes = tuple(ModeWeight(**mode) for mode in document.get("modes", ()))
        return cls(**{**document, "modes": modes, "notes": tuple(document.get("notes", ()))})

    @property
    def sentence(self) -> str:
        """The verdict in plain words, and how it came about."""
        facts = []
        if self.r_hat is not None:
            facts.append(f"R-hat {self.r_hat:.4f} (goal {R_HAT_GOAL:g} or less)")
        if self.ess_bulk is not None:
            tail = "" if self.ess_tail is None else f" and {self.ess_tail:.0f} in the tails"
            facts.append(f"effective sample size {self.ess_bulk:.0f}{tail} (goal {self.ess_goal:g})")
        if self.divergences is not None:
            among = f" in {self.transitions} transitions" if self.transitions else ""
            facts.append(f"{self.divergences} divergences{among} (goal 1 % or less)")
        if self.cliffs:
            facts.append(f"{self.cliffs} more where a contact comes or goes (which is no fault)")
        if self.pareto_k is not None:
            facts.append(f"Pareto k {self.pareto_k:.2f} (goal {PARETO_K_GOAL:g} or less)")
        verdict = "has converged" if self.converged else "has not converged, so take its intervals with care"
        weakest = "" if self.converged or self.worst is None else f" The weakest is {self.worst}."
        story = "".join(f" {note}" for note in self.notes)
        return f"The {self.sampler} sampler {verdict}: {', '.join(facts)}.{weakest}{story}"


def assess(
    sampler: str, samples: Samples, reported: Reported | None = None, *, order_changes: float | None = None
) -> Convergence:
    """Judge the draws of a sampler by R-hat, effective sample sizes, divergences and Pareto k.

    Parameters
    ----------
    sampler
        Name of the sampler that was asked for.
    samples
        What it handed back.
    reported
        The quantities to look at; the coordinates where None.
    order_changes
        Share of the draws whose sequence of collisions differs from the MAP's.
    """
    found = samples.known or chain_statistics(samples.points, reported)
    weighted = samples.pareto_k is not None
    r_hat = max(found.r_hat, samples.r_hat or 0.0)
    enough = min(found.ess_bulk, found.ess_tail) >= samples.ess_goal
    trusted = samples.pareto_k <= PARETO_K_GOAL if samples.pareto_k is not None else r_hat <= R_HAT_GOAL
    few = (samples.divergences or 0) <= DIVERGENT_GOAL * (samples.transitions or samples.log_density.size)
    return Convergence(
        sampler=samples.sampler or sampler,
        converged=bool(trusted and enough and few and not samples.doubts),
        r_hat=None if weighted else r_hat,
        ess_bulk=found.ess_bulk,
        divergences=samples.divergences,
        cliffs=samples.cliffs,
        pareto_k=samples.pareto_k,
        collision_order_changes=order_changes,
        ess_tail=found.ess_tail,
        worst=found.worst,
        modes=samples.modes,
        notes=(*samples.notes, *samples.doubts),
        ess_goal=samples.ess_goal,
        transitions=samples.transitions,
    )


def evaluate(density: LogDensity, points: Float[np.ndarray, "point dimension"]) -> Float[np.ndarray, "point"]:
    """Log density of a batch without gradient; what is not a number counts as -inf."""
    with torch.no_grad():
        values: np.ndarray = density(torch.from_numpy(np.ascontiguousarray(points))).numpy()
    return np.where(np.isnan(values), -np.inf, values)


def evaluate_with_gradient(
    density: LogDensity, points: Float[np.ndarray, "point dimension"]
) -> tuple[Float[np.ndarray, "point"], Float[np.ndarray, "point dimension"]]:
    """Log density of a batch and its gradient; -inf and 0 where there is no support."""
    places = torch.from_numpy(np.ascontiguousarray(points)).requires_grad_()
    values = density(places)
    (gradient,) = torch.autograd.grad(values.sum(), places)
    numbers: np.ndarray = values.detach().numpy()
    supported = np.isfinite(numbers)
    return np.where(supported, numbers, -np.inf), np.where(supported[:, None], np.nan_to_num(gradient.numpy()), 0.0)

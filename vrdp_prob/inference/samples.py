"""What a sampler is given and what it hands back, and how far the result can be trusted."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import torch
from arviz_stats.base.array import array_stats
from jaxtyping import Float
from torch import Tensor

R_HAT_GOAL = 1.01
ESS_GOAL = 400.0
PARETO_K_GOAL = 0.7
"""Above it importance weights have no usable variance (Vehtari et al., Pareto smoothed importance sampling, 2024)."""


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
        covariance = (vectors / np.maximum(values, 1e-9)) @ vectors.T
        root = np.linalg.cholesky((scale[:, None] * covariance * scale) + 1e-15 * np.diag(scale**2))
        return cls(mean, root)

    @property
    def sd(self) -> Float[np.ndarray, "dimension"]:
        """Standard deviation of each coordinate."""
        return np.sqrt((self.root**2).sum(axis=1))

    def points(self, whitened: Float[np.ndarray, "*batch dimension"]) -> Float[np.ndarray, "*batch dimension"]:
        """Points that belong to whitened coordinates."""
        return self.mean + whitened @ self.root.T


@dataclass(frozen=True)
class Samples:
    """Draws of one sampler.

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
    pareto_k
        Pareto k-hat of the importance weights, else None.
    effective
        Effective number of draws where the sampler knows it better than the chains tell, else None.
    r_hat
        Largest R-hat where the sampler knows it better than the chains tell, else None.
    evaluations, gradients
        Log densities computed, and how many of them with their gradient.
    """

    points: Float[np.ndarray, "chain draw dimension"]
    log_density: Float[np.ndarray, "chain draw"]
    statistics: Mapping[str, Float[np.ndarray, "chain draw"]] = field(default_factory=dict)
    divergences: int | None = None
    pareto_k: float | None = None
    effective: float | None = None
    r_hat: float | None = None
    evaluations: int = 0
    gradients: int = 0

    def thinned(self, draws: int) -> "Samples":
        """About `draws` draws, evenly spaced within the chains."""
        chains, length = self.points.shape[:2]
        per_chain = min(length, max(1, -(-draws // chains)))
        chosen = np.linspace(0, length - 1, per_chain).round().astype(int)
        return replace(
            self,
            points=self.points[:, chosen],
            log_density=self.log_density[:, chosen],
            statistics={name: values[:, chosen] for name, values in self.statistics.items()},
        )


@dataclass(frozen=True)
class Convergence:
    """Whether the draws can be trusted, in numbers and in words.

    Parameters
    ----------
    sampler
        `nuts`, `emcee` or `laplace`.
    converged
        Whether every criterion that applies is met.
    r_hat
        Largest split R-hat over the sampled coordinates; None for importance sampling.
    ess_bulk
        Smallest bulk effective sample size; for importance sampling that of the weights.
    divergences
        Divergent transitions (NUTS), else None.
    pareto_k
        k-hat of the importance weights (laplace), else None.
    collision_order_changes
        Share of the draws whose sequence of collisions differs from the MAP's.
    """

    sampler: str
    converged: bool
    r_hat: float | None
    ess_bulk: float | None
    divergences: int | None
    pareto_k: float | None
    collision_order_changes: float | None = None

    @property
    def sentence(self) -> str:
        """The verdict in plain words."""
        facts = []
        if self.r_hat is not None:
            facts.append(f"R-hat {self.r_hat:.3f} (goal {R_HAT_GOAL:g} or less)")
        if self.ess_bulk is not None:
            facts.append(f"effective sample size {self.ess_bulk:.0f}")
        if self.divergences is not None:
            facts.append(f"{self.divergences} divergences")
        if self.pareto_k is not None:
            facts.append(f"Pareto k {self.pareto_k:.2f} (goal {PARETO_K_GOAL:g} or less)")
        verdict = "has converged" if self.converged else "has not converged, so take its intervals with care"
        return f"The {self.sampler} sampler {verdict}: {', '.join(facts)}."


def assess(sampler: str, samples: Samples, *, order_changes: float | None = None) -> Convergence:
    """Judge the draws of a sampler by R-hat, bulk effective sample size, divergences and Pareto k."""
    if samples.pareto_k is not None:
        ess = samples.effective
        converged = samples.pareto_k <= PARETO_K_GOAL and (ess or 0) >= min(ESS_GOAL, samples.points.shape[1] / 10)
        return Convergence(sampler, converged, None, ess, None, samples.pareto_k, order_changes)
    r_hat, ess_bulk = chain_statistics(samples.points)
    r_hat = max(r_hat, samples.r_hat or 0.0)
    converged = r_hat <= R_HAT_GOAL and ess_bulk >= ESS_GOAL and not samples.divergences
    return Convergence(sampler, converged, r_hat, ess_bulk, samples.divergences, None, order_changes)


def chain_statistics(points: Float[np.ndarray, "chain draw dimension"]) -> tuple[float, float]:
    """Largest R-hat and smallest bulk effective sample size over the coordinates (infinite and 0 where undefined)."""
    by_coordinate = np.moveaxis(points, -1, 0)
    with np.errstate(all="ignore"):
        r_hat = np.asarray(array_stats.rhat(by_coordinate), dtype=float)
        ess = np.asarray(array_stats.ess(by_coordinate, method="bulk"), dtype=float)
    return float(np.nan_to_num(r_hat, nan=np.inf).max()), float(np.nan_to_num(ess, nan=0.0).min())


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

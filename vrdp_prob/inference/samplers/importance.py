"""Importance weights: smoothed, judged, flattened, and turned into draws of equal weight.

Source: Vehtari, Simpson, Gelman, Yao and Gabry, Pareto smoothed importance sampling, JMLR 25 (2024).
"""

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from arviz_stats.base.array import array_stats
from jaxtyping import Float, Int

from vrdp_prob.inference.draws.samples import LogDensity, evaluate
from vrdp_prob.inference.samplers.mixture import Mixture
from vrdp_prob.models.simulator.work import metered, record_work
from vrdp_prob.progress import Advance

ALIKE = 2.0
"""Largest weight, in units of the mean one, up to which weights have no tail whose shape would mean anything."""
BATCH = 500
THREADS = 2
"""Batches that are simulated at once, where there are as many cores."""


@dataclass(frozen=True)
class Weighted:
    """Points of a proposal with the density that they were to have.

    Parameters
    ----------
    points
        The points.
    log_density
        Log of the density that is wanted.
    log_ratio
        Log of that over the density of the proposal.
    """

    points: Float[np.ndarray, "draw dimension"]
    log_density: Float[np.ndarray, "draw"]
    log_ratio: Float[np.ndarray, "draw"]

    @classmethod
    def drawn(
        cls, density: LogDensity, proposal: Mixture, count: int, generator: np.random.Generator, advance: Advance
    ) -> "Weighted":
        """So many points of a mixture."""
        points, _ = proposal.draws(count, generator)
        log_density = evaluated_in_batches(density, points, advance)
        return cls(points, log_density, log_density - proposal.log_density(points))

    def joined(self, other: "Weighted") -> "Weighted":
        """The points of both, which come from one proposal."""
        return Weighted(
            np.concatenate([self.points, other.points]),
            np.concatenate([self.log_density, other.log_density]),
            np.concatenate([self.log_ratio, other.log_ratio]),
        )


def evaluated_in_batches(
    density: LogDensity, points: Float[np.ndarray, "point dimension"], advance: Advance
) -> Float[np.ndarray, "point"]:
    """Log density of many points, batches of them side by side."""

    def evaluated(begin: int) -> tuple[Float[np.ndarray, "point"], int]:
        with metered() as meter:  # the meter of the calling thread is not that of this one
            values = evaluate(density, points[begin : begin + BATCH])
        return values, meter.rows

    found = []
    with ThreadPoolExecutor(min(THREADS, os.cpu_count() or 1)) as threads:
        for values, rows in threads.map(evaluated, range(0, len(points), BATCH)):
            record_work(rows)
            advance(len(values))
            found.append(values)
    return np.concatenate(found)


def smoothed_weights(log_ratio: Float[np.ndarray, "draw"]) -> tuple[Float[np.ndarray, "draw"], float]:
    """Normalised importance weights with a generalised-Pareto tail, and k-hat (infinite where nothing was hit)."""
    finite = np.isfinite(log_ratio)
    weights = np.zeros(len(log_ratio))
    if finite.sum() < 2:
        weights[int(np.argmax(np.where(finite, log_ratio, -np.inf)))] = 1.0
        return weights, float("inf")
    with np.errstate(all="ignore"):
        smoothed, k_hat = array_stats.psislw(log_ratio[finite].max() - log_ratio[finite])  # it takes negative ratios
    smoothed = np.exp(smoothed - smoothed.max())
    weights[finite] = smoothed / smoothed.sum()
    if weights.max() <= ALIKE / len(weights):
        return weights, min(float(np.nan_to_num(k_hat)), 0.0)
    return weights, float(np.nan_to_num(k_hat, nan=np.inf))


def effective_count(weights: Float[np.ndarray, "draw"]) -> float:
    """Number of equally weighted draws that are worth as much."""
    return float(1 / np.sum(weights**2))


def flattened(log_ratio: Float[np.ndarray, "draw"], effective: float) -> Float[np.ndarray, "draw"]:
    """Weights to the largest power up to 1 that leaves so many effective draws."""
    shifted = np.where(np.isfinite(log_ratio), log_ratio, -np.inf) - log_ratio.max()

    def weights(power: float) -> Float[np.ndarray, "draw"]:
        values = np.where(np.isfinite(shifted), np.exp(power * np.maximum(shifted, -1e6)), 0.0)
        return values / values.sum()

    if effective_count(weights(1.0)) >= effective:
        return weights(1.0)
    low, high = 0.0, 1.0
    for _ in range(30):
        middle = (low + high) / 2
        low, high = (middle, high) if effective_count(weights(middle)) >= effective else (low, middle)
    return weights(low)


def resampled(
    weights: Float[np.ndarray, "draw"], count: int, generator: np.random.Generator
) -> Int[np.ndarray, "count"]:
    """Numbers of draws by systematic resampling, shuffled."""
    places = (generator.random() + np.arange(count)) / count
    chosen = np.searchsorted(np.cumsum(weights), places).clip(max=len(weights) - 1)
    return np.asarray(generator.permutation(chosen))

"""The fast way: draws from a Gaussian or Student-t around the MAP, corrected by Pareto-smoothed importance sampling.

Source: Vehtari, Simpson, Gelman, Yao and Gabry, Pareto smoothed importance sampling, JMLR 25 (2024).
"""

import numpy as np
from arviz_stats.base import array_stats
from jaxtyping import Float
from scipy.special import gammaln

from vrdp_prob.inference.samples import Gaussian, LogDensity, Samples, evaluate
from vrdp_prob.progress import ProgressDisplay, SilentProgress

DEGREES_OF_FREEDOM = 20.0
"""The proposal's tails: heavier than Gaussian, light enough to lose little in 40 dimensions."""
OVERSAMPLING = 4
"""Proposals per draw that is handed back."""
BATCH = 500


def sample_laplace(
    density: LogDensity,
    start: Gaussian,
    *,
    draws: int,
    generator: np.random.Generator,
    progress: ProgressDisplay | None = None,
) -> Samples:
    """Draw by importance sampling around the MAP.

    Parameters
    ----------
    density
        The log posterior.
    start
        Gaussian around the MAP.
    draws
        Number of draws to hand back, resampled by their smoothed weights.
    generator
        Source of randomness.
    progress
        Told how many proposals were evaluated.

    Returns
    -------
    One chain of draws, with Pareto k-hat and the effective number of proposals.
    """
    count = OVERSAMPLING * draws
    whitened, log_proposal = _proposals(start, count, generator)
    points = start.points(whitened)
    log_density = np.empty(count)
    with (progress or SilentProgress()).stage("Importance sampling", total=count) as advance:
        for begin in range(0, count, BATCH):
            chosen = slice(begin, min(begin + BATCH, count))
            log_density[chosen] = evaluate(density, points[chosen])
            advance(chosen.stop - chosen.start)
    weights, pareto_k = smoothed_weights(log_density - log_proposal)
    chosen_draws = _resample(weights, draws, generator)
    statistics = {"log_weight": np.log(np.maximum(weights[chosen_draws], 1e-300))[None]}
    effective = float(1 / np.sum(weights**2))
    return Samples(
        points[chosen_draws][None],
        log_density[chosen_draws][None],
        statistics,
        pareto_k=pareto_k,
        effective=effective,
        evaluations=count,
    )


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
    return weights, float(np.nan_to_num(k_hat, nan=np.inf))


def _proposals(
    start: Gaussian, count: int, generator: np.random.Generator
) -> tuple[Float[np.ndarray, "draw dimension"], Float[np.ndarray, "draw"]]:
    """Multivariate Student-t points in whitened coordinates with their log density up to a constant."""
    dimension = len(start.mean)
    normal = generator.standard_normal((count, dimension))
    chi_square = generator.chisquare(DEGREES_OF_FREEDOM, size=count) / DEGREES_OF_FREEDOM
    whitened = normal / np.sqrt(chi_square)[:, None]
    constant = gammaln((DEGREES_OF_FREEDOM + dimension) / 2) - gammaln(DEGREES_OF_FREEDOM / 2)
    constant -= dimension / 2 * np.log(DEGREES_OF_FREEDOM * np.pi) + np.log(np.diag(start.root)).sum()
    shape = np.log1p((whitened**2).sum(axis=1) / DEGREES_OF_FREEDOM)
    return whitened, constant - (DEGREES_OF_FREEDOM + dimension) / 2 * shape


def _resample(
    weights: Float[np.ndarray, "draw"], count: int, generator: np.random.Generator
) -> np.ndarray:
    """Systematic resampling, shuffled."""
    places = (generator.random() + np.arange(count)) / count
    chosen = np.searchsorted(np.cumsum(weights), places).clip(max=len(weights) - 1)
    return generator.permutation(chosen)

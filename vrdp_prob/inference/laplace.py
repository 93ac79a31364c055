"""The fast way: draws from a Gaussian or Student-t around the MAP, corrected by Pareto-smoothed importance sampling.

Source: Vehtari, Simpson, Gelman, Yao and Gabry, Pareto smoothed importance sampling, JMLR 25 (2024).
"""

import numpy as np
from arviz_stats.base.array import array_stats
from jaxtyping import Float
from scipy.special import gammaln

from vrdp_prob.inference.curved_gaussian import CurvedGaussian
from vrdp_prob.inference.mixture import Mixture
from vrdp_prob.inference.samples import LogDensity, Samples, evaluate
from vrdp_prob.progress import Advance, ProgressDisplay, SilentProgress

DEGREES_OF_FREEDOM = 30.0
"""The proposal's tails: heavier than Gaussian, light enough to lose little in 40 dimensions."""
OVERSAMPLING = 4
"""Proposals per draw that is handed back."""
ROUNDS = 2
"""At most so many times the proposal is moved and shaped towards what its weighted draws show."""
ROUND_DRAWS = 1500
EFFECTIVE_PER_DIMENSION = 6.0
"""Weights are flattened until so many effective draws per dimension shape the next proposal."""
GOOD_ENOUGH = 0.1
"""Effective share of the draws from which on the proposal is left as it is."""
FEWEST = 100.0
"""Where the weights leave fewer effective draws than this they are flattened, so that the draws at least spread; Pareto
k then says that they are not to be trusted."""
BATCH = 500
NEAR_THE_MEAN = 0.01
"""Scale of the starting places where hardly any has support."""


def sample_laplace(
    density: LogDensity,
    start: Mixture,
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
        What is known of the posterior.
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
    with (progress or SilentProgress()).stage("Importance sampling", total=count + ROUNDS * ROUND_DRAWS) as advance:
        proposal, evaluations = adapted(density, start.components[0], generator, advance)
        whitened, log_density, log_ratio = _weighted(density, proposal, count, generator, advance)
    weights, pareto_k = smoothed_weights(log_ratio)
    effective = effective_count(weights)
    if effective < FEWEST:
        weights = _flattened(log_ratio, FEWEST)
    chosen_draws = _resample(weights, draws, generator)
    statistics = {"log_weight": np.log(np.maximum(weights[chosen_draws], 1e-300))[None]}
    return Samples(
        proposal.points(whitened[chosen_draws])[None],
        log_density[chosen_draws][None],
        statistics,
        pareto_k=pareto_k,
        effective=effective,
        evaluations=count + evaluations,
    )


def adapted(
    density: LogDensity, start: CurvedGaussian, generator: np.random.Generator, advance: Advance
) -> tuple[CurvedGaussian, int]:
    """Move and shape a Gaussian towards the density by weighted draws (population Monte Carlo).

    Source: Cappe, Douc, Guillin, Marin and Robert, Adaptive importance sampling in general mixture classes,
    Statistics and Computing 18 (2008).
    """
    gaussian, evaluations = start, 0
    dimension = start.dimension
    for _ in range(ROUNDS):
        whitened, _, log_ratio = _weighted(density, gaussian, ROUND_DRAWS, generator, advance)
        evaluations += ROUND_DRAWS
        weights, _ = smoothed_weights(log_ratio)
        if effective_count(weights) > GOOD_ENOUGH * ROUND_DRAWS:
            break
        weights = _flattened(log_ratio, EFFECTIVE_PER_DIMENSION * dimension)
        mean = weights @ whitened
        centred = whitened - mean
        covariance = (centred * weights[:, None]).T @ centred
        share = min(1.0, effective_count(weights) / (2 * EFFECTIVE_PER_DIMENSION * dimension))
        gaussian = gaussian.moved(mean, share * covariance + (1 - share) * np.eye(dimension))
    return gaussian, evaluations


def starting_places(
    density: LogDensity, start: CurvedGaussian, count: int, pool_size: int, generator: np.random.Generator
) -> Float[np.ndarray, "count dimension"]:
    """Different whitened points with support for chains to set out from, drawn by importance from a pool.

    Near the mean where the pool has too few with support.
    """
    pool = generator.standard_normal((pool_size, start.dimension))
    values = evaluate(density, start.points(pool))
    supported = np.flatnonzero(np.isfinite(values))
    if len(supported) < count:
        return NEAR_THE_MEAN * pool[:count]
    weights, _ = smoothed_weights(values + (pool**2).sum(axis=1) / 2)
    flattened = weights[supported] ** 0.5 + 1e-12
    return pool[generator.choice(supported, size=count, replace=False, p=flattened / flattened.sum())]


def tail_log_density(whitened: Float[np.ndarray, "draw dimension"]) -> Float[np.ndarray, "draw"]:
    """Log density of the multivariate Student-t of the proposals, up to a constant."""
    power = (DEGREES_OF_FREEDOM + whitened.shape[1]) / 2
    return np.asarray(-power * np.log1p((whitened**2).sum(axis=1) / DEGREES_OF_FREEDOM))


def effective_count(weights: Float[np.ndarray, "draw"]) -> float:
    """Number of equally weighted draws that are worth as much."""
    return float(1 / np.sum(weights**2))


def _weighted(
    density: LogDensity, proposal: CurvedGaussian, count: int, generator: np.random.Generator, advance: Advance
) -> tuple[Float[np.ndarray, "draw dimension"], Float[np.ndarray, "draw"], Float[np.ndarray, "draw"]]:
    """Whitened points of a proposal, their log density and the log of density over proposal."""
    whitened, log_proposal = _proposals(proposal, count, generator)
    points = proposal.points(whitened)
    log_density = np.empty(count)
    for begin in range(0, count, BATCH):
        chosen = slice(begin, min(begin + BATCH, count))
        log_density[chosen] = evaluate(density, points[chosen])
        advance(chosen.stop - chosen.start)
    return whitened, log_density, log_density - log_proposal


def _flattened(log_ratio: Float[np.ndarray, "draw"], effective: float) -> Float[np.ndarray, "draw"]:
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
    start: CurvedGaussian, count: int, generator: np.random.Generator
) -> tuple[Float[np.ndarray, "draw dimension"], Float[np.ndarray, "draw"]]:
    """Multivariate Student-t points in whitened coordinates with their log density up to a constant."""
    dimension = start.dimension
    normal = generator.standard_normal((count, dimension))
    chi_square = generator.chisquare(DEGREES_OF_FREEDOM, size=count) / DEGREES_OF_FREEDOM
    whitened = normal / np.sqrt(chi_square)[:, None]
    constant = gammaln((DEGREES_OF_FREEDOM + dimension) / 2) - gammaln(DEGREES_OF_FREEDOM / 2)
    constant -= dimension / 2 * np.log(DEGREES_OF_FREEDOM * np.pi) + start.log_volume
    return whitened, constant + tail_log_density(whitened)


def _resample(weights: Float[np.ndarray, "draw"], count: int, generator: np.random.Generator) -> np.ndarray:
    """Systematic resampling, shuffled."""
    places = (generator.random() + np.arange(count)) / count
    chosen = np.searchsorted(np.cumsum(weights), places).clip(max=len(weights) - 1)
    return generator.permutation(chosen)

"""The fast way: draws of the Gaussian of the joint fit, corrected by importance weights in two steps.

For each draw of the shared numbers every video tries a few own ones; the mean of their weights estimates, without bias,
how probable the video is for these shared numbers. So the product over videos weighs the draw of the shared numbers
correctly, and one of the tries, chosen by weight, goes with it. Source: Tran, Scharth, Pitt and Kohn, Importance
sampling squared for Bayesian inference in latent variable models, arXiv 1309.3339 (2013).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.special import gammaln, logsumexp

from vrdp_prob.inference.samplers.importance import effective_count, flattened, resampled, smoothed_weights
from vrdp_prob.inference.search.prior_mass import log_prior_constant
from vrdp_prob.inference.several_videos.arrow import ArrowGaussian
from vrdp_prob.inference.several_videos.clouds import Clouds
from vrdp_prob.inference.several_videos.joint_fit import JointFit
from vrdp_prob.inference.several_videos.linking import LinkedVideo
from vrdp_prob.inference.several_videos.shared_ridge import SharedRidge
from vrdp_prob.inference.several_videos.slice_steps import (
    DEGREES_OF_FREEDOM,
    reference_draws,
    reference_log_density,
)
from vrdp_prob.progress import ProgressDisplay, SilentProgress

TRIES = 8
"""Own numbers that each video tries per draw of the shared ones."""
OVERSAMPLING = 2
"""Draws of the shared numbers per draw that is handed back."""
FEWEST = 100.0
"""Effective draws below which weights are flattened, so that the draws at least spread."""
BATCH = 500


@dataclass(frozen=True)
class WeightedLocals:
    """Own numbers of a video, one set per draw of the shared numbers.

    Parameters
    ----------
    points
        Own numbers.
    log_density
        Log density of the tracks and of these numbers, given the shared ones.
    log_evidence
        Estimated log probability (nats) of the tracks given the shared numbers, the constants of the priors included
        but not those of the tracks.
    """

    points: Float[np.ndarray, "draw local"]
    log_density: Float[np.ndarray, "draw"]
    log_evidence: Float[np.ndarray, "draw"]


@dataclass(frozen=True)
class WeightedDraws:
    """Draws of the joint posterior by importance sampling.

    Parameters
    ----------
    shared
        Shared numbers.
    locals
        Own numbers of each video, in the same order.
    log_density
        Log density of each video given the shared numbers.
    pareto_k
        Pareto k of the weights.
    effective
        Number of equally weighted draws that the weighted ones are worth.
    log_evidence
        Log probability (nats) of all tracks, up to a constant of the tracks.
    """

    shared: Float[np.ndarray, "draw shared"]
    locals: tuple[Float[np.ndarray, "draw _"], ...]
    log_density: tuple[Float[np.ndarray, "draw"], ...]
    pareto_k: float
    effective: float
    log_evidence: float


def sample_by_importance(
    fit: JointFit, *, draws: int, generator: np.random.Generator, progress: ProgressDisplay | None = None
) -> WeightedDraws:
    """Draw shared numbers from the Gaussian of a fit and weigh them by what every video says."""
    count, dimension = OVERSAMPLING * draws, len(fit.numbers)
    places = reference_draws(count, dimension, generator)
    clouds = [Clouds.of_fit(fit, index, generator) for index in range(len(fit.videos))]
    whitened, log_volume = SharedRidge.of(fit, clouds, generator).whitened(places)
    shared = fit.gaussian.shared_points(whitened)
    log_ratio = fit.numbers.log_prior(shared) + log_volume - reference_log_density(places)
    found = []
    with (progress or SilentProgress()).stage("Importance sampling", total=len(fit.videos)) as advance:
        for video, around in zip(fit.videos, clouds, strict=True):
            found.append(weighted_locals(video, around, fit.gaussian, whitened, generator))
            log_ratio = log_ratio + found[-1].log_evidence
            advance(1)
    weights, pareto_k = smoothed_weights(log_ratio)
    effective = effective_count(weights)
    if effective < (fewest := min(FEWEST, count / 2)):
        weights = flattened(log_ratio, fewest)
    chosen = resampled(weights, draws, generator)
    volume = float(np.log(np.diag(fit.gaussian.root)).sum())
    constant = log_prior_constant(fit.numbers.entries) + volume - _log_constant(dimension)
    return WeightedDraws(
        shared[chosen],
        tuple(one.points[chosen] for one in found),
        tuple(one.log_density[chosen] for one in found),
        pareto_k,
        effective,
        float(logsumexp(log_ratio)) - np.log(count) + constant,
    )


def weighted_locals(
    video: LinkedVideo,
    clouds: Clouds,
    arrow: ArrowGaussian,
    shared: Float[np.ndarray, "draw shared"],
    generator: np.random.Generator,
    *,
    tries: int = TRIES,
) -> WeightedLocals:
    """Own numbers of a video for draws of the whitened shared numbers, with the evidence that they estimate."""
    count = len(shared)
    repeated = np.repeat(shared, tries, axis=0)
    points, _ = clouds.draws(repeated, generator)
    log_density = np.concatenate(
        [
            video.log_density(arrow.shared_points(repeated[begin : begin + BATCH]), points[begin : begin + BATCH])
            for begin in range(0, len(points), BATCH)
        ]
    )
    log_weight = (log_density - clouds.log_density(points, repeated)).reshape(count, tries)
    entries = video.likelihood.coordinates.entries
    own_prior = log_prior_constant(entries[place] for place in video.local_places)
    noise = generator.gumbel(size=log_weight.shape)
    chosen = np.arange(count) * tries + np.argmax(np.where(np.isfinite(log_weight), log_weight, -1e300) + noise, axis=1)
    with np.errstate(divide="ignore"):
        log_evidence = logsumexp(log_weight, axis=1) - np.log(tries) + own_prior
    return WeightedLocals(points[chosen], log_density[chosen], log_evidence)


def _log_constant(dimension: int) -> float:
    """Log of the constant of the reference's density."""
    degrees = DEGREES_OF_FREEDOM
    value = gammaln((degrees + dimension) / 2) - gammaln(degrees / 2) - dimension / 2 * np.log(degrees * np.pi)
    return float(value)

"""How probable a video is that the posterior has not seen: the measure by which models are compared."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.special import logsumexp

from vrdp_prob.errors import InputError
from vrdp_prob.inference.draws.samples import PARETO_K_GOAL
from vrdp_prob.inference.map_fit import fit_map
from vrdp_prob.inference.samplers.importance import effective_count, resampled, smoothed_weights
from vrdp_prob.inference.search.clues import Clues
from vrdp_prob.inference.several_videos.arrow import ArrowGaussian
from vrdp_prob.inference.several_videos.clouds import Clouds
from vrdp_prob.inference.several_videos.importance import weighted_locals
from vrdp_prob.inference.several_videos.joint_fit import local_modes
from vrdp_prob.inference.several_videos.linking import linked
from vrdp_prob.inference.several_videos.parts import plain_likelihood, stream
from vrdp_prob.inference.several_videos.posterior import SharedPosterior
from vrdp_prob.models.unknowns import structure_of
from vrdp_prob.progress import ProgressDisplay
from vrdp_prob.scene import Tracks

DRAWS = 400
"""Draws of the shared numbers for which the video's own numbers are integrated out."""
TRIES = 16
FLATTENED = 0.5
"""Power of the guessed evidence by which draws of the shared numbers are chosen; below 1, since it is a guess."""
BATCH = 500


@dataclass(frozen=True)
class PredictiveDensity:
    """Log probability density of the tracks of a video, given the tracks of others.

    Parameters
    ----------
    log_density
        In nats, up to a constant of the tracks: only differences between models mean something.
    error
        Its Monte Carlo standard error in nats.
    pareto_k
        Pareto k of the importance weights.
    """

    log_density: float
    error: float
    pareto_k: float

    @property
    def trusted(self) -> bool:
        """Whether the error can be believed."""
        return self.pareto_k <= PARETO_K_GOAL


def predictive_log_density(
    posterior: SharedPosterior, tracks: Tracks, *, seed: int = 0, progress: ProgressDisplay | None = None
) -> PredictiveDensity:
    """How probable the tracks of a new video are, given what other videos say of the shared parameters.

    The video's own motion, masses and restitutions are integrated out by importance sampling around its fit, for draws
    of the shared parameters. A model error is left out on purpose, since it would make up for what the model lacks.

    Parameters
    ----------
    posterior
        What the other videos say.
    tracks
        The new video.
    seed
        Seed of all randomness.
    progress
        Told how far the work is.

    Raises
    ------
    InputError
        If no object moves, or the video has no world at what the other ones say.
    """
    generator = stream(seed, tracks.video)
    family = Clues.of(tracks).noise_family  # not by the fit: models are compared, so they believe in one noise
    fit = fit_map(tracks, posterior.model, generator, progress, noise=family)
    structure = structure_of(fit.likelihood.coordinates)
    video = linked(plain_likelihood(fit.clues, posterior.model, structure), posterior.numbers)
    chains, length, count = posterior.points.shape
    draws = posterior.points.reshape(chains * length, count)
    mean, root = draws.mean(axis=0), _root(draws)
    source, target = fit.likelihood.coordinates, video.likelihood.coordinates
    starts = np.array([video.split(source.carried(one.point, target))[1] for one in fit.modes])
    modes = local_modes(video, posterior.numbers, mean, starts)
    if not modes:
        raise InputError(
            f"{tracks.video}: cannot be simulated with what the other videos say of the numbers that all share; "
            "leave it out."
        )
    arrow = ArrowGaussian(mean, root, (modes[0].gaussian,), posterior.numbers.logarithms)
    clouds = Clouds.of(video, arrow, modes, generator)
    whitened = arrow.shared_whitened(draws)
    centres = clouds.centres(whitened)
    guesses = np.concatenate(
        [
            video.log_density(draws[begin : begin + BATCH], centres[begin : begin + BATCH])
            for begin in range(0, len(draws), BATCH)
        ]
    )
    log_chance = FLATTENED * np.where(np.isfinite(guesses), guesses - guesses.max(), -1e3)
    log_chance -= logsumexp(log_chance)
    chosen = resampled(np.exp(log_chance), DRAWS, generator)
    found = weighted_locals(video, clouds, arrow, whitened[chosen], generator, tries=TRIES)
    log_weight = found.log_evidence - log_chance[chosen] - np.log(len(draws))
    weights, pareto_k = smoothed_weights(log_weight)
    among_draws = np.exp(2 * log_chance / FLATTENED - 2 * logsumexp(log_chance / FLATTENED)).sum() * len(draws) - 1
    independent = posterior.convergence.ess_bulk or len(draws)
    variance = max(1 / effective_count(weights) - 1 / len(weights), 0.0) + among_draws / independent
    log_density = float(logsumexp(log_weight)) - float(np.log(len(log_weight)))
    return PredictiveDensity(log_density, float(np.sqrt(variance)), pareto_k)


def _root(draws: Float[np.ndarray, "draw shared"]) -> Float[np.ndarray, "shared shared"]:
    """Cholesky factor of the covariance of draws."""
    if not draws.shape[1]:
        return np.zeros((0, 0))
    covariance = np.atleast_2d(np.cov(draws, rowvar=False))
    root: np.ndarray = np.linalg.cholesky(covariance + np.diag(1e-9 * np.diag(covariance) + 1e-16))
    return root

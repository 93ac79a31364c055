"""Measurements drawn anew: what cameras would have seen in the worlds of some draws, their noise included."""

import numpy as np
from jaxtyping import Float
from torch import Tensor

from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.model_error import straying
from vrdp_prob.models.noise import NoiseFamily
from vrdp_prob.models.unknowns import DEGREES_OF_FREEDOM, NOISE

SMALLEST = 1e-10
"""Share of the variance that keeps covariances positive."""


def replicated(
    likelihood: Likelihood, points: Float[Tensor, "point dimension"], generator: np.random.Generator
) -> Float[np.ndarray, "point time body 2"]:
    """Positions (m) that would be measured in the worlds of some points.

    Parameters
    ----------
    likelihood
        The density, which knows how noise is spread, and how far the model may be off.
    points
        The worlds.
    generator
        Draws the noise and the error of the model. Where a position was seen, noise has that position's covariance, in
        gaps the one in the middle.

    Returns
    -------
    A position in every frame from the release on, NaN before.
    """
    quantities, tracks = likelihood.coordinates.quantities(points), likelihood.tracks
    predicted = likelihood.predicted(points)[..., :2]
    errors = _noise(likelihood, generator.standard_normal(predicted.shape))
    if likelihood.noise is NoiseFamily.STUDENT_T:
        degrees = quantities[DEGREES_OF_FREEDOM].numpy()[:, :, None]
        chi_square = generator.chisquare(np.broadcast_to(degrees, predicted.shape[:3]))
        errors = errors / np.sqrt(chi_square / degrees)[..., None]
    errors = errors + _straying(likelihood, generator.standard_normal(predicted.shape))
    measured = predicted + quantities[NOISE].numpy()[:, None, :, None] * errors
    return np.where((tracks.times[:, None] >= tracks.first_seen - 1e-9)[..., None], measured, np.nan)


def _noise(
    likelihood: Likelihood, normal: Float[np.ndarray, "point time body 2"]
) -> Float[np.ndarray, "point time body 2"]:
    """Gaussian noise (m) at noise scale 1."""
    observations, seen = likelihood.observations, likelihood.tracks.seen
    spread = np.broadcast_to(observations.position_reference * np.eye(2), (*seen.shape, 2, 2)).copy()
    spread[observations.frame, observations.body] = np.linalg.inv(observations.whitening)
    error = likelihood.model_error
    if error is not None:
        spread[observations.frame, observations.body] *= np.sqrt(error.position_variance)[:, None, None]
    drawn: np.ndarray = np.einsum("tbij,ptbj->ptbi", spread, normal)
    return drawn


def _straying(
    likelihood: Likelihood, normal: Float[np.ndarray, "point time body 2"]
) -> Float[np.ndarray, "point time body 2"]:
    """Paths (m) along which bodies stray from the model, at noise scale 1."""
    error = likelihood.model_error
    if error is None:
        return np.zeros_like(normal)
    tracks, paths = likelihood.tracks, np.zeros_like(normal)
    for body, release in enumerate(tracks.first_seen.tolist()):
        covariance = straying(np.maximum(tracks.times, release), release, error.duration)
        root = np.linalg.cholesky(covariance + SMALLEST * np.trace(covariance) * np.eye(len(covariance)))
        paths[:, :, body] = root @ normal[:, :, body]
    return likelihood.observations.position_reference * error.acceleration * paths

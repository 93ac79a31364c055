"""Measurements drawn anew: what cameras would have seen in the worlds of some draws, their noise included."""

import numpy as np
from jaxtyping import Float
from torch import Tensor

from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.model_error import straying
from vrdp_prob.models.noise import NoiseFamily
from vrdp_prob.models.unknowns import ANGLE_NOISE, DEGREES_OF_FREEDOM, NOISE

SMALLEST = 1e-10
"""Share of the variance that keeps covariances positive."""


def drawn_lateness(
    likelihood: Likelihood, points: Float[Tensor, "point dimension"], generator: np.random.Generator
) -> Float[np.ndarray, "point time"] | None:
    """Times in s by which the frames of some worlds are late by chance; None where the model has no such frames."""
    lateness = likelihood.lateness(points)
    if lateness is None:
        return None
    return lateness.jitter.numpy()[:, None] * generator.standard_normal((len(points), len(likelihood.tracks.times)))


def replicated(
    likelihood: Likelihood,
    points: Float[Tensor, "point dimension"],
    generator: np.random.Generator,
    late: Float[np.ndarray, "point time"] | None = None,
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
    late
        Time in s by which each frame is late, from `drawn_lateness`.

    Returns
    -------
    A position in every frame from the release on, NaN before.
    """
    observations, error = likelihood.observations, likelihood.model_error
    predicted = likelihood.predicted(points, late)[..., :2]
    spread = np.broadcast_to(observations.position_reference * np.eye(2), (*predicted.shape[1:3], 2, 2)).copy()
    spread[observations.frame, observations.body] = np.linalg.inv(observations.whitening)
    if error is not None:
        spread[observations.frame, observations.body] *= np.sqrt(error.position_variance)[:, None, None]
    errors = np.einsum("tbij,ptbj->ptbi", spread, generator.standard_normal(predicted.shape))
    errors = errors / _tails(likelihood, points, predicted.shape[:3], generator)[..., None]
    normal = generator.standard_normal(predicted.shape)
    if error is not None:
        paths = _paths(likelihood, error.duration, normal)
        errors = errors + observations.position_reference * error.acceleration * paths
    scale = likelihood.coordinates.quantities(points)[NOISE].numpy()
    return _released(likelihood, predicted + scale[:, None, :, None] * errors)


def replicated_angles(
    likelihood: Likelihood,
    points: Float[Tensor, "point dimension"],
    generator: np.random.Generator,
    late: Float[np.ndarray, "point time"] | None = None,
) -> Float[np.ndarray, "point time body"]:
    """Angles (rad) that would be measured in the worlds of some points.

    Parameters
    ----------
    likelihood, points, generator, late
        As for positions.

    Returns
    -------
    An angle in every frame from the release on, NaN before and for bodies of which no angle was measured.
    """
    observations, error = likelihood.observations, likelihood.model_error
    predicted = likelihood.predicted(points, late)[..., 2]
    spread = np.full(predicted.shape[1:], observations.angle_reference)
    if error is not None:
        spread[observations.angle_frame, observations.angle_body] *= np.sqrt(error.angle_variance)
    errors = spread * generator.standard_normal(predicted.shape)
    errors = errors / _tails(likelihood, points, predicted.shape, generator)
    if error is not None:
        paths = _paths(likelihood, error.duration, generator.standard_normal((*predicted.shape, 1)))[..., 0]
        errors = errors + observations.angle_reference * error.angular_acceleration * paths
    scale = likelihood.coordinates.quantities(points)[ANGLE_NOISE].numpy()
    measured = np.isin(np.arange(predicted.shape[2]), observations.angle_bodies)
    return np.where(measured, _released(likelihood, (predicted + scale[:, None] * errors)[..., None])[..., 0], np.nan)


def _tails(
    likelihood: Likelihood,
    points: Float[Tensor, "point dimension"],
    shape: tuple[int, ...],
    generator: np.random.Generator,
) -> Float[np.ndarray, "point time body"]:
    """What Gaussian noise is divided by to be that of the likelihood's family."""
    if likelihood.noise is not NoiseFamily.STUDENT_T:
        return np.ones(shape)
    degrees = likelihood.coordinates.quantities(points)[DEGREES_OF_FREEDOM].numpy()[:, :, None]
    divisors: np.ndarray = np.sqrt(generator.chisquare(np.broadcast_to(degrees, shape)) / degrees)
    return divisors


def _paths(
    likelihood: Likelihood, duration: float, normal: Float[np.ndarray, "point time body axis"]
) -> Float[np.ndarray, "point time body axis"]:
    """Paths along which bodies stray from the model, for an acceleration of unit variance and some duration (s)."""
    tracks, paths = likelihood.tracks, np.zeros_like(normal)
    for body, release in enumerate(tracks.first_seen.tolist()):
        covariance = straying(np.maximum(tracks.times, release), release, duration)
        root = np.linalg.cholesky(covariance + SMALLEST * np.trace(covariance) * np.eye(len(covariance)))
        paths[:, :, body] = root @ normal[:, :, body]
    return paths


def _released(
    likelihood: Likelihood, values: Float[np.ndarray, "point time body axis"]
) -> Float[np.ndarray, "point time body axis"]:
    """Values from each body's release on."""
    tracks = likelihood.tracks
    return np.where((tracks.times[:, None] >= tracks.first_seen - 1e-9)[..., None], values, np.nan)

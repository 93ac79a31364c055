"""Measurements drawn anew: what cameras would have seen in the worlds of some draws, their noise included."""

import numpy as np
from jaxtyping import Float
from torch import Tensor

from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.noise import NoiseFamily
from vrdp_prob.models.unknowns import DEGREES_OF_FREEDOM, NOISE


def replicated(
    likelihood: Likelihood, points: Float[Tensor, "point dimension"], generator: np.random.Generator
) -> Float[np.ndarray, "point time body 2"]:
    """Positions (m) that would be measured in the worlds of some points.

    Parameters
    ----------
    likelihood
        The density, which knows how noise is spread.
    points
        The worlds.
    generator
        Draws the noise, and the model's error where there is one. Where a position was seen the noise has that
        position's covariance, in gaps the one in the middle.

    Returns
    -------
    A position in every frame from the release on, NaN before.
    """
    predicted = likelihood.predicted(points)[..., :2]
    observations, tracks = likelihood.observations, likelihood.tracks
    spread = np.broadcast_to(observations.position_reference * np.eye(2), (*tracks.seen.shape, 2, 2)).copy()
    spread[observations.frame, observations.body] = np.linalg.inv(observations.whitening)
    quantities = likelihood.coordinates.quantities(points)
    normal = generator.standard_normal(predicted.shape)
    if likelihood.noise is NoiseFamily.STUDENT_T:
        degrees = quantities[DEGREES_OF_FREEDOM].numpy()[:, :, None]
        normal /= np.sqrt(generator.chisquare(degrees, predicted.shape[:-1]) / degrees)[..., None]
    errors = np.einsum("tbij,ptbj->ptbi", spread, normal)
    if likelihood.model_error is not None:
        error = likelihood.model_error
        root = np.linalg.cholesky(error.correlation(tracks.times) + 1e-10 * np.eye(len(tracks.times)))
        straying = np.einsum("ts,psbj->ptbj", root, generator.standard_normal(predicted.shape))
        errors += error.position * observations.position_reference * straying
    measured = predicted + quantities[NOISE].numpy()[:, None, :, None] * errors
    return np.where((tracks.times[:, None] >= tracks.first_seen - 1e-9)[..., None], measured, np.nan)

"""Measurements drawn anew: what cameras would have seen in the worlds of some draws, their noise included."""

import numpy as np
from jaxtyping import Float
from torch import Tensor

from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.unknowns import NOISE


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
        Draws the noise. Where a position was seen it has that position's covariance, in gaps the one in the middle.

    Returns
    -------
    A position in every frame from the release on, NaN before.
    """
    predicted = likelihood.predicted(points)[..., :2]
    observations, tracks = likelihood.observations, likelihood.tracks
    spread = np.broadcast_to(observations.position_reference * np.eye(2), (*tracks.seen.shape, 2, 2)).copy()
    spread[observations.frame, observations.body] = np.linalg.inv(observations.whitening)
    scale = likelihood.coordinates.quantities(points)[NOISE].numpy()[:, None, :, None]
    normal = generator.standard_normal(predicted.shape)
    measured = predicted + scale * np.einsum("tbij,ptbj->ptbi", spread, normal)
    return np.where((tracks.times[:, None] >= tracks.first_seen - 1e-9)[..., None], measured, np.nan)

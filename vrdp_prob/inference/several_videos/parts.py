"""What a video brings to a joint fit: its randomness, its density and the modes of its own fit."""

import zlib
from collections.abc import Collection, Sequence

import numpy as np
from jaxtyping import Float

from vrdp_prob.inference.map_fit import MapFit, fit_map
from vrdp_prob.inference.search.clues import Clues
from vrdp_prob.inference.search.plan import FitPlan
from vrdp_prob.inference.several_videos.linking import LinkedVideo, SharedNumbers, link
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.unknowns import Structure, structure_of, unknowns
from vrdp_prob.scene import Tracks


def stream(seed: int, video: str) -> np.random.Generator:
    """Source of randomness of one video, the same whatever the other videos are."""
    return np.random.default_rng([seed, zlib.crc32(video.encode())])


def fit_alone(tracks: Tracks, model: PhysicsModel, *, seed: int, plan: FitPlan, model_error: bool = False) -> MapFit:
    """The fit of one of several videos by itself, with its own randomness."""
    family = Clues.of(tracks).noise_family  # not by the fit: fits of a video are compared, so they believe in one noise
    return fit_map(tracks, model, stream(seed, tracks.video), noise=family, plan=plan, model_error=model_error)


def carried_starts(fits: Sequence[MapFit], videos: Sequence[LinkedVideo]) -> list[Float[np.ndarray, "_ _"]]:
    """The modes of the videos' own fits, in the vectors of the linked videos."""
    return [
        np.array([fit.likelihood.coordinates.carried(mode.point, video.likelihood.coordinates) for mode in fit.modes])
        for fit, video in zip(fits, videos, strict=True)
    ]


def plain_likelihood(clues: Clues, model: PhysicsModel, structure: Structure) -> Likelihood:
    """Density of a video without a model error."""
    tracks, family = clues.tracks, clues.noise_family
    return Likelihood(tracks, model, unknowns(tracks, model, structure, family), family)


def link_fits(
    fits: Sequence[MapFit],
    model: PhysicsModel,
    shared: Collection[str] | None,
    structures: Sequence[Structure] | None = None,
) -> tuple[SharedNumbers, tuple[LinkedVideo, ...]]:
    """Videos linked by what they share, without model errors.

    Parameters
    ----------
    fits
        Their own fits.
    model
        The physics.
    shared
        Names of the quantities that are shared; all that have one value per video where None.
    structures
        Which bodies of each video have which unknowns; as in its own fit where None.
    """
    if structures is None:
        structures = [structure_of(fit.likelihood.coordinates) for fit in fits]
    likelihoods = [
        plain_likelihood(fit.clues, model, structure) for fit, structure in zip(fits, structures, strict=True)
    ]
    return link(likelihoods, shared)

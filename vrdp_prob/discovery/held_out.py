"""How probable each video is, given all the others: by which models are compared.

Around the most probable values the log density is quadratic, and each video's own unknowns are eliminated. So what the
others say of the shared unknowns is the joint Gaussian without that video's part, and the video's predictive density
follows in closed form: nothing is fitted again. Source: the cavity distribution of expectation propagation (Minka,
UAI 2001); leaving out whole groups: Roberts et al., Cross-validation strategies, Ecography 40 (2017).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from vrdp_prob.inference.parallel import in_parallel
from vrdp_prob.inference.prior_mass import log_prior_constant
from vrdp_prob.inference.several_videos.arrow import LOG_TWO_PI
from vrdp_prob.inference.several_videos.ascent import STEEP
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.inference.several_videos.joint_fit import expand, expand_prior

LEAST_CURVATURE = 1e-9


@dataclass(frozen=True)
class Cavity:
    """What all videos but one say of the shared unknowns.

    Parameters
    ----------
    mean, covariance
        Of the Gaussian.
    log_density
        Log probability density of the video that was left out (nats, up to a constant of its tracks).
    """

    mean: Float[np.ndarray, "shared"]
    covariance: Float[np.ndarray, "shared shared"]
    log_density: float


def cavities(fit: SharedFit) -> dict[str, Cavity]:
    """Leave out each video in turn."""
    joint = fit.joint
    mean = joint.gaussian.mean
    expansions = in_parallel(
        lambda k: expand(joint.videos[k], mean, joint.gaussian.locals[k].centre, central=True), range(len(joint.videos))
    )
    prior = expand_prior(joint.numbers, mean)
    # Where a video is at an edge between two courses of events its gradient says nothing of what lies beyond.
    inside = [-float(one.local_gradient @ one.local_step) / 2 < STEEP for one in expansions]
    gradients = [one.reduced_gradient * ok for one, ok in zip(expansions, inside, strict=True)]
    total = _definite(prior.curvature + sum(one.reduced for one in expansions))
    # The search ends a little off the maximum, which matters to what a single video says of a sharp number.
    rest = np.linalg.solve(total, -(prior.gradient + sum(gradients)))
    return {
        video.name: left_out(_own(fit, index), total, gradients[index] + one.reduced @ rest, one.reduced, mean + rest)
        for index, (video, one) in enumerate(zip(joint.videos, expansions, strict=True))
    }


def _own(fit: SharedFit, index: int) -> float:
    """Log density of a video with its own unknowns integrated out, at the most probable shared ones."""
    joint = fit.joint
    video, local = joint.videos[index], joint.gaussian.locals[index]
    entries = video.likelihood.coordinates.entries
    own = video.value(joint.gaussian.mean, local.centre) + local.log_volume + len(local.centre) * LOG_TWO_PI / 2
    return own + log_prior_constant(entries[place] for place in video.local_places)


def left_out(
    own: float,
    total: Float[np.ndarray, "shared shared"],
    gradient: Float[np.ndarray, "shared"],
    curvature: Float[np.ndarray, "shared shared"],
    mean: Float[np.ndarray, "shared"],
) -> Cavity:
    """Leave out one video of a joint Gaussian.

    Parameters
    ----------
    own
        Log density (nats) of the video at the most probable shared unknowns, its own ones integrated out.
    total, curvature
        Curvature of the negative log density along the shared unknowns: of all videos with the prior, and of this one.
    gradient
        Gradient of the video's negative log density there.
    mean
        The most probable shared unknowns.
    """
    others = _definite(total - curvature)
    covariance = np.linalg.inv(others)
    shift = covariance @ gradient
    volume = (np.linalg.slogdet(others)[1] - np.linalg.slogdet(total)[1]) / 2
    return Cavity(mean + shift, covariance, float(own + volume - gradient @ shift / 2))


def _definite(matrix: Float[np.ndarray, "shared shared"]) -> Float[np.ndarray, "shared shared"]:
    """A curvature without directions of negative curvature, which differences leave behind."""
    if not len(matrix):
        return matrix
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    values, vectors = np.linalg.eigh(matrix / np.outer(size, size))
    result: np.ndarray = (vectors * np.maximum(values, LEAST_CURVATURE)) @ vectors.T * np.outer(size, size)
    return result

"""How probable each video is, given all the others: by which models are compared.

Around the most probable values the log density is quadratic, and each video's own unknowns are eliminated. So what the
others say of the shared unknowns is the joint Gaussian without that video's part, and the video's predictive density
follows in closed form: nothing is fitted again. Source: the cavity distribution of expectation propagation (Minka,
UAI 2001); leaving out whole groups: Roberts et al., Cross-validation strategies, Ecography 40 (2017).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate

import numpy as np
from jaxtyping import Float
from scipy.linalg import cho_solve, cholesky, solve_triangular, svdvals

from vrdp_prob.inference.runs.parallel import in_parallel
from vrdp_prob.inference.search.prior_mass import log_prior_constant
from vrdp_prob.inference.several_videos.arrow import LOG_TWO_PI
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.inference.several_videos.joint_fit import expand, expand_prior


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
        lambda k: expand(joint.videos[k], mean, joint.gaussian.locals[k].centre), range(len(joint.videos))
    )
    prior = expand_prior(joint.numbers, mean)
    # Where a video is at an edge between two courses of events its gradient says nothing of what lies beyond.
    inside = [not one.at_edge for one in expansions]
    gradients = [one.reduced_gradient * ok for one, ok in zip(expansions, inside, strict=True)]
    curvatures = [one.reduced for one in expansions]
    total = prior.curvature + sum(curvatures)
    # The search ends a little off the maximum, which matters to what a single video says of a sharp number.
    rest = np.linalg.solve(total, -(prior.gradient + sum(gradients)))
    return {
        video.name: left_out(
            _own(fit, index), gradients[index] + curvatures[index] @ rest, one.reduced_rows, others, mean + rest
        )
        for index, (video, one, others) in enumerate(
            zip(joint.videos, expansions, all_but_each(prior.curvature, curvatures), strict=True)
        )
    }


def _own(fit: SharedFit, index: int) -> float:
    """Log density of a video with its own unknowns integrated out, at the most probable shared ones."""
    joint = fit.joint
    video, local = joint.videos[index], joint.gaussian.locals[index]
    entries = video.likelihood.coordinates.entries
    own = video.value(joint.gaussian.mean, local.centre) + local.log_volume + len(local.centre) * LOG_TWO_PI / 2
    return own + log_prior_constant(entries[place] for place in video.local_places)


def all_but_each(
    prior: Float[np.ndarray, "shared shared"], curvatures: Sequence[Float[np.ndarray, "shared shared"]]
) -> list[Float[np.ndarray, "shared shared"]]:
    """For each video what the prior and all other videos say of the shared unknowns, as a curvature.

    It is no difference from the sum of all: where one video knows a number a million times better than the others, that
    would be all rounding error.
    """
    before = accumulate(curvatures[:-1], initial=prior)
    after = [*accumulate(reversed(curvatures[1:]), initial=np.zeros_like(prior))]
    return [one + other for one, other in zip(before, reversed(after), strict=True)]


def left_out(
    own: float,
    gradient: Float[np.ndarray, "shared"],
    rows: Float[np.ndarray, "residual shared"],
    others: Float[np.ndarray, "shared shared"],
    mean: Float[np.ndarray, "shared"],
) -> Cavity:
    """Leave out one video of a joint Gaussian.

    Parameters
    ----------
    own
        Log density (nats) of the video at the most probable shared unknowns, its own ones integrated out.
    gradient
        Gradient of the video's negative log density there.
    rows
        Derivatives of the video's residuals by the shared unknowns, whose products are its curvature.
    others
        Curvature of the negative log density of all other videos and of the prior.
    mean
        The most probable shared unknowns.
    """
    factor = cholesky(others, lower=True)
    covariance = cho_solve((factor, True), np.eye(len(others)))
    shift = covariance @ gradient
    # The determinant of a sum would be all rounding error where the video knows some number far better than the others.
    volume = -float(np.log1p(svdvals(solve_triangular(factor, rows.T, lower=True)) ** 2).sum()) / 2
    return Cavity(mean + shift, covariance, float(own + volume - gradient @ shift / 2))

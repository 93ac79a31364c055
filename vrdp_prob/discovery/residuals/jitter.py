"""How irregular the frames of all videos are, by how probable it makes what each single frame is early or late.

A variance has no slope where it vanishes, so there is no score of it. Instead the density of the residuals is followed
from there on, each frame's lateness integrated out and the noise as large as is most probable. Source: Crainiceanu and
Ruppert, Likelihood ratio tests in linear mixed models with one variance component, Journal of the Royal Statistical
Society B 66 (2004).
"""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from scipy.optimize import brentq, minimize_scalar
from scipy.stats import chi2, norm

from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.inference.several_videos.fitting import SharedFit

SEEN = 1e-3
"""Share of what a late frame does that must be left when the fit has absorbed what it can, for it to tell anything."""
RATIOS = np.geomspace(1e-4, 1e4, 33)
"""Variance of the lateness, in units of what the data leave open of it, at which the density is looked at."""
ONE_SIDED = float(chi2.isf(0.10, 1))
"""Twice the loss (nats) in log density at the end of the lower 95 %."""


@dataclass(frozen=True)
class Jitter:
    """What residuals say of the jitter of all frames.

    Parameters
    ----------
    value
        Most probable standard deviation in s.
    chi_square, p_value
        Twice the gain (nats) in log density, and the probability of as large a one if all frames are on time.
    bound
        How large (95 %) it may be.
    """

    value: float
    chi_square: float
    p_value: float
    bound: float


def jitter(model: ResidualModel) -> Jitter | None:
    """The jitter of all frames of several videos; None where no frame tells its lateness."""
    parts = [_independent(model, index) for index in range(len(model.videos))]
    gradient, information = (np.concatenate([one[k] for one in parts]) for k in range(2))
    if not len(gradient):
        return None
    count = float(model.linear.degrees)
    squares = model.dispersion * count
    if squares <= float((gradient**2 / information).sum()):  # lateness explains what is left against beliefs, too
        squares = sum(float(left @ left) for left in model.left)

    def noise(ratio: float) -> float:
        """Most probable variance of the noise for a ratio of the variance of the lateness to it."""
        return (squares - float((ratio * gradient**2 / (1 + ratio * information)).sum())) / count

    def gain(ratio: float) -> float:
        lost = count * np.log(noise(ratio) * count / squares) + float(np.log1p(ratio * information).sum())
        return -lost / 2

    ratios = RATIOS / np.median(information)
    best = int(np.argmax([gain(ratio) for ratio in ratios]))
    edges = np.log(ratios[max(best - 1, 0)]), np.log(ratios[min(best + 1, len(ratios) - 1)])
    log_ratio = float(minimize_scalar(lambda log: -gain(np.exp(log)), bounds=edges, method="bounded").x)
    ratio = float(np.exp(log_ratio))
    chi_square = max(2 * gain(ratio), 0.0)

    def beyond(log: float) -> float:
        return 2 * (gain(ratio) - gain(np.exp(log))) - ONE_SIDED

    last = float(np.log(ratios[-1]))
    end = float(np.exp(brentq(beyond, log_ratio, last))) if beyond(last) > 0 else float(np.exp(last))
    return Jitter(
        value=float(np.sqrt(ratio * noise(ratio))),
        chi_square=chi_square,
        p_value=float(chi2.sf(chi_square, 1)) / 2 if chi_square > 0 else 1.0,
        bound=float(np.sqrt(end * noise(end))),
    )


def _independent(model: ResidualModel, index: int) -> tuple[Float[np.ndarray, "part"], Float[np.ndarray, "part"]]:
    """Of a video: slopes of the log density, and the information, by independent combinations of its frames' lateness.

    What the fit absorbs, of all frames together, ties them: their slopes are not independent one by one.
    """
    rows, linear = model.videos[index].late_frames(), model.linear.videos[index]
    reduced = linear.without_own(linear.padded(rows))
    values, vectors = np.linalg.eigh(reduced.T @ reduced)
    told = values > SEEN * float((rows**2).sum(axis=0).max(initial=0.0))
    gradient: np.ndarray = -(reduced.T @ model.left[index]) @ vectors[:, told]
    return gradient, values[told]


def alike_in_neighbours(fit: SharedFit) -> float:
    """Probability that lateness of neighbouring frames is so much alike, where a model says that it is not at all.

    Parameters
    ----------
    fit
        Fit of a model whose frames are late by chance.
    """
    products, squares = 0.0, 0.0
    for index, video in enumerate(fit.joint.videos):
        late = video.likelihood.late(torch.from_numpy(fit.joint.point(index)[None]))[0]
        product = late[1:] * late[:-1]
        products += float(product.sum())
        squares += float((product**2).sum())
    return float(norm.sf(products / np.sqrt(squares))) if squares else 1.0

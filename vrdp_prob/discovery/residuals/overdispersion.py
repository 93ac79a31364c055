"""How much less than it seems the data of each video say, where a model leaves more than noise.

Log probabilities count every frame as new information. What a model leaves unexplained is larger than the noise and
alike in neighbouring frames, so it is divided out: by the mean square of sums of neighbouring residuals, over what
noise would leave of it at most.

Source: quasi-likelihood (McCullagh and Nelder, Generalized linear models, 2nd ed. 1989, section 9) and its use for
choosing models, with the factor of the most general one (Burnham and Anderson, Model selection and multimodel
inference, 2nd ed. 2002, section 2.5); sums of neighbours for what is correlated: the batch means estimator of the
variance of a mean (Alexopoulos and Seila, 1998).
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int

from vrdp_prob.discovery.residuals.residual_model import ResidualModel, VideoResiduals

LENGTHS = (1, 3, 9, 27, 81)
"""Numbers of neighbouring frames whose residuals are summed; the one that exceeds noise most decides."""
REPLICATIONS = 200
LEVEL = 0.95
"""Share of replications that may not be taken for overdispersed."""


def overdispersion(model: ResidualModel, *, seed: int) -> Float[np.ndarray, "video"]:
    """Factor of each video by which its log probabilities are to be divided; 1 where noise explains what is left.

    Parameters
    ----------
    model
        Residuals of the most general model that was fitted.
    seed
        Of the replications.
    """
    replicas = model.replicas(REPLICATIONS, np.random.default_rng(seed))
    return np.array(
        [_factor(video, left, drawn) for video, left, drawn in zip(model.videos, model.left, replicas, strict=True)]
    )


def _factor(video: VideoResiduals, left: Float[np.ndarray, "_"], drawn: Float[np.ndarray, "_ replica"]) -> float:
    series = _series(video)
    seen = _sums(left[:, None], series)[:, 0]
    chance = _sums(drawn, series)
    usual = np.quantile(chance, 1 - (1 - LEVEL) / len(LENGTHS), axis=1)
    return max(1.0, float((seen / usual).max()))


def _series(video: VideoResiduals) -> list[Int[np.ndarray, "_"]]:
    """Places, among the residuals, of each coordinate of each body in order of time."""
    bodies = video.likelihood.observations.body
    places = [np.flatnonzero(bodies == body) for body in np.unique(bodies)]
    return [2 * one + axis for one in places for axis in (0, 1)]


def _sums(
    residuals: Float[np.ndarray, "residual column"], series: Sequence[Int[np.ndarray, "_"]]
) -> Float[np.ndarray, "length column"]:
    """Mean square of sums over so many neighbours, for each length."""
    found = []
    for length in LENGTHS:
        squares = [
            np.add.reduceat(residuals[one], np.arange(0, len(one), length), axis=0) ** 2
            for one in series
            if len(one) >= 2 * length or length == 1
        ]
        found.append(np.concatenate(squares).mean(axis=0) if squares else np.ones(residuals.shape[1]))
    return np.array(found)

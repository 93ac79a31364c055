"""Residuals of one body in neighbouring frames: how rough they are, how alike, and which are far off the others."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from vrdp_prob.discovery.residuals.residual_model import ResidualModel, VideoResiduals
from vrdp_prob.scene.third_differences import NORMAL_MAD

CUBIC_NOISE_GAIN = 20.0
"""Variance of a third difference of independent noise of unit variance: 1 + 9 + 9 + 1."""
FEWEST = 30
"""Numbers that are needed to judge their scatter."""
CONTACT_FRAMES = 2.5
"""Frames around a contact in which a position may be off because the contact comes a little earlier or later."""

Replicas = Sequence[Float[np.ndarray, "_ replica"]]


def apart_from_neighbours(
    video: VideoResiduals, count: int, generator: np.random.Generator
) -> tuple[Float[np.ndarray, "position"], Float[np.ndarray, "position replica"]]:
    """How far positions are off those just before and after, in standard deviations, and how far noise puts them.

    Parameters
    ----------
    video
        The video.
    count, generator
        Number of replicas, and source of randomness.
    """
    triples = runs(video, 3)
    residuals = np.einsum("oij,oj->oi", video.likelihood.observations.whitening / video.noise.scale, video.raw)
    drawn = video.noise.draws((len(residuals), 2, count), generator)
    return _apart(residuals[..., None], triples)[:, 0], _apart(drawn, triples)


def _apart(
    residuals: Float[np.ndarray, "observation 2 column"], triples: Int[np.ndarray, "3 triple"]
) -> Float[np.ndarray, "triple column"]:
    """The least that the middle one of three residuals is off both others, and off their mean."""
    before, here, after = (residuals[row] for row in triples)
    apart = ((here - before, 2.0), (here - after, 2.0), (here - (before + after) / 2, 1.5))
    squares = [(difference**2).sum(axis=1) / variance for difference, variance in apart]
    return np.sqrt(np.min(squares, axis=0))


@dataclass(frozen=True)
class FramesApart:
    """How alike residuals of the same body are some frames apart, in all videos, and what noise alone leaves of it.

    Parameters
    ----------
    correlation, sd
        Correlation of their components, less what noise alone leaves, and its standard deviation by chance.
    products, drawn_products
        Sum of the products of components of unit variance, and that of replicas.
    difference, drawn_differences
        Robust standard deviation of their difference over the root of two, and that of replicas.
    """

    correlation: float
    sd: float
    products: float
    drawn_products: Float[np.ndarray, "replica"]
    difference: float
    drawn_differences: Float[np.ndarray, "replica"]

    @classmethod
    def of(cls, model: ResidualModel, replicas: Replicas, frames: int) -> "FramesApart | None":
        """Those so many frames apart; None where there are none."""
        pairs = [runs(video, frames + 1, near_contacts=True)[[0, -1]] for video in model.videos]
        first, second = (_placed(model, [left[:, None] for left in model.left], pairs, k)[:, 0] for k in range(2))
        drawn_first, drawn_second = (_placed(model, replicas, pairs, k) for k in range(2))
        squares = float((first**2).sum())
        if not squares:
            return None
        dispersion = model.dispersion
        products, drawn = float((first * second).sum()) / dispersion, (drawn_first * drawn_second).sum(axis=0)
        return cls(
            correlation=dispersion * (products - float(drawn.mean())) / squares,
            sd=dispersion * float(drawn.std()) / squares,
            products=products,
            drawn_products=drawn,
            difference=_robust_sd((second - first)[:, None])[0] / np.sqrt(2),
            drawn_differences=_robust_sd(drawn_second - drawn_first) / np.sqrt(2),
        )


def third_differences(model: ResidualModel, residuals: Replicas) -> Float[np.ndarray, "number replica"]:
    """Third differences of what is left of positions, apart from contacts."""
    four = [runs(video, 4) for video in model.videos]
    first, second, third, fourth = (_placed(model, residuals, four, k) for k in range(4))
    return fourth - 3 * third + 3 * second - first


def squared_sd(differences: Float[np.ndarray, "number replica"]) -> Float[np.ndarray, "replica"]:
    """Variance of the noise of which these are third differences."""
    return _robust_sd(differences) ** 2 / CUBIC_NOISE_GAIN


def roughness(model: ResidualModel) -> float:
    """Mean square of the residuals if they were as large as the roughness of the tracks; that of all where unknown."""
    rough = third_differences(model, [left[:, None] for left in model.left])
    return min(float(squared_sd(rough)[0]), model.dispersion) if len(rough) >= FEWEST else model.dispersion


def runs(video: VideoResiduals, length: int, *, near_contacts: bool = False) -> Int[np.ndarray, "length run"]:
    """Observations of one body in so many frames in a row, apart from contacts unless these are asked for."""
    motion, observations = video.motion, video.likelihood.observations
    place: Int[np.ndarray, "time body"] = np.full(motion.tracks.seen.shape, -1)
    place[observations.frame, observations.body] = np.arange(len(observations.frame))
    if not near_contacts:
        for body in range(len(motion.tracks.bodies)):
            for time in motion.contact_times(body):
                place[np.abs(motion.times - time) < CONTACT_FRAMES * motion.frame_time, body] = -1
    last = len(place) - length + 1
    rows = np.array([place[k : k + max(last, 0)].ravel() for k in range(length)])
    return rows[:, (rows >= 0).all(axis=0)]


def _placed(
    model: ResidualModel, residuals: Replicas, places: Sequence[Int[np.ndarray, "length _"]], row: int
) -> Float[np.ndarray, "number replica"]:
    """Components of what is left of the observations in one row of some places, of all videos."""
    parts = [
        one[: video.positions].reshape(-1, 2, one.shape[-1])[some[row]].reshape(-1, one.shape[-1])
        for video, one, some in zip(model.videos, residuals, places, strict=True)
    ]
    return np.concatenate(parts)


def _robust_sd(numbers: Float[np.ndarray, "number replica"]) -> Float[np.ndarray, "replica"]:
    return np.median(np.abs(numbers), axis=0) / NORMAL_MAD

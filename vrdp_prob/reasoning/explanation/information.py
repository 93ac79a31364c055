"""How much a quantity tells about an answer, from draws of both.

The probability of each draw's answer is predicted from its neighbours: the other draws, weighted by a kernel of the
quantity's distance (Nadaraya-Watson). What the logarithm of that prediction gains over the answer's share among all
other draws is the information in nats. Each draw is left out of its own prediction, so that finitely many draws do not
make information out of nothing: on average the gain is a lower bound of the mutual information (Barber and Agakov, The
IM algorithm, NIPS 2003). The width of the kernel is the one that predicts best.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.stats import norm, rankdata

from vrdp_prob.reasoning.entropy import entropy

WIDTHS = (0.05, 0.1, 0.2, 0.4, 0.8)
"""Widths of the kernel, in standard deviations of the quantity after it was made normal by its ranks."""

COMMON = 0.05
"""A value that this share of the draws have is no draw taken again, but a limit or a rest, say."""

PRIOR_DRAWS = 1.0
"""Draws that the answer's share among all draws counts as in each prediction."""


@dataclass(frozen=True)
class Information:
    """What a quantity tells about an answer.

    Parameters
    ----------
    nats
        Expected fall of the answer's entropy.
    error
        Monte Carlo standard error of that.
    """

    nats: float
    error: float


def smooth_weights(values: Float[np.ndarray, "draw feature"]) -> Float[np.ndarray, "width draw draw"]:
    """Weights of the neighbours of each draw for several widths, by quantities that vary smoothly.

    Draws of exactly equal values are one draw of the posterior taken again, and no neighbours, unless so many share
    the value (`COMMON`) that it is one that the quantity often has.
    """
    normal = norm.ppf((rankdata(values, axis=0) - 0.5) / len(values))
    squared = ((normal[:, None, :] - normal[None, :, :]) ** 2).sum(axis=2)
    equal = squared == 0
    squared[equal & (equal.mean(axis=1, keepdims=True) < COMMON)] = np.inf
    np.fill_diagonal(squared, np.inf)
    return np.stack([np.exp(-0.5 * squared / width**2) for width in WIDTHS])


def alike_weights(values: Int[np.ndarray, "draw"]) -> Float[np.ndarray, "1 draw draw"]:
    """Weights of the neighbours of each draw by a quantity with few values: those that share it."""
    alike = (values[:, None] == values).astype(float)
    np.fill_diagonal(alike, 0.0)
    return alike[None]


def information(weights: Float[np.ndarray, "width draw draw"], codes: Int[np.ndarray, "draw"]) -> Information:
    """What a quantity tells about an answer.

    Parameters
    ----------
    weights
        See `smooth_weights` and `alike_weights`.
    codes
        The answer of each draw.
    """
    gains = _gains(weights, _one_hot(codes)[..., None])[..., 0]
    best = gains[int(gains.mean(axis=1).argmax())]
    if best.mean() <= 0:
        return Information(0.0, float(best.std() / np.sqrt(len(best))))
    return Information(float(best.mean()), float(best.std() / np.sqrt(len(best))))


def chance_information(
    weights: Float[np.ndarray, "width draw draw"],
    codes: Int[np.ndarray, "draw"],
    orders: Sequence[Int[np.ndarray, "draw"]],
) -> Float[np.ndarray, "order"]:
    """Information (nats) that the quantity seems to hold about the answers of other draws: what chance alone gives.

    Parameters
    ----------
    weights
        See `information`.
    codes
        The answer of each draw.
    orders
        Permutations of the draws.
    """
    shuffled = np.stack([_one_hot(codes[order]) for order in orders], axis=-1)
    return np.maximum(_gains(weights, shuffled).mean(axis=1).max(axis=0), 0.0)


def answer_entropy(codes: Int[np.ndarray, "draw"]) -> float:
    """Entropy in nats of the shares of the answers."""
    return entropy(np.bincount(codes) / len(codes))


def _one_hot(codes: Int[np.ndarray, "draw"]) -> Float[np.ndarray, "draw answer"]:
    return np.eye(int(codes.max()) + 1)[codes]


def _gains(
    weights: Float[np.ndarray, "width draw draw"], answers: Float[np.ndarray, "draw answer order"]
) -> Float[np.ndarray, "width draw order"]:
    """Gain in log probability of each draw's answer, for several widths and orders of the answers."""
    draws, kinds, orders = answers.shape
    others = (answers.sum(axis=0) - answers) / (draws - 1)
    # a draw whose answer nobody else has is predicted by the shares with itself: no gain, no loss
    others = np.where((others == 0) & (answers == 1), 1 / draws, others)
    near = (weights @ answers.reshape(draws, -1)).reshape(len(weights), draws, kinds, orders)
    total = weights.sum(axis=2)[:, :, None, None]
    predicted = (near + PRIOR_DRAWS * others) / (total + PRIOR_DRAWS)
    own = (predicted * answers).sum(axis=2)
    return np.asarray(np.log(own) - np.log((others * answers).sum(axis=1)))

"""The best sparse sum of terms, by how well it does in whole videos that were left out."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from sklearn.linear_model import OrthogonalMatchingPursuit

from vrdp_prob.discovery.residuals.missing_acceleration import Separate

MOST_TERMS = 6


@dataclass(frozen=True)
class SparseFormula:
    """A sum of few terms.

    Parameters
    ----------
    terms
        Places of the terms, the first chosen first.
    coefficients
        Their coefficients.
    explained
        Share that they explain of what is left in left-out videos beyond noise; 0 without terms.
    """

    terms: tuple[int, ...]
    coefficients: Float[np.ndarray, "term"]
    explained: float


def sparse_formula(separate: Separate) -> SparseFormula:
    """Choose terms by orthogonal matching pursuit, and their number by leaving out whole videos.

    The number is the smallest whose error in left-out videos is within one standard error of the smallest error, or so
    near to it that the best of as many useless terms does as well by chance.
    Source: J. A. Tropp and A. C. Gilbert, Signal recovery from random measurements via orthogonal matching pursuit,
    IEEE Trans. Inf. Theory 53 (2007); the rule of one standard error: Breiman et al., Classification and regression
    trees (1984), section 3.4.3.
    """
    if not separate.patterns:
        return SparseFormula((), np.zeros(0), 0.0)
    whole = sum((one**2).sum(axis=0) for one in separate.patterns)
    usable = np.flatnonzero(whole > 0)
    scale = np.sqrt(whole[usable])
    patterns = [one[:, usable] / scale for one in separate.patterns]
    residuals = separate.residuals
    count = len(residuals)
    most = min(MOST_TERMS, len(usable))
    errors = np.array([[float((one**2).sum()) for one in residuals], *np.zeros((most, count))])
    for left_out in range(count):
        others = [k for k in range(count) if k != left_out]
        for number in range(1, most + 1) if others else ():
            coefficients = _pursuit([patterns[k] for k in others], [residuals[k] for k in others], number)
            errors[number, left_out] = float(((residuals[left_out] - patterns[left_out] @ coefficients) ** 2).sum())
    totals = errors.sum(axis=1)
    best = int(np.argmin(totals)) if count > 1 else 0
    spread = np.sqrt(count) * (errors - errors[best]).std(axis=1)
    chance = 2 * separate.noise * np.log(max(len(usable), 1))
    chosen = next(k for k in range(most + 1) if totals[k] <= totals[best] + max(spread[k], chance))
    if not chosen:
        return SparseFormula((), np.zeros(0), 0.0)
    coefficients = _pursuit(patterns, residuals, chosen)
    terms = np.flatnonzero(coefficients)
    order = np.argsort(-np.abs(coefficients[terms]))
    beyond = totals[0] - separate.noise * sum(separate.degrees)
    explained = float(np.clip((totals[0] - totals[chosen]) / max(beyond, 1e-300), 0.0, 1.0))
    return SparseFormula(
        tuple(int(usable[k]) for k in terms[order]), (coefficients[terms] / scale[terms])[order], explained
    )


def _pursuit(
    patterns: Sequence[Float[np.ndarray, "_ term"]], residuals: Sequence[Float[np.ndarray, "_"]], count: int
) -> Float[np.ndarray, "term"]:
    """Coefficients of which no more than some are not 0; fewer where further terms say the same as these."""
    design = np.concatenate(patterns)
    length = np.maximum(np.linalg.norm(design, axis=0), 1e-300)
    pursuit: Any = OrthogonalMatchingPursuit(n_nonzero_coefs=count, fit_intercept=False)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Orthogonal matching pursuit ended prematurely", RuntimeWarning)
        pursuit.fit(design / length, np.concatenate(residuals))
    coefficients: np.ndarray = np.asarray(pursuit.coef_) / length
    return coefficients

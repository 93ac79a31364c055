"""Whether what single bodies have depends on something: a regression of numbers that also scatter by themselves."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import orth
from scipy.stats import f as f_distribution

LARGEST_SCATTER, SCATTERS = 2.0, 60
"""Largest standard deviation of the scatter that is considered, and number of trial values."""
RANK = 1e-9
"""Share of the largest variance below which a combination of numbers has none, but follows from the others."""


@dataclass(frozen=True)
class Dependence:
    """How numbers depend on something.

    Parameters
    ----------
    slope, sd
        Coefficients and their standard deviations.
    p_value
        Probability of so clear a dependence where there is none (F test).
    scatter
        Standard deviation of the single bodies about it.
    """

    slope: Float[np.ndarray, "asked"]
    sd: Float[np.ndarray, "asked"]
    p_value: float
    scatter: float


def dependence(
    values: Float[np.ndarray, "number"],
    covariance: Float[np.ndarray, "number number"],
    owners: Float[np.ndarray, "number owner"],
    known: Float[np.ndarray, "number known"],
    asked: Float[np.ndarray, "number asked"],
) -> Dependence | None:
    """Regress numbers on what is asked beside what is known to matter; None where they are too few, or do not differ.

    Of numbers that follow from one another (sums of the same bodies' values round a ring of contacts) only as many
    count as there are independent ones.

    Parameters
    ----------
    values, covariance
        The numbers and how well they are known.
    owners
        Which bodies share in which number: each body scatters by itself, all by the same unknown amount, which
        restricted maximum likelihood finds.
    known, asked
        Columns of the regression.
    """
    shared = owners @ owners.T
    independent = orth(covariance + shared, rcond=RANK)
    values = independent.T @ values
    covariance, shared = (independent.T @ one @ independent for one in (covariance, shared))
    design = independent.T @ np.concatenate([known, asked], axis=1)
    freedom = len(values) - design.shape[1]
    if freedom < 2 or np.linalg.matrix_rank(design) < design.shape[1]:
        return None
    scatters = np.concatenate([[0.0], np.geomspace(1e-4, LARGEST_SCATTER, SCATTERS)])
    fits = [_weighed(values, covariance + scatter**2 * shared, design) for scatter in scatters]
    best = int(np.argmax([fit[0] for fit in fits]))
    _, estimate, spread, misfit = fits[best]
    count = asked.shape[1]
    spread = spread * max(misfit / freedom, 1.0)
    slope, block = estimate[-count:], spread[-count:, -count:]
    statistic = float(slope @ np.linalg.solve(block, slope)) / count
    p_value = float(f_distribution.sf(statistic, count, freedom))
    return Dependence(slope, np.sqrt(np.diag(block)), p_value, float(scatters[best]))


def _weighed(
    values: Float[np.ndarray, "number"],
    covariance: Float[np.ndarray, "number number"],
    design: Float[np.ndarray, "number column"],
) -> tuple[float, Float[np.ndarray, "column"], Float[np.ndarray, "column column"], float]:
    """Restricted log likelihood, estimates, their covariance, and the sum of squares left."""
    weight = np.linalg.inv(covariance)
    precision = design.T @ weight @ design
    spread = np.linalg.inv(precision)
    estimate = spread @ (design.T @ (weight @ values))
    left = values - design @ estimate
    misfit = float(left @ weight @ left)
    log_likelihood = -(np.linalg.slogdet(covariance)[1] + np.linalg.slogdet(precision)[1] + misfit) / 2
    return float(log_likelihood), estimate, spread, misfit

"""Constants of the priors, which model comparison needs: a parameter that may be anything is believed less anywhere."""

from collections.abc import Iterable
from functools import lru_cache

import numpy as np

from vrdp_prob.models.coordinates import Coordinate
from vrdp_prob.models.parameters import Prior

REACH = 12.0
"""Half width of the integral, in standard deviations."""
POINTS = 20001


def log_prior_constant(entries: Iterable[Coordinate]) -> float:
    """What to add to a log prior of these numbers, as the likelihood has it, to make it a probability density."""
    return sum(_log_constant(entry.prior) for entry in entries)


@lru_cache(maxsize=1000)
def _log_constant(prior: Prior) -> float:
    normal = -float(np.log(prior.sd * np.sqrt(2 * np.pi)))
    if prior.upper is None:
        return normal
    values = prior.mean + prior.sd * np.linspace(-REACH, REACH, POINTS)
    edge = np.exp(-np.logaddexp(0.0, (values - prior.upper) / prior.softness))
    density = np.exp(normal - ((values - prior.mean) / prior.sd) ** 2 / 2)
    return normal - float(np.log(np.trapezoid(density * edge, values)))

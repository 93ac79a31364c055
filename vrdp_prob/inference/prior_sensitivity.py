"""How much each reported quantity rests on what was believed beforehand, and how much on the video.

The prior (or the likelihood) of the draws is raised to a power a little above and below 1 by weights; the quantity is
sensitive to it as far as its distribution moves. Source: Kallioinen, Paananen, Buerkner and Vehtari, Detecting and
diagnosing prior and likelihood sensitivity with power-scaling, Statistics and Computing 34 (2024).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from arviz_stats.base.array import array_stats
from jaxtyping import Float

from vrdp_prob.errors import InputError
from vrdp_prob.inference.posterior import Posterior
from vrdp_prob.inference.search.noise_fit import NOISE_FIELDS
from vrdp_prob.models.parameters import MASS, RESTITUTION, ROLLING_RESISTANCE, SLIDING_FRICTION

THRESHOLD = 0.05
"""Sensitivity from which on a change of the prior (or the likelihood) counts; about a shift of the mean by 0.3 standard
deviations where the logarithm of the power changes by 1."""
POWERS = (0.99, 1.01)
SHUFFLES = 20
OTHERS = frozenset({"position", "velocity", "angle", "spin", "angle_zero", *NOISE_FIELDS})
"""Quantities whose priors say nothing of masses, restitutions and friction."""
FRICTIONS = (SLIDING_FRICTION, ROLLING_RESISTANCE)


class Verdict(StrEnum):
    """What a quantity rests on."""

    FINE = "fine"
    """Another prior would hardly change it."""
    PRIOR = "rests on the prior"
    """The video says hardly anything about it."""
    CONFLICT = "prior and data disagree"
    """Both pull at it: they disagree, or each says about as much as the other."""


@dataclass(frozen=True)
class Sensitivity:
    """What one reported quantity rests on.

    Parameters
    ----------
    quantity
        `mass_ratio`, `restitution` (of a pair), or the name of a shared friction.
    objects
        Ids of the two bodies of a pair; none for what all share.
    prior, likelihood
        Sensitivity to the prior of masses, restitutions and friction, and to the likelihood.
    prior_by_chance, likelihood_by_chance
        Sensitivity that so many draws show where there is none.
    """

    quantity: str
    objects: tuple[str, ...]
    prior: float
    likelihood: float
    prior_by_chance: float = 0.0
    likelihood_by_chance: float = 0.0

    @property
    def verdict(self) -> Verdict:
        """The numbers in words."""
        if self.prior < max(THRESHOLD, self.prior_by_chance):
            return Verdict.FINE
        return Verdict.CONFLICT if self.likelihood >= max(THRESHOLD, self.likelihood_by_chance) else Verdict.PRIOR

    @property
    def sentence(self) -> str:
        """The verdict as a sentence; empty where there is nothing to say."""
        if self.verdict is Verdict.FINE:
            return ""
        name = self.quantity.replace("_", " ")
        subject = f"The {name} of objects {' and '.join(self.objects)}" if self.objects else f"The {name}"
        if self.verdict is Verdict.PRIOR:
            return f"{subject} rests on what was believed beforehand: the video says hardly anything about it."
        return f"{subject} would differ under another prior although the video says something about it."

    def to_document(self) -> dict[str, object]:
        """The fields and the verdict by name, as a report holds them."""
        return {
            "quantity": self.quantity,
            "objects": list(self.objects),
            "prior": self.prior,
            "likelihood": self.likelihood,
            "prior_by_chance": self.prior_by_chance,
            "likelihood_by_chance": self.likelihood_by_chance,
            "verdict": str(self.verdict),
        }


def prior_sensitivity(posterior: Posterior) -> tuple[Sensitivity, ...]:
    """Sensitivity of the mass ratio and restitution of every colliding pair, and of the friction that all share.

    What the data say nothing of, which keeps a fixed default or is drawn from the prior, is left out.

    Raises
    ------
    InputError
        If the posterior was saved by a version that did not keep the log prior.
    """
    if "log_prior" not in posterior.data.children:
        raise InputError("the posterior holds no log prior; run the inference again.")
    names = set(posterior.data["log_prior"].data_vars)
    total = _summed(posterior, names)
    physics = _summed(posterior, names - OTHERS)
    likelihood = posterior.data["sample_stats"]["lp"].transpose("chain", "draw").values - total
    return tuple(
        Sensitivity(
            quantity,
            objects,
            power_sensitivity(draws, physics),
            power_sensitivity(draws, likelihood),
            by_chance(draws, physics),
            by_chance(draws, likelihood),
        )
        for quantity, objects, draws in _reported(posterior)
        if np.ptp(draws) > 0
    )


def power_sensitivity(draws: Float[np.ndarray, "chain draw"], component: Float[np.ndarray, "chain draw"]) -> float:
    """Change of the distribution of some draws per doubling of the power of a component of their log density."""
    if np.ptp(component) == 0:
        return 0.0
    # powers this near 1 change weights by a few per cent, so that they need no smoothing
    weights = [np.exp((power - 1) * (component - component.mean())) for power in POWERS]
    lower, upper = (values / values.sum() for values in weights)
    return float(array_stats.power_scale_sense(draws, lower, upper, POWERS[0], POWERS[1]))


def by_chance(draws: Float[np.ndarray, "chain draw"], component: Float[np.ndarray, "chain draw"]) -> float:
    """Largest sensitivity among draws that were shuffled, so that they know nothing of the component."""
    generator = np.random.default_rng(0)
    flat = draws.ravel()
    shuffled = (generator.permutation(flat).reshape(draws.shape) for _ in range(SHUFFLES))
    return max(power_sensitivity(one, component) for one in shuffled)


def _summed(posterior: Posterior, names: set[object]) -> Float[np.ndarray, "chain draw"]:
    """Log prior (nats) of some quantities together."""
    groups = posterior.data["log_prior"]
    size = tuple(posterior.data["posterior"].sizes[axis] for axis in ("chain", "draw"))
    parts = [groups[str(name)].transpose("chain", "draw", ...).values.reshape(*size, -1) for name in names]
    return np.sum([part.sum(axis=-1) for part in parts], axis=0) if parts else np.zeros(size)


def _reported(posterior: Posterior) -> Iterator[tuple[str, tuple[str, ...], Float[np.ndarray, "chain draw"]]]:
    """What a report says: name, objects and draws; positive quantities as logarithms."""
    draws = posterior.data["posterior"]
    for pair in posterior.pairs:
        for quantity, parameter, sign in (("mass_ratio", MASS, -1), ("restitution", RESTITUTION, 1)):
            if not posterior.tells(pair, parameter.name):
                continue
            first, second = (
                np.log(draws[parameter.name].sel(body=body).transpose("chain", "draw").values) for body in pair
            )
            yield quantity, pair, first + sign * second
    for friction in FRICTIONS:
        if friction.name in draws:
            yield friction.name, (), np.log(draws[friction.name].transpose("chain", "draw").values)

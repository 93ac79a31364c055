"""How far draws can be trusted, for every quantity that is reported from them.

Source: Vehtari, Gelman, Simpson, Carpenter and Buerkner, Rank-normalization, folding, and localization: an improved
R-hat, Bayesian Analysis 16 (2021); Elvira, Martino and Robert, Rethinking the effective sample size, International
Statistical Review 90 (2022).
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from arviz_stats.base.array import array_stats
from jaxtyping import Float

from vrdp_prob.models.coordinates import Coordinate, Coordinates
from vrdp_prob.models.parameters import MASS, RESTITUTION, WALL_RESTITUTION
from vrdp_prob.scene import Body
from vrdp_prob.scene.naming import wall_name

RELEASE_WORDS = {
    "x": "place along x",
    "y": "place along y",
    "velocity_x": "velocity along x",
    "velocity_y": "velocity along y",
}
"""What the states at release are called in sentences; other quantities are called by their names."""
TAILS = (0.05, 0.95)
"""Quantiles whose effective sample size is that of the tails."""


@dataclass(frozen=True)
class Reported:
    """Quantities that are read off the draws: linear combinations of the coordinates.

    Parameters
    ----------
    names
        Their names, for sentences.
    combinations
        One row per quantity.
    """

    names: tuple[str, ...]
    combinations: Float[np.ndarray, "quantity dimension"]

    @classmethod
    def of(cls, coordinates: Coordinates, pairs: Iterable[tuple[int, int]], bodies: Sequence[Body]) -> "Reported":
        """All coordinates; log mass ratio and log restitution product of pairs, as far as they are sampled."""
        names, rows = [_words(entry, bodies) for entry in coordinates.entries], list(np.eye(len(coordinates)))
        for first, second in dict.fromkeys(pairs):
            for field, sign, name in ((MASS.name, -1.0, "mass ratio"), (RESTITUTION.name, 1.0, "restitution")):
                row = np.zeros(len(coordinates))
                for body, share in ((first, 1.0), (second, sign)):
                    place = coordinates.places.get((field, body))
                    if place is not None:
                        row[place] += share
                if np.count_nonzero(row) == 2:
                    names.append(f"the {name} of objects {bodies[first].id} and {bodies[second].id}")
                    rows.append(row)
        return cls(tuple(names), np.array(rows))

    @classmethod
    def coordinates(cls, dimension: int) -> "Reported":
        """The coordinates themselves, by number."""
        return cls(tuple(f"coordinate {place}" for place in range(dimension)), np.eye(dimension))

    @property
    def combined(self) -> "Reported | None":
        """Those that are made of several coordinates; None where there are none."""
        rows = np.flatnonzero(np.count_nonzero(self.combinations, axis=1) > 1)
        return Reported(tuple(self.names[row] for row in rows), self.combinations[rows]) if len(rows) else None

    def values(self, points: Float[np.ndarray, "*batch dimension"]) -> Float[np.ndarray, "*batch quantity"]:
        """The quantities of some points."""
        return points @ self.combinations.T


def _words(entry: Coordinate, bodies: Sequence[Body]) -> str:
    """A coordinate for sentences: 'the restitution of object 3'."""
    quantity = RELEASE_WORDS.get(entry.field, entry.field.replace("_", " "))
    if entry.owner is None:
        return f"the {quantity}"
    if entry.field == WALL_RESTITUTION.name:
        return f"the restitution of {wall_name(entry.owner)}"
    return f"the {quantity} of {entry.group or f'object {bodies[entry.owner].id}'}"


@dataclass(frozen=True)
class Statistics:
    """What draws are worth for the quantity for which they are worth least.

    Parameters
    ----------
    r_hat
        Largest split R-hat; 1 for importance sampling.
    ess_bulk, ess_tail
        Smallest effective sample sizes, of the mean and of the 5 % and 95 % quantiles.
    worst
        Name of the quantity that falls shortest of the goals.
    each
        Bulk effective sample size of every quantity; None where only the worst is known.
    """

    r_hat: float
    ess_bulk: float
    ess_tail: float
    worst: str
    each: Float[np.ndarray, "quantity"] | None = None


def chain_statistics(draws: Float[np.ndarray, "chain draw dimension"], reported: Reported | None = None) -> Statistics:
    """Statistics of chains; R-hat is infinite and effective sizes are 0 where they are not defined."""
    shown = reported or Reported.coordinates(draws.shape[-1])
    values = _by_quantity(draws, shown)
    return _worst(shown.names, _r_hat(values), _ess_bulk(values), _ess_tail(values))


def settled(
    by_chain: Float[np.ndarray, "group draw axis"],
    by_time: Float[np.ndarray, "group draw axis"],
    reported: Reported | None = None,
    *,
    r_hat: float,
    effective: float,
) -> bool:
    """Whether groups of chains have met their goals; what is asked first costs least and fails most.

    Parameters
    ----------
    by_chain
        The draws of each group, chain after chain (see `joined`).
    by_time
        The same draws, earlier ones first (see `ordered`).
    reported
        The quantities to look at; the coordinates where None.
    r_hat
        Largest R-hat, of groups and of their earlier and later draws (see `drift`).
    effective
        Fewest effective draws, in the bulk and in the tails.
    """
    if drift(by_time, reported) > r_hat:
        return False
    values = _by_quantity(by_chain, reported or Reported.coordinates(by_chain.shape[-1]))
    return bool(
        _r_hat(values).max() <= r_hat and _ess_tail(values).min() >= effective and _ess_bulk(values).min() >= effective
    )


def _by_quantity(
    draws: Float[np.ndarray, "chain draw dimension"], reported: Reported
) -> Float[np.ndarray, "quantity chain draw"]:
    return np.moveaxis(reported.values(draws), -1, 0)


def _r_hat(values: Float[np.ndarray, "quantity chain draw"]) -> Float[np.ndarray, "quantity"]:
    with np.errstate(all="ignore"):
        return np.nan_to_num(np.asarray(array_stats.rhat(values), dtype=float), nan=np.inf)


def _ess_bulk(values: Float[np.ndarray, "quantity chain draw"]) -> Float[np.ndarray, "quantity"]:
    with np.errstate(all="ignore"):
        return np.nan_to_num(np.asarray(array_stats.ess(values, method="bulk"), dtype=float))


def _ess_tail(values: Float[np.ndarray, "quantity chain draw"]) -> Float[np.ndarray, "quantity"]:
    with np.errstate(all="ignore"):
        return np.nan_to_num(np.asarray(array_stats.ess(values, method="tail", prob=TAILS), dtype=float))


def joined(draws: Float[np.ndarray, "group chain draw axis"]) -> Float[np.ndarray, "group several axis"]:
    """Each group of chains as one, chain after chain, so that autocorrelation within a chain shows.

    R-hat of many short chains is large by chance alone: about 100 effective draws of each are needed for 1.01.
    """
    group, chain, draw, axis = draws.shape
    return draws.reshape(group, chain * draw, axis)


def ordered(draws: Float[np.ndarray, "group chain draw axis"]) -> Float[np.ndarray, "group several axis"]:
    """Each group of chains as one, the first draws of all chains before the second ones."""
    return joined(np.swapaxes(draws, 1, 2))


def drift(by_time: Float[np.ndarray, "group draw axis"], reported: Reported | None = None) -> float:
    """Largest R-hat of groups of draws in the order of time, each group split into its earlier and its later ones."""
    values = _by_quantity(by_time, reported or Reported.coordinates(by_time.shape[-1]))
    return float(_r_hat(values).max())


def weighted_statistics(
    points: Float[np.ndarray, "draw dimension"], weights: Float[np.ndarray, "draw"], reported: Reported | None = None
) -> Statistics:
    """Statistics of independent draws with normalised importance weights.

    Weights that are large in one tail alone leave the mean nearly as it is and make the spread uncertain, so the bulk
    counts what stands behind the mean and the standard deviation.
    """
    shown = reported or Reported.coordinates(points.shape[-1])
    values = shown.values(points)
    order = np.argsort(values, axis=0)
    share, ranked = np.cumsum(weights[order], axis=0), np.take_along_axis(values, order, 0)
    bulk = np.minimum(_effective(values, weights), _effective((values - weights @ values) ** 2, weights))
    below = np.stack([np.take_along_axis(ranked, np.argmax(share >= tail, axis=0)[None], 0) for tail in TAILS])
    tail = np.min([_effective((values <= edge).astype(float), weights) for edge in below], axis=0)
    return _worst(shown.names, np.ones(len(bulk)), bulk, tail)


def _effective(
    values: Float[np.ndarray, "draw quantity"], weights: Float[np.ndarray, "draw"]
) -> Float[np.ndarray, "quantity"]:
    """Number of independent draws of equal weight whose mean has the same variance."""
    squares = (values - weights @ values) ** 2
    variance, error = weights @ squares, weights**2 @ squares
    return np.divide(variance, error, out=np.zeros_like(error), where=error > 0)


def _worst(
    names: tuple[str, ...],
    r_hat: Float[np.ndarray, "quantity"],
    bulk: Float[np.ndarray, "quantity"],
    tail: Float[np.ndarray, "quantity"],
) -> Statistics:
    shortage = np.log(np.maximum(r_hat - 1, 1e-12) / 0.01), -np.log(np.maximum(np.minimum(bulk, tail), 1e-12) / 400)
    worst = int(np.argmax(np.maximum(*shortage)))
    return Statistics(float(r_hat.max()), float(bulk.min()), float(tail.min()), names[worst], bulk)


def share_with_error(inside: Float[np.ndarray, "chain draw"]) -> tuple[float, float]:
    """Share of the draws with some property, and its Monte Carlo standard error with what chains differ by."""
    share = float(inside.mean())
    if share in (0.0, 1.0):
        return share, 0.0
    with np.errstate(all="ignore"):
        within = float(np.nan_to_num(array_stats.mcse(inside[None], method="mean")[0]))
    between = float(inside.mean(axis=1).std(ddof=1)) / len(inside) ** 0.5 if len(inside) > 1 else 0.0
    return share, max(within, between)

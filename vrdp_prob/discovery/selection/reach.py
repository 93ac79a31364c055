"""How far a shared parameter reaches where the density does not fall off as the Gaussian around its top says.

A friction that stops all sliding may be larger at will: from there on only its prior speaks. The Gaussian knows
nothing of that, since the top is at the edge of such a plain.
"""

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from jaxtyping import Float

from vrdp_prob.inference.runs.parallel import in_parallel
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.inference.several_videos.joint_fit import settle

SIDE = 2.0
"""Standard deviations from the top at which it is seen whether the density falls..."""
FALLS = 1.0
"""...by so many nats at least; a Gaussian falls by 2."""
FAR = 8.0
"""Nats by which the density has fallen where nothing is left of it."""
DOUBLINGS = 16
"""Steps away from the top, each twice as long as the one before, at most."""
POINTS = 32
"""Places at which the density is known that is integrated."""
FINE = 4001
"""Places between which it is taken to be straight for that."""


@dataclass(frozen=True)
class Reach:
    """The density of a parameter on a grid.

    Parameters
    ----------
    coordinate
        Evenly spaced values of the parameter's coordinate.
    log_density
        Log density (nats, up to a constant) there.
    """

    coordinate: Float[np.ndarray, "place"]
    log_density: Float[np.ndarray, "place"]

    @cached_property
    def weights(self) -> Float[np.ndarray, "place"]:
        """Probability of each value."""
        density = np.exp(self.log_density - self.log_density.max())
        weights: np.ndarray = density / density.sum()
        return weights

    def quantile(self, probability: float) -> float:
        """Value of the coordinate below which so much of the probability lies."""
        return float(np.interp(probability, np.cumsum(self.weights), self.coordinate))

    def moments(self, function: Callable[[np.ndarray], np.ndarray]) -> tuple[float, float]:
        """Mean and standard deviation of a function of the coordinate."""
        values = function(self.coordinate)
        mean = float(self.weights @ values)
        return mean, float(np.sqrt(self.weights @ (values - mean) ** 2))


def reaches(fit: SharedFit, names: Collection[str], sd: Float[np.ndarray, "shared"]) -> dict[int, Reach]:
    """How far shared numbers reach where all others stay, by their place; without those whose Gaussian says it.

    Each video's own numbers follow. With all others following, too, the density would fall no faster: so what is found
    can widen what the Gaussian says, and not narrow it.

    Parameters
    ----------
    fit
        The fit.
    names
        Parameters that are asked for.
    sd
        Standard deviations of all shared numbers, with what makes them larger than the likelihood says.
    """
    joint = fit.joint
    centre, widening = joint.gaussian.mean, sd / joint.gaussian.sd

    def density(place: int, value: float) -> float:
        shared = centre.copy()
        shared[place] = value

        def of(index: int) -> float:
            video, own = joint.videos[index], joint.gaussian.locals[index].centre
            return max(video.value(shared, own), video.value(shared, settle(video, shared, [own])))

        told = sum(in_parallel(of, range(len(joint.videos)))) / float(widening[place]) ** 2
        return told + float(joint.numbers.log_prior(shared[None])[0])

    places = [place for place, key in enumerate(joint.numbers.keys) if key[0] in names]
    found = {place: reach(partial(density, place), float(centre[place]), float(sd[place])) for place in places}
    return {place: one for place, one in found.items() if one is not None}


def reach(density: Callable[[float], float], top: float, sd: float) -> Reach | None:
    """How far a density reaches that may be no Gaussian; None where it falls on both sides about as that does.

    Parameters
    ----------
    density
        Log density (nats, up to a constant) of a coordinate; minus infinity or nan where there is none.
    top, sd
        The Gaussian's.
    """
    known = {value: _finite(density(value)) for value in (top - SIDE * sd, top, top + SIDE * sd)}
    if all(known[top] - known[side] >= FALLS for side in (top - SIDE * sd, top + SIDE * sd)):
        return None
    for sign in (-1.0, 1.0):
        for value in _outwards(top, sign * SIDE * sd):
            known[value] = _finite(density(value))
            if known[value] < max(known.values()) - FAR:
                break
    values = sorted(known)
    inside = [value for value in values if known[value] > max(known.values()) - FAR]
    low, high = values[max(values.index(inside[0]) - 1, 0)], values[min(values.index(inside[-1]) + 1, len(values) - 1)]
    known |= {value: _finite(density(value)) for value in np.linspace(low, high, POINTS).tolist()}
    places = np.array(sorted(known))
    grid = np.linspace(low, high, FINE)
    return Reach(grid, np.interp(grid, places, np.array([known[value] for value in places.tolist()])))


def _outwards(top: float, first: float) -> Iterator[float]:
    """Values ever farther from the top."""
    return (top + first * 2.0**k for k in range(1, DOUBLINGS + 1))


def _finite(value: float) -> float:
    """A log density, very low where there is none."""
    return value if np.isfinite(value) else -1e300

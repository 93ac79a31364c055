"""Elliptical slice steps of many chains at once: no step length to tune, no gradient, and every step moves.

The density is compared with a Student-t around the most probable values: where it is of that shape, a step is a fresh
draw. Source: Murray, Adams and MacKay, Elliptical slice sampling, AISTATS (2010); Nishihara, Murray and Adams, Parallel
MCMC with generalized elliptical slice sampling, JMLR 15 (2014).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

DEGREES_OF_FREEDOM = 10.0
"""Of the reference: its tails must be at least as heavy as those of the density."""
SMALLEST_ANGLE = 1e-7
"""Angle (rad) at which a chain stays where it is: its place sits on the edge of its support."""

LogDensity = Callable[[Int[np.ndarray, "chosen"], Float[np.ndarray, "chosen dimension"]], Float[np.ndarray, "chosen"]]
"""Log density of new places of some chains, -inf where there is no support."""


@dataclass
class Chains:
    """Places of many chains in whitened coordinates, with their log density; changed in place by steps."""

    places: Float[np.ndarray, "chain dimension"]
    log_density: Float[np.ndarray, "chain"]


def reference_log_density(places: Float[np.ndarray, "chain dimension"]) -> Float[np.ndarray, "chain"]:
    """Log density of the Student-t reference, up to a constant."""
    power = (DEGREES_OF_FREEDOM + places.shape[1]) / 2
    return np.asarray(-power * np.log1p((places**2).sum(axis=1) / DEGREES_OF_FREEDOM))


def reference_draws(count: int, dimension: int, generator: np.random.Generator) -> Float[np.ndarray, "draw dimension"]:
    """Draws of the reference."""
    chi_square = generator.chisquare(DEGREES_OF_FREEDOM, size=(count, 1)) / DEGREES_OF_FREEDOM
    draws: np.ndarray = generator.standard_normal((count, dimension)) / np.sqrt(chi_square)
    return draws


def slice_step(chains: Chains, log_density: LogDensity, generator: np.random.Generator) -> int:
    """Move every chain once; returns the number of places looked at."""
    count, dimension = chains.places.shape
    if not dimension:
        return 0
    squares = (chains.places**2).sum(axis=1)
    shape = (DEGREES_OF_FREEDOM + dimension) / 2
    variance = (DEGREES_OF_FREEDOM + squares) / 2 / np.asarray(generator.gamma(shape, size=count))
    aside = np.sqrt(variance)[:, None] * generator.standard_normal((count, dimension))
    start = chains.places.copy()
    level = chains.log_density - reference_log_density(start) + np.log(generator.random(count))
    angle: np.ndarray = np.asarray(generator.uniform(0, 2 * np.pi, count))
    low, high = angle - 2 * np.pi, angle.copy()
    waiting, looks = np.arange(count), 0
    while len(waiting):
        turned = angle[waiting, None]
        places = start[waiting] * np.cos(turned) + aside[waiting] * np.sin(turned)
        values = log_density(waiting, places)
        looks += len(waiting)
        inside = values - reference_log_density(places) > level[waiting]
        moved = waiting[inside]
        chains.places[moved], chains.log_density[moved] = places[inside], values[inside]
        waiting = waiting[~inside]
        behind = angle[waiting] < 0
        low[waiting[behind]] = angle[waiting[behind]]
        high[waiting[~behind]] = angle[waiting[~behind]]
        waiting = waiting[high[waiting] - low[waiting] > SMALLEST_ANGLE]
        angle[waiting] = generator.uniform(low[waiting], high[waiting])
    return looks

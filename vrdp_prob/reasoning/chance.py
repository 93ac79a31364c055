"""Where draws of what the tracks leave open come from: a seed, or no chance at all."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float


class Purpose(IntEnum):
    """What is drawn; each has a stream of random numbers of its own, so that none depends on what else is asked."""

    CONTACTS = 1
    CONTACT_TIMES = 2
    MOTION = 3
    LAST_FLIGHT = 4
    ATTRIBUTES = 5
    FRICTION = 6
    DEFAULTS = 7
    RESTS = 8
    LAST_FRICTION = 9
    ORDER = 10
    EXPLANATION = 11
    DEVIATION_SCALES = 12
    DEVIATIONS = 13
    FORETOLD = 14
    MEANING = 15
    COURSES = 16


@runtime_checkable
class Random(Protocol):
    """The random numbers that reasoning needs; a numpy generator has them."""

    def standard_normal(self, size: tuple[int, ...], /) -> np.ndarray:
        """Numbers of the standard normal distribution."""
        ...

    def random(self, size: tuple[int, ...], /) -> np.ndarray:
        """Numbers between 0 and 1."""
        ...

    def choice(self, values: np.ndarray, /, size: int, *, p: np.ndarray) -> np.ndarray:
        """Some of the values, each with its probability."""
        ...


@runtime_checkable
class Chance(Protocol):
    """Gives the random numbers for each purpose."""

    def numbers(self, purpose: Purpose) -> Random:
        """Random numbers, the same ones each time."""
        ...

    def another(self, batch: int) -> "Chance":
        """Chance for another batch of draws."""
        ...


@dataclass(frozen=True)
class Seeded:
    """Chance that follows a seed.

    Parameters
    ----------
    seed
        The same seed gives the same draws.
    batch
        Number of the batch of draws: batches are independent of each other.
    """

    seed: int = 0
    batch: int = 0

    def numbers(self, purpose: Purpose) -> np.random.Generator:
        """The stream of a purpose."""
        return np.random.default_rng((self.seed, int(purpose), self.batch))

    def another(self, batch: int) -> "Seeded":
        """The streams of another batch."""
        return replace(self, batch=batch)


class MostProbable:
    """No chance: the most probable value of everything, for answers of a single best fit.

    It is its own stream: normal numbers are 0, what has a probability above one half happens.
    """

    def numbers(self, purpose: Purpose) -> "MostProbable":
        """The most probable values, whatever the purpose."""
        del purpose
        return self

    def another(self, batch: int) -> "MostProbable":
        """The most probable values once more."""
        del batch
        return self

    def standard_normal(self, size: tuple[int, ...], /) -> Float[np.ndarray, "..."]:
        """The mean, 0."""
        return np.zeros(size)

    def random(self, size: tuple[int, ...], /) -> Float[np.ndarray, "..."]:
        """One half, which is below every probability that is above it."""
        return np.full(size, 0.5)

    def choice(self, values: Sequence[int] | np.ndarray, /, size: int, *, p: np.ndarray) -> np.ndarray:
        """The most probable value, again and again."""
        return np.full(size, np.asarray(values)[int(np.argmax(p))])

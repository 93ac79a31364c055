"""What an intervention does to one object: takes it away, or changes one of its physical parameters."""

from dataclasses import dataclass
from enum import StrEnum
from typing import ClassVar

import numpy as np
from jaxtyping import Float

MASS_FACTOR = 5.0
"""Heavier is five times the mass, lighter a fifth (Ding et al., NeurIPS 2021)."""

SMALLEST = 1e-6
"""Masses (kg), friction and restitution stay at or above this; so nothing has to be divided by zero."""


class PhysicalParameter(StrEnum):
    """What an intervention may change."""

    MASS = "mass"
    RESTITUTION = "restitution"
    FRICTION = "friction"
    SPEED = "speed"


BOUNDS = {
    PhysicalParameter.MASS: (SMALLEST, np.inf),
    PhysicalParameter.RESTITUTION: (SMALLEST, 1.0),
    PhysicalParameter.FRICTION: (SMALLEST, np.inf),
    PhysicalParameter.SPEED: (0.0, np.inf),
}
"""Where a parameter stays whatever its change: no collision gives energy, no speed is negative."""


class Rule(StrEnum):
    """How a parameter changes."""

    FACTOR = "factor"
    OFFSET = "offset"


@dataclass(frozen=True)
class Shift:
    """A change of one physical parameter of an object.

    Parameters
    ----------
    parameter
        Which one: its mass, its restitution factor, its friction, or its speed when it is released.
    rule
        Times a factor, or plus an offset.
    amount
        The factor, or the offset in the parameter's unit (kg; 1; friction relative to what it was; m/s).
    """

    parameter: PhysicalParameter
    rule: Rule
    amount: float

    def of(self, values: Float[np.ndarray, "draw"]) -> Float[np.ndarray, "draw"]:
        """Values of the parameter after the change, within its bounds."""
        shifted = values * self.amount if self.rule is Rule.FACTOR else values + self.amount
        return np.clip(shifted, *BOUNDS[self.parameter])


@dataclass(frozen=True)
class Meaning:
    """One thing that a word may mean.

    Parameters
    ----------
    probability
        How probable it is.
    shift
        What it changes; None where it changes nothing.
    """

    probability: float
    shift: Shift | None


@dataclass(frozen=True)
class Change:
    """What an intervention does to one object, and the word for it.

    Parameters
    ----------
    word
        As in 'the cube is removed', 'the cube were heavier'.
    meanings
        What the word may mean; every draw of a world takes one of them. Empty where the object is removed.
    """

    word: str
    meanings: tuple[Meaning, ...] = ()

    REMOVED: ClassVar["Change"]
    HEAVIER: ClassVar["Change"]
    LIGHTER: ClassVar["Change"]

    @classmethod
    def by(cls, word: str, parameter: PhysicalParameter, rule: Rule, amount: float) -> "Change":
        """A change whose meaning is certain."""
        return cls(word, (Meaning(1.0, Shift(parameter, rule, amount)),))

    @property
    def removes(self) -> bool:
        """Whether the object is taken away."""
        return not self.meanings

    @property
    def is_uncertain(self) -> bool:
        """Whether the word may mean several things."""
        return len(self.meanings) > 1

    def __str__(self) -> str:
        return self.word


Change.REMOVED = Change("removed")
Change.HEAVIER = Change.by("heavier", PhysicalParameter.MASS, Rule.FACTOR, MASS_FACTOR)
Change.LIGHTER = Change.by("lighter", PhysicalParameter.MASS, Rule.FACTOR, 1 / MASS_FACTOR)

BUILT_IN = (Change.REMOVED, Change.HEAVIER, Change.LIGHTER)
"""The changes that CLEVRER and VRDP ask about."""

"""The things that move (bodies) and the things that do not (walls)."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from jaxtyping import Float

from vrdp_prob.errors import InputError

ATTRIBUTES = ("color", "material", "shape")
COLORS = ("gray", "red", "blue", "green", "brown", "cyan", "purple", "yellow")
MATERIALS = ("metal", "rubber")
WALL_DIGITS = 6
"""Decimals (m) in which the end points of one wall agree."""


class Shape(StrEnum):
    """Solid of a body; seen from above a sphere and a cylinder are discs, a cube is a square."""

    SPHERE = "sphere"
    CUBE = "cube"
    CYLINDER = "cylinder"

    @classmethod
    def named(cls, name: str) -> "Shape":
        """The shape of a name.

        Raises
        ------
        InputError
            If there is none.
        """
        if name not in list(cls):
            raise InputError(f"shape '{name}' is not known; use sphere, cube or cylinder.")
        return cls(name)

    @property
    def is_disc(self) -> bool:
        """Whether the outline in the plane is a disc."""
        return self is not Shape.CUBE

    @property
    def reach(self) -> float:
        """Distance of the outermost point of the outline from its centre, in radii."""
        return 1.0 if self.is_disc else math.sqrt(2)


@dataclass(frozen=True)
class Body:
    """One object of a video, with what is known of it before its motion is looked at.

    Parameters
    ----------
    id
        Name of the body, unique in its video.
    shape
        Solid of the body.
    radius
        Radius in m (half side for a cube); None where it is not known, which only a body that meets no other may have.
    mass
        Mass in kg where it was weighed, else None (unknown, to be inferred).
    inertia
        Moment of inertia about the vertical axis in kg m^2 where it is known, else None (follows from mass and shape).
    material, color
        Attributes that questions may name, None where not known.
    attribute_probabilities
        For an attribute that perception is not sure of (`color`, `material`, `shape`): probability of each value.
        An attribute that is not listed is certain.

    Raises
    ------
    InputError
        If the shape is none of `Shape`, an id, material or color is no text, a radius, mass or inertia is no positive
        finite number, or probabilities do not add up to 1.
    """

    id: str
    shape: Shape
    radius: float | None = None
    mass: float | None = None
    inertia: float | None = None
    material: str | None = None
    color: str | None = None
    attribute_probabilities: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("id", "material", "color"):
            value = getattr(self, name)
            if not isinstance(value, str) and (name == "id" or value is not None):
                raise InputError(f"object {self.id}: its {name} is {value!r}; give a text.")
        try:
            object.__setattr__(self, "shape", Shape.named(self.shape))  # a plain text is as good
        except InputError as error:
            raise InputError(f"object {self.id}: {error}") from error
        for name in ("radius", "mass", "inertia"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0):
                raise InputError(f"object {self.id}: {name} is {value:g}; give a positive number or leave it empty.")
        for attribute, probabilities in self.attribute_probabilities.items():
            if attribute not in ATTRIBUTES:
                raise InputError(
                    f"object {self.id}: '{attribute}' is not an attribute; use one of {', '.join(ATTRIBUTES)}."
                )
            values = list(probabilities.values())
            if min(values, default=-1.0) < 0 or abs(sum(values) - 1) > 1e-6:
                raise InputError(
                    f"object {self.id}: the probabilities of its {attribute} must be >= 0 and add up to 1."
                )

    def probabilities(self, attribute: str) -> Mapping[str, float]:
        """Probability of each value of an attribute; one value with probability 1 where it is certain.

        An attribute that nobody stated has no value: the mapping is empty.
        """
        if attribute in self.attribute_probabilities:
            return self.attribute_probabilities[attribute]
        value: str | None = getattr(self, attribute)
        return {} if value is None else {str(value): 1.0}


@dataclass(frozen=True)
class Wall:
    """A straight static wall, met by a body's edge.

    Parameters
    ----------
    x1, y1, x2, y2
        End points in m.
    restitution
        Restitution factor of the wall (dimensionless), None where it is unknown and to be inferred.

    Raises
    ------
    InputError
        If an end point is not finite, the wall has no length, or the restitution is outside [0, 1].
    """

    x1: float
    y1: float
    x2: float
    y2: float
    restitution: float | None = None

    def __post_init__(self) -> None:
        ends = (self.x1, self.y1, self.x2, self.y2)
        if not all(math.isfinite(value) for value in ends):
            raise InputError(f"wall {ends}: its end points must be finite numbers in metres.")
        if (self.x1, self.y1) == (self.x2, self.y2):
            raise InputError(f"wall {ends}: its two end points are the same; give two different points.")
        if self.restitution is not None and not 0 <= self.restitution <= 1:
            raise InputError(
                f"wall {ends}: restitution is {self.restitution:g}; give a number from 0 to 1 or leave it empty."
            )

    @property
    def place(self) -> tuple[float, float, float, float]:
        """End points in m, rounded, the smaller one first: walls of several videos with the same ones are one wall."""
        (x1, y1), (x2, y2) = sorted([(self.x1, self.y1), (self.x2, self.y2)])
        return _rounded(x1), _rounded(y1), _rounded(x2), _rounded(y2)

    def nearest(self, place: Float[np.ndarray, "2"]) -> Float[np.ndarray, "2"]:
        """Point of the wall, in m, that is nearest to a place."""
        begin, along = np.array([self.x1, self.y1]), np.array([self.x2 - self.x1, self.y2 - self.y1])
        share = np.clip((place - begin) @ along / (along @ along), 0.0, 1.0)
        nearest: np.ndarray = begin + share * along
        return nearest

    def distance(self, place: Float[np.ndarray, "2"]) -> float:
        """Distance in m of a place from the wall."""
        return float(np.linalg.norm(place - self.nearest(place)))


def _rounded(number: float) -> float:
    """A coordinate of a wall; no zero has a sign."""
    return round(number, WALL_DIGITS) + 0.0

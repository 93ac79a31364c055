"""Every parameter once: name, unit, support, transform, prior and default."""

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from jaxtyping import Float
from scipy.special import expit
from torch import Tensor

from vrdp_prob.errors import InputError
from vrdp_prob.scene import Shape

GRAVITY = 9.81
"""Gravitational acceleration in m/s^2."""


EDGE, EDGE_WIDTH = -0.04, 0.02
"""Middle and width, in the logarithm, of the soft edge of restitutions.

It replaces a wall at 1: the posterior stays smooth in the logarithm, where the ridges are straight, and hardly a draw
lies above 1. A transform that keeps the factor below 1 bends the ridge of two factors with a known product, and
samplers get stuck in the bend.
"""


VIDEO_START = "video_start"
"""Name of the time stamp (s) of a video's first frame, which laws that go with the time of a video read beside their
parameters. It is known, and 0 where worlds do not state it."""


class Scope(StrEnum):
    """What has one value of a parameter each."""

    SHARED = "shared"
    """One value per video, which several videos have in common."""
    VIDEO = "video"
    """One value per video, its own even where several videos are looked at together."""
    BODY = "body"
    """One value per body."""
    MATERIAL = "material"
    """One value for all bodies of a material."""

    @property
    def per_video(self) -> bool:
        """Whether there is a single value per video."""
        return self in (Scope.SHARED, Scope.VIDEO)


LARGEST_LOG = 50.0
"""Logarithms beyond it, which a wild proposal may hold, count as it, so that no quantity becomes 0 or infinite."""


class Transform(StrEnum):
    """Map from a parameter to the coordinate in which it is inferred."""

    LOG = "log"
    """The logarithm of the parameter; the parameter is positive."""
    IDENTITY = "identity"
    """The parameter itself."""

    def from_coordinate(self, coordinate: Float[Tensor, "..."]) -> Float[Tensor, "..."]:
        """Parameter that belongs to a coordinate."""
        return coordinate.clamp(-LARGEST_LOG, LARGEST_LOG).exp() if self is Transform.LOG else coordinate

    def to_coordinate(self, value: float) -> float:
        """Coordinate that stands for a value of the parameter."""
        return math.log(value) if self is Transform.LOG else value

    def to_value(self, coordinate: float) -> float:
        """Value of the parameter that belongs to a coordinate."""
        return math.exp(coordinate) if self is Transform.LOG else coordinate

    @property
    def support(self) -> tuple[float, float]:
        """Open interval of values the parameter can take."""
        return (0.0 if self is Transform.LOG else -math.inf, math.inf)


@dataclass(frozen=True)
class Prior:
    """A normal distribution of the inferred coordinate, optionally with a soft upper edge.

    Parameters
    ----------
    mean, sd
        Mean and standard deviation of the normal distribution.
    upper
        Coordinate above which values become implausible, None where there is no such edge.
    softness
        Width of that edge: the density falls by a factor e per `softness` above it.
    """

    mean: float
    sd: float
    upper: float | None = None
    softness: float = EDGE_WIDTH

    def __post_init__(self) -> None:
        if not (math.isfinite(self.mean) and math.isfinite(self.sd) and self.sd > 0 and self.softness > 0):
            raise InputError(f"prior: mean {self.mean:g} and sd {self.sd:g} must be finite numbers and sd positive.")

    def sample(self, generator: np.random.Generator, shape: tuple[int, ...]) -> Float[np.ndarray, "..."]:
        """Draws of the coordinate (by rejection where there is an edge)."""
        draws = np.asarray(generator.normal(self.mean, self.sd, shape))
        wanting = np.full(shape, self.upper is not None)
        while wanting.any():
            again = generator.normal(self.mean, self.sd, int(wanting.sum()))
            keep = expit(((self.upper or 0.0) - again) / self.softness) > generator.random(len(again))
            draws[wanting] = again
            wanting[wanting] = ~keep
        return draws


@dataclass(frozen=True)
class Parameter:
    """One number that the model needs.

    Parameters
    ----------
    name
        Name in words, unique in the model.
    unit
        Unit, `1` where it has none.
    description
        One sentence that a person can read.
    transform
        Map to the coordinate in which the parameter is inferred.
    prior
        Distribution of that coordinate.
    default
        Value where nothing is known of the parameter.
    scope
        Whether there is one value per video, per body or per material.
    shapes
        Shapes of the bodies whose motion depends on it; all where none are given.
    needs_walls
        Whether motion depends on it only where there is something fixed to touch.
    goes_with_masses
        Whether motion depends on its ratio to the masses alone, so that it is as unknown as their scale.
    inferred
        Whether it is unknown; else it has its default wherever nothing shows another value.
    """

    name: str
    unit: str
    description: str
    transform: Transform
    prior: Prior
    default: float
    scope: Scope = Scope.SHARED
    shapes: frozenset[Shape] = frozenset(Shape)
    needs_walls: bool = False
    goes_with_masses: bool = False
    inferred: bool = True

    def __post_init__(self) -> None:
        low, high = self.transform.support
        if not low < self.default < high:
            raise InputError(f"parameter {self.name}: the default {self.default:g} is outside its support.")


def _log_parameter(
    name: str,
    unit: str,
    description: str,
    *,
    median: float,
    log_sd: float,
    scope: Scope = Scope.SHARED,
    shapes: frozenset[Shape] = frozenset(Shape),
) -> Parameter:
    prior = Prior(math.log(median), log_sd)
    return Parameter(name, unit, description, Transform.LOG, prior, default=median, scope=scope, shapes=shapes)


def restitution_parameter(name: str, description: str, *, scope: Scope = Scope.SHARED) -> Parameter:
    """A restitution factor, of a body or of something fixed: all have one prior."""
    prior = Prior(math.log(0.8), 0.35, upper=EDGE)
    return Parameter(name, "1", description, Transform.LOG, prior, default=0.8, scope=scope)


MASS = _log_parameter("mass", "kg", "mass of a body", median=1.0, log_sd=0.7, scope=Scope.BODY)
RESTITUTION = restitution_parameter(
    "restitution",
    "restitution factor of a body; the coefficient of a pair is the product of both factors",
    scope=Scope.BODY,
)
WALL_RESTITUTION = restitution_parameter("wall_restitution", "restitution factor of a wall")
Group = tuple[float | str, ...]
"""Which of several things a number belongs to that videos may share: the name of a material, or where a wall is."""


def group_words(group: Group) -> str:
    """The same as a text; empty where it belongs to none."""
    return ", ".join(part if isinstance(part, str) else f"{part:g}" for part in group)


def belief_key(name: str, group: Group) -> str:
    """What is believed of a parameter of one of several things is told by this: `material_friction_ratio[metal]`."""
    parts = (part if isinstance(part, str) else repr(part) for part in group)
    return f"{name}[{', '.join(parts)}]" if group else name


def plain_name(key: str) -> str:
    """The parameter that a belief is about."""
    return key.partition("[")[0]


MATTER = {parameter.name: parameter for parameter in (MASS, RESTITUTION, WALL_RESTITUTION)}
"""What bodies and walls of every model have."""
SLIDING_FRICTION = _log_parameter(
    "sliding_friction",
    "1",
    "friction coefficient of sliding cubes and cylinders",
    median=0.1,
    log_sd=1.0,
    shapes=frozenset({Shape.CUBE, Shape.CYLINDER}),
)
ROLLING_RESISTANCE = _log_parameter(
    "rolling_resistance",
    "1",
    "resistance coefficient of rolling spheres",
    median=0.03,
    log_sd=1.0,
    shapes=frozenset({Shape.SPHERE}),
)
AIR_DRAG = _log_parameter("air_drag", "1/m", "deceleration by the air per squared speed", median=0.02, log_sd=1.0)
ANGULAR_DRAG = _log_parameter(
    "angular_drag", "rad/s^2", "rate at which a body's spin about the vertical decays", median=1.0, log_sd=1.0
)
FRAME_JITTER = _log_parameter(
    "frame_jitter",
    "s",
    "standard deviation of the true times of frames about their stamps",
    median=0.004,
    log_sd=1.0,
)
"""What an effect with the hook of that name has: a scale of the noise, on which worlds do not depend."""

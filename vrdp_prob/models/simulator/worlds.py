"""A batch of worlds to simulate: states at release, constants of the bodies and parameters."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from vrdp_prob.errors import InputError
from vrdp_prob.scene import Shape

INERTIA_FACTORS = {Shape.SPHERE: 2 / 5, Shape.CYLINDER: 1 / 2, Shape.CUBE: 4 / 6}
"""Moment of inertia about the vertical axis in units of mass times radius squared (half side of a cube squared)."""


@dataclass(frozen=True)
class Worlds:
    """A batch of worlds with the same bodies; gradients flow through all tensors of floats.

    Parameters
    ----------
    shapes
        Shape of each body, shared by the batch.
    position, velocity, angle, spin
        State of each body when it is released, in m, m/s, rad and rad/s.
    release_time
        Time in s from which on the body exists.
    mass
        Mass in kg.
    restitution
        Restitution factor; the coefficient of a pair is the product of both factors.
    radius
        Radius in m (half side of a cube).
    present
        False for a body that was removed (or that pads the batch).
    parameters
        Shared parameters by name, see `vrdp_prob.models.parameters`, and parameters per body of the model's effects.
    walls
        End points (x1, y1, x2, y2) in m of straight walls.
    wall_restitution
        Restitution factor of each wall.
    inertia
        Known moments of inertia about the vertical axis in kg m^2, NaN where they follow from mass and shape; None
        where none is known.
    rolling
        Velocity in m/s at which each sphere would roll by its spin when it is released, for models in which spheres
        slip; None where the model's effect says it.

    Raises
    ------
    InputError
        If the number of shapes and bodies or of walls and their restitutions differ, or a mass or radius is not
        positive.
    """

    shapes: tuple[Shape, ...]
    position: Float[Tensor, "world body 2"]
    velocity: Float[Tensor, "world body 2"]
    angle: Float[Tensor, "world body"]
    spin: Float[Tensor, "world body"]
    release_time: Float[Tensor, "world body"]
    mass: Float[Tensor, "world body"]
    restitution: Float[Tensor, "world body"]
    radius: Float[Tensor, "world body"]
    present: Bool[Tensor, "world body"]
    parameters: Mapping[str, Float[Tensor, "..."]]
    walls: Float[Tensor, "wall 4"] = field(default_factory=lambda: torch.zeros(0, 4, dtype=torch.float64))
    wall_restitution: Float[Tensor, "world wall"] | None = None
    inertia: Float[Tensor, "world body"] | None = None
    rolling: Float[Tensor, "world body 2"] | None = None

    def __post_init__(self) -> None:
        if len(self.shapes) != self.position.shape[1]:
            raise InputError(f"worlds: {len(self.shapes)} shapes but {self.position.shape[1]} bodies; give one each.")
        if self.wall_restitution is None:
            object.__setattr__(self, "wall_restitution", torch.ones(len(self), len(self.walls), dtype=torch.float64))
        if self.restitution_of_walls.shape != (len(self), len(self.walls)):
            raise InputError(
                f"worlds: wall_restitution has shape {tuple(self.restitution_of_walls.shape)}, but there are "
                f"{len(self)} worlds and {len(self.walls)} walls; give one factor per world and wall."
            )
        for name in ("mass", "radius"):
            if (getattr(self, name) <= 0).any():
                raise InputError(f"worlds: a {name} is not positive; give positive numbers.")

    def __len__(self) -> int:
        return int(self.position.shape[0])

    @property
    def restitution_of_walls(self) -> Float[Tensor, "world wall"]:
        """Restitution factor of each wall."""
        assert self.wall_restitution is not None  # set in __post_init__
        return self.wall_restitution

    @property
    def moment_of_inertia(self) -> Float[Tensor, "world body"]:
        """Moment of inertia about the vertical axis in kg m^2, from mass and shape where it is not known."""
        factors = torch.tensor([INERTIA_FACTORS[shape] for shape in self.shapes], dtype=self.mass.dtype)
        from_shape = factors.to(self.mass.device) * self.mass * self.radius**2
        return from_shape if self.inertia is None else torch.where(self.inertia.isnan(), from_shape, self.inertia)

    def on_processor(self) -> "Worlds":
        """The same worlds with every tensor in the processor's memory; themselves where it is there."""
        names = [name for name in _TENSORS if getattr(self, name) is not None]
        if all(tensor.is_cpu for tensor in (*(getattr(self, name) for name in names), *self.parameters.values())):
            return self
        parameters = {name: values.cpu() for name, values in self.parameters.items()}
        return replace(self, **{name: getattr(self, name).cpu() for name in names}, parameters=parameters)

    def without(self, body: int) -> "Worlds":
        """The same worlds after a body was removed."""
        present = self.present.clone()
        present[:, body] = False
        return replace(self, present=present)

    def with_mass_factor(self, body: int, factor: float | Float[Tensor, "world"]) -> "Worlds":
        """The same worlds with the mass (and the moment of inertia) of a body multiplied."""
        scale = torch.ones_like(self.mass)
        scale[:, body] = factor
        inertia = None if self.inertia is None else self.inertia * scale
        return replace(self, mass=self.mass * scale, inertia=inertia)

    def released_at(self, release_time: Float[Tensor, "world body"]) -> "Worlds":
        """The same worlds with other release times (s)."""
        return replace(self, release_time=release_time)

    def select(self, worlds: Sequence[int] | Int[Tensor, "selected"] | Bool[Tensor, "world"] | slice) -> "Worlds":
        """Some worlds of the batch."""
        index = worlds if isinstance(worlds, Tensor | slice) else torch.as_tensor(list(worlds), dtype=torch.long)
        return replace(
            self,
            **{name: getattr(self, name)[index] for name in _BATCHED},
            parameters={name: values[index] for name, values in self.parameters.items()},
            inertia=None if self.inertia is None else self.inertia[index],
            rolling=None if self.rolling is None else self.rolling[index],
        )


_BATCHED = (
    "position",
    "velocity",
    "angle",
    "spin",
    "release_time",
    "mass",
    "restitution",
    "radius",
    "present",
    "wall_restitution",
)
_TENSORS = (*_BATCHED, "walls", "inertia", "rolling")

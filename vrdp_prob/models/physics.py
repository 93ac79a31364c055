"""A physics model is a set of effects; it is written to and read from a TOML file."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from types import ModuleType

from vrdp_prob.errors import InputError
from vrdp_prob.models.effects.air_drag import AirDrag
from vrdp_prob.models.effects.angular_drag import AngularDrag
from vrdp_prob.models.effects.dry_friction import DryFriction
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.normal_impact import NormalImpact
from vrdp_prob.models.parameters import Parameter
from vrdp_prob.models.simulator.laws import Layout
from vrdp_prob.models.simulator.source import load


@dataclass(frozen=True)
class PhysicsModel:
    """A set of physical causes.

    Parameters
    ----------
    name
        Name of the model.
    effects
        Its causes. The order matters where one changes what another has made (the restitution of a contact).

    Raises
    ------
    InputError
        If an effect or a parameter appears twice.
    """

    name: str
    effects: tuple[Effect, ...]

    def __post_init__(self) -> None:
        names = [effect.name for effect in self.effects]
        if len(set(names)) < len(names):
            raise InputError(f"model {self.name}: an effect appears twice ({', '.join(names)}); list each effect once.")

    @classmethod
    def base(cls) -> "PhysicsModel":
        """The model of VRDP: dry friction, air drag, angular drag and normal impacts."""
        return cls("base", (DryFriction(), AirDrag(), AngularDrag(), NormalImpact()))

    def with_effect(self, effect: Effect) -> "PhysicsModel":
        """The model with one more cause."""
        return PhysicsModel(f"{self.name}+{effect.name}", (*self.effects, effect))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of all effects, each once."""
        return tuple({parameter.name: parameter for parameter in self._all_parameters()}.values())

    def _all_parameters(self) -> Iterator[Parameter]:
        for effect in self.effects:
            yield from effect.parameters

    @cached_property
    def layout(self) -> Layout:
        """Order of the numbers that the compiled kernel takes."""
        return Layout.of(self.parameters)

    @cached_property
    def kernel(self) -> ModuleType:
        """The compiled kernel."""
        return load(self.effects, self.layout)

"""A physics model is a set of effects; it is written to and read from a TOML file."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from vrdp_prob.errors import InputError
from vrdp_prob.files import write_atomically
from vrdp_prob.models import model_file
from vrdp_prob.models.effects.air_drag import AirDrag
from vrdp_prob.models.effects.angular_drag import AngularDrag
from vrdp_prob.models.effects.dry_friction import DryFriction
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.normal_impact import NormalImpact
from vrdp_prob.models.parameters import FRAME_JITTER, MATTER, VIDEO_START, Group, Parameter, belief_key, plain_name
from vrdp_prob.models.simulator.kernel import Kernel, load
from vrdp_prob.models.simulator.laws import (
    CONSTANTS,
    STATE,
    Layout,
    is_coupled,
    path_depends_on_mass,
    path_depends_on_spin,
    path_follows_mass,
)
from vrdp_prob.scene import Tracks


@dataclass(frozen=True)
class PhysicsModel:
    """A set of physical causes.

    Parameters
    ----------
    name
        Name of the model.
    effects
        Its causes. The order matters where one changes what another has made (the restitution of a contact).
    beliefs
        Parameters by name whose prior or default differs from what the effect states, or, for masses and restitutions,
        from `vrdp_prob.models.parameters.MATTER`. What is believed of one material or wall alone has it in brackets:
        `material_friction_ratio[metal]`, `wall_restitution[x1, y1, x2, y2]`.

    Raises
    ------
    InputError
        If an effect appears twice, has no hook, or its parameters clash with others, or a belief is about a parameter
        that no effect has and that is none of these.
    """

    name: str
    effects: tuple[Effect, ...]
    beliefs: Mapping[str, Parameter] = field(default_factory=dict)

    def __post_init__(self) -> None:
        names = [effect.name for effect in self.effects]
        if len(set(names)) < len(names):
            raise InputError(f"model {self.name}: an effect appears twice ({', '.join(names)}); list each effect once.")
        for effect in self.effects:
            self._check_effect(effect)
        stated = {*MATTER, *(parameter.name for parameter in self._stated_parameters())}
        if strange := sorted(key for key in self.beliefs if plain_name(key) not in stated):
            raise InputError(f"model {self.name}: no effect has a parameter '{strange[0]}'; leave it out.")

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the compiled kernel, which another process loads for itself."""
        return {name: value for name, value in self.__dict__.items() if name != "kernel"}

    def _check_effect(self, effect: Effect) -> None:
        where = f"model {self.name}, effect '{effect.name}'"
        if not effect.does_something():
            raise InputError(f"{where}: it has none of the hooks of Effect; check how its methods are spelt.")
        own = {parameter.name for parameter in effect.parameters}
        if effect.overrides("frame_jitter") and own != {FRAME_JITTER.name}:
            raise InputError(
                f"{where}: it scatters the times of frames; '{FRAME_JITTER.name}' must be its one parameter, which is "
                "found with the noise."
            )
        if strange := sorted(set(effect.vanishes_at) - own):
            raise InputError(f"{where}: 'vanishes_at' names '{strange[0]}', which is none of its parameters.")
        if taken := sorted(own & {*STATE, *CONSTANTS, *MATTER, VIDEO_START}):
            raise InputError(f"{where}: every body has a '{taken[0]}' already; give the parameter another name.")
        stated = {parameter.name: parameter for parameter in self._stated_parameters()}
        for parameter in effect.parameters:
            if stated[parameter.name] != parameter:
                raise InputError(
                    f"{where}: another effect states the parameter '{parameter.name}' differently; rename one of them."
                )

    @classmethod
    def base(cls) -> "PhysicsModel":
        """The model of VRDP: dry friction, air drag, angular drag and normal impacts."""
        return cls("base", (DryFriction(), AirDrag(), AngularDrag(), NormalImpact()))

    def with_effect(self, effect: Effect, videos: Sequence[Tracks] = ()) -> "PhysicsModel":
        """The model with one more cause.

        Parameters
        ----------
        effect
            The cause.
        videos
            What was seen where it is looked for, by which its places and times are expected; as they are stated where
            none is given.
        """
        beliefs = {**self.beliefs, **effect.expected(videos)} if videos else self.beliefs
        return PhysicsModel(f"{self.name}+{effect.name}", (*self.effects, effect), beliefs)

    def without_effect(self, effect: Effect) -> "PhysicsModel":
        """The model without one of its causes, and without what was believed of it alone."""
        effects = tuple(one for one in self.effects if one.name != effect.name)
        stated = {*MATTER, *(parameter.name for one in effects for parameter in one.parameters)}
        beliefs = {key: belief for key, belief in self.beliefs.items() if plain_name(key) in stated}
        name = "+".join(part for part in self.name.split("+") if part != effect.name)
        return PhysicsModel(name, effects, beliefs)

    @classmethod
    def read(cls, path: Path | str) -> "PhysicsModel":
        """Read a model file that `write` wrote, or that a person did.

        Raises
        ------
        InputError
            With file and field, if the file cannot be read or is not a model.
        """
        try:
            return cls(*model_file.parse(Path(path).read_text(encoding="utf-8")))
        except OSError as error:
            raise InputError(f"{path}: the model file cannot be read ({error.strerror}); check the path.") from error
        except (InputError, UnicodeDecodeError) as error:
            raise InputError(f"{path}: {error}") from error

    def write(self, path: Path | str) -> None:
        """Write the model as a TOML file.

        Raises
        ------
        InputError
            If the file cannot be written.
        """
        with write_atomically(path) as temporary:
            temporary.write_text(self.text, encoding="utf-8")

    @property
    def text(self) -> str:
        """Content of its model file."""
        of_all = {parameter.name: parameter for parameter in self.parameters}
        return model_file.text(self.name, self.effects, {**of_all, **self.beliefs})

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of all effects, each once."""
        stated = {parameter.name: parameter for parameter in self._stated_parameters()}
        return tuple(self.believed(parameter) for parameter in stated.values())

    def believed(self, parameter: Parameter, group: Group = ()) -> Parameter:
        """A parameter, of one material or wall where given, with the prior and the default that this model believes."""
        believed = self.beliefs.get(parameter.name, parameter)
        return self.beliefs.get(belief_key(parameter.name, group), believed) if group else believed

    def _stated_parameters(self) -> Iterator[Parameter]:
        for effect in self.effects:
            yield from effect.parameters

    @cached_property
    def layout(self) -> Layout:
        """Order of the numbers that the compiled kernel takes."""
        return Layout.of(self.parameters, self.effects)

    @cached_property
    def is_coupled(self) -> bool:
        """Whether bodies that are apart act on each other."""
        return is_coupled(self.effects)

    @property
    def obstacle_restitutions(self) -> tuple[str, ...]:
        """Names of the parameters that are the restitutions of the obstacles that effects add, in their order."""
        return tuple(name for effect in self.effects for name in effect.obstacle_restitutions)

    @cached_property
    def path_depends_on_mass(self) -> bool:
        """Whether what accelerates or kicks a body depends on its mass."""
        return path_depends_on_mass(self.effects, self.layout)

    @cached_property
    def path_follows_mass(self) -> bool:
        """Whether a body that touches nothing would move otherwise with another mass, be it by its friction alone."""
        return path_follows_mass(self.effects, self.layout)

    @cached_property
    def path_depends_on_spin(self) -> bool:
        """Whether the path of a body that touches nothing depends on its angle or spin."""
        return path_depends_on_spin(self.effects, self.layout)

    @cached_property
    def kernel(self) -> Kernel:
        """The compiled kernel."""
        return load(self.effects, self.layout)

"""The laws of a model as functions to compile: every hook is recorded once, and written down with its derivative."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from vrdp_prob.models.effects.effect import BodyView, Effect
from vrdp_prob.models.parameters import VIDEO_START, Parameter
from vrdp_prob.models.simulator.contact import ContactKind, Feature, contact, contact_geometry, room_on_feature
from vrdp_prob.models.simulator.formula import Recorder, Scalar, Symbol, depends, vector_jacobian
from vrdp_prob.models.simulator.machine_code import ARRAY, NUMBER, law_function
from vrdp_prob.models.simulator.mathematics import length, where
from vrdp_prob.models.simulator.motion import (
    SLIPPING_ABOVE,
    Phase,
    derivative,
    external_acceleration,
    friction_limit,
    rolling_share,
    slips,
    spin_deceleration,
)

STATE = ("x", "y", "angle", "vx", "vy", "spin")
ROLLING = ("rolling_x", "rolling_y")
"""Numbers of a body's state behind `STATE`; they mean something in models where spheres slip only."""
STATE_SIZE = len(STATE) + len(ROLLING)
CONSTANTS = ("mass", "inverse_mass", "inverse_inertia", "restitution", "radius", "is_sphere")
"""Constants of a body that every model has, in the order of the kernel's array."""
_SIDES = 6
"""First column of the sides in the kernel's phases."""


@dataclass(frozen=True)
class Layout:
    """Order of the numbers in the kernel's arrays.

    Parameters
    ----------
    constants
        Constants of a body.
    shared
        Parameters of a video, and the time stamp of its first frame where a law reads it.
    """

    constants: tuple[str, ...]
    shared: tuple[str, ...]

    @classmethod
    def of(cls, parameters: Sequence[Parameter], effects: Sequence[Effect]) -> "Layout":
        """Layout for the parameters of a model with some effects."""
        own = tuple(parameter.name for parameter in parameters if not parameter.scope.per_video)
        shared = tuple(parameter.name for parameter in parameters if parameter.scope.per_video)
        start = (VIDEO_START,) if any(effect.reads_video_start for effect in effects) else ()
        return cls(CONSTANTS + own, shared + start)


class LawInputs:
    """Symbols for the arrays of a compiled law.

    Parameters
    ----------
    effects
        Effects of the model.
    layout
        Order of the numbers in the arrays.
    """

    def __init__(self, effects: Sequence[Effect], layout: Layout) -> None:
        self.effects, self.layout = effects, layout
        self.recorder = Recorder()
        self.time = self.recorder.input("t")
        self.shared = {name: self.recorder.input("shared", i) for i, name in enumerate(layout.shared)}

    def array(self, name: str, size: int) -> list[Symbol]:
        """Symbols for the numbers of an array."""
        return [self.recorder.input(name, index) for index in range(size)]

    def state(self, name: str) -> list[Symbol]:
        """Symbols for the state of a body."""
        return self.array(name, STATE_SIZE)

    def constants(self, name: str) -> list[Symbol]:
        """Symbols for the constants of a body."""
        return self.array(name, len(self.layout.constants))

    def phase(self) -> list[Symbol]:
        """Symbols for the phase of a body."""
        return self.array("phase", _SIDES + len(with_boundary(self.effects)))

    def view(
        self, state: Sequence[Symbol], constants: Sequence[Symbol], phase: Sequence[Symbol] | None = None
    ) -> BodyView:
        """A body as a law sees it; with a phase where it moves, without one in a contact."""
        values = dict(zip(STATE, state[: len(STATE)], strict=True))
        speed = length(values["vx"], values["vy"])
        slip = [values["vx"] - state[6], values["vy"] - state[7]] if slips(self.effects) else [0.0, 0.0]
        slip_speed = length(*slip) if slips(self.effects) else 0.0
        side: dict[str, Scalar] = {}
        if phase is not None:
            ahead = _ahead(values["vx"], values["vy"], phase)
            if slips(self.effects):
                slipping = phase[0] > SLIPPING_ABOVE
                ahead = where(slipping, 1.0, ahead)
                slip_speed = where(slipping, _ahead(slip[0], slip[1], phase), 1.0) * slip_speed
            speed = ahead * speed
            side = {effect.name: phase[_SIDES + k] for k, effect in enumerate(with_boundary(self.effects))}
        named = dict(zip(self.layout.constants, constants, strict=True))
        own = {name: named.pop(name) for name in self.layout.constants[len(CONSTANTS) :]}
        return BodyView(
            **values,
            speed=speed,
            **named,
            parameters=own,
            slip_x=slip[0],
            slip_y=slip[1],
            slip_speed=slip_speed,
            side=side,
        )


def _ahead(x: Scalar, y: Scalar, phase: Sequence[Symbol]) -> Scalar:
    """1 where a vector points along the reference direction of a phase, else -1."""
    return where(x * phase[1] + y * phase[2] < 0, -1.0, 1.0)


def with_boundary(effects: Sequence[Effect]) -> list[Effect]:
    """Effects with a boundary, in the order of the kernel's sides."""
    return [effect for effect in effects if effect.overrides("boundary")]


def with_kick(effects: Sequence[Effect]) -> list[Effect]:
    """Effects with a kick, in the order of the kernel's kicks."""
    return [effect for effect in effects if effect.overrides("kick")]


def _arguments(text: str) -> dict[str, str]:
    """Types of arguments by name: numbers or arrays."""
    return {name: NUMBER if name in ("t", "of_value") else ARRAY for name in text.split()}


def _vjp(
    name: str,
    arguments: str,
    outputs: Sequence[Scalar],
    bars: Sequence[Symbol],
    arrays: Mapping[str, Sequence[Symbol]],
) -> str:
    """Function that adds the adjoints of inputs to arrays, which are its last arguments."""
    adjoints = iter(vector_jacobian(outputs, bars, [symbol for symbols in arrays.values() for symbol in symbols]))
    by_array = {array: [next(adjoints) for _ in symbols] for array, symbols in arrays.items()}
    return law_function(name, _arguments(f"{arguments} {' '.join(arrays)}"), by_array, add=True)


def _motion(effects: Sequence[Effect], inputs: LawInputs) -> tuple[Scalar, ...]:
    """Time derivative of the state of a body."""
    phase = inputs.phase()
    body = inputs.view(inputs.state("y"), inputs.constants("body"), phase)
    outputs = derivative(effects, inputs.time, body, Phase(phase[0], phase[3]), inputs.shared)
    return (*outputs, *[0.0] * (STATE_SIZE - len(outputs)))


def _motion_text(effects: Sequence[Effect], layout: Layout) -> str:
    inputs = LawInputs(effects, layout)
    outputs = _motion(effects, inputs)
    value = law_function("motion", _arguments("t y phase body shared out"), {"out": outputs})
    arrays = {
        "y_bar": inputs.state("y"),
        "body_bar": inputs.constants("body"),
        "shared_bar": list(inputs.shared.values()),
        "t_bar": [inputs.time],
    }
    bars = inputs.array("bar", STATE_SIZE)
    return value + _vjp("motion_vjp", "t y phase body shared bar", outputs, bars, arrays)


def _external(effects: Sequence[Effect], inputs: LawInputs) -> list[Scalar]:
    """Acceleration without friction of a body that does not slip, what friction holds, and the brake of its spin."""
    phase = inputs.phase()
    body = inputs.view(inputs.state("y"), inputs.constants("body"), phase)
    ax, ay = external_acceleration(effects, inputs.time, body, inputs.shared)
    share = rolling_share(effects, body)
    limit = friction_limit(effects, inputs.time, body, inputs.shared)
    return [share * ax, share * ay, limit, spin_deceleration(effects, inputs.time, body, inputs.shared)]


def _external_text(effects: Sequence[Effect], layout: Layout) -> str:
    outputs = _external(effects, LawInputs(effects, layout))
    return law_function("external", _arguments("t y phase body shared out"), {"out": outputs})


def is_timed(effects: Sequence[Effect], layout: Layout) -> bool:
    """Whether what pushes a body at rest, or its friction, changes with time."""
    inputs = LawInputs(effects, layout)
    return depends(_external(effects, inputs), inputs.time) or depends(_pair_force(effects, inputs), inputs.time)


def path_depends_on_mass(effects: Sequence[Effect], layout: Layout) -> bool:
    """Whether what accelerates or kicks a body depends on its mass, as a force of other bodies does.

    A friction that follows the mass is apart: a body may have a friction of its own, which tells no mass.
    """
    inputs = LawInputs(effects, layout)
    pushes = [*_external(effects, inputs)[:2], *_kicks(effects, inputs)]
    return is_coupled(effects) or _depends_on_mass(pushes, inputs)


def path_follows_mass(effects: Sequence[Effect], layout: Layout) -> bool:
    """Whether a body that touches nothing would move otherwise with another mass and the same friction of its own."""
    inputs = LawInputs(effects, layout)
    path = [*_motion(effects, inputs)[3:5], *_kicks(effects, inputs)]
    return is_coupled(effects) or _depends_on_mass(path, inputs)


def _depends_on_mass(path: Sequence[Scalar], inputs: LawInputs) -> bool:
    constants = dict(zip(inputs.layout.constants, inputs.constants("body"), strict=True))
    return any(depends(path, constants[name]) for name in ("mass", "inverse_mass", "inverse_inertia"))


def path_depends_on_spin(effects: Sequence[Effect], layout: Layout) -> bool:
    """Whether the path of a body that touches nothing depends on its angle or spin."""
    inputs = LawInputs(effects, layout)
    turning = [inputs.state(name)[index] for name in ("y", "ya", "yb") for index in (2, 5)]
    path = [*_motion(effects, inputs)[3:5], *_kicks(effects, inputs), *_pair_force(effects, inputs)]
    return any(depends(path, one) for one in turning)


def _kicks(effects: Sequence[Effect], inputs: LawInputs) -> list[Scalar]:
    """Changes of a body's velocity by all kicks."""
    body = inputs.view(inputs.state("y"), inputs.constants("body"))
    kicks = [effect.kick(inputs.time, body, inputs.shared) for effect in with_kick(effects)]
    return [change for kick in kicks for change in kick[:2]]


def is_coupled(effects: Sequence[Effect]) -> bool:
    """Whether forces act between bodies that do not touch."""
    return any(effect.overrides("pair_force") for effect in effects)


def _pair_force(effects: Sequence[Effect], inputs: LawInputs) -> list[Scalar]:
    a = inputs.view(inputs.state("ya"), inputs.constants("body_a"))
    b = inputs.view(inputs.state("yb"), inputs.constants("body_b"))
    total: list[Scalar] = [0.0, 0.0]
    for effect in effects:
        force = effect.pair_force(inputs.time, a, b, inputs.shared)
        total = [total[0] + force[0], total[1] + force[1]]
    return total


def _pair_text(effects: Sequence[Effect], layout: Layout) -> str:
    inputs = LawInputs(effects, layout)
    force = _pair_force(effects, inputs)
    arguments = "t ya yb body_a body_b shared"
    value = law_function("pair_force", _arguments(f"{arguments} out"), {"out": force})
    arrays = {
        "ya_bar": inputs.state("ya"),
        "yb_bar": inputs.state("yb"),
        "body_a_bar": inputs.constants("body_a"),
        "body_b_bar": inputs.constants("body_b"),
        "shared_bar": list(inputs.shared.values()),
        "t_bar": [inputs.time],
    }
    return value + _vjp("pair_force_vjp", f"{arguments} bar", force, inputs.array("bar", 2), arrays)


def _kick_text(number: int, effect: Effect, effects: Sequence[Effect], layout: Layout) -> str:
    inputs = LawInputs(effects, layout)
    shared, state, constants = list(inputs.shared.values()), inputs.state("y"), inputs.constants("body")
    time = effect.kick_time(inputs.shared)
    change = effect.kick(inputs.time, inputs.view(state, constants), inputs.shared)
    arrays = {"y_bar": state, "body_bar": constants, "shared_bar": shared, "t_bar": [inputs.time]}
    of_time, of_change = [inputs.recorder.input("of_value")], inputs.array("bar", 3)
    return (
        law_function(f"kick_time_{number}", _arguments("shared"), {}, result=time)
        + _vjp(f"kick_time_vjp_{number}", "shared of_value", [time], of_time, {"shared_bar": shared})
        + law_function(f"kick_{number}", _arguments("t y body shared out"), {"out": change})
        + _vjp(f"kick_vjp_{number}", "t y body shared bar", change, of_change, arrays)
    )


def _boundary_text(number: int, effect: Effect, effects: Sequence[Effect], layout: Layout) -> str:
    inputs = LawInputs(effects, layout)
    shared, state, constants = list(inputs.shared.values()), inputs.state("y"), inputs.constants("body")
    value = effect.boundary(inputs.view(state, constants), inputs.shared)
    slopes = vector_jacobian([value], [inputs.recorder.constant(1.0)], state)
    products = [slope * rate for slope, rate in zip(slopes, inputs.state("rate"), strict=True)]
    arrays = {"y_bar": state, "body_bar": constants, "shared_bar": shared}
    of_value = [inputs.recorder.input("of_value")]
    rate = sum(products[1:], products[0])
    return (
        law_function(f"boundary_{number}", _arguments("y body shared"), {}, result=value)
        + law_function(f"boundary_rate_{number}", _arguments("y rate body shared"), {}, result=rate)
        + _vjp(f"boundary_vjp_{number}", "y body shared of_value", [value], of_value, arrays)
    )


_CONTACT_ARGUMENTS = "ya yb body_a body_b feature shared"


class _Contact:
    """Symbols of a contact: its two bodies as laws see them, its geometry and its arguments."""

    def __init__(self, kind: ContactKind, inputs: LawInputs) -> None:
        self.number, self._inputs = int(kind), inputs
        self.states = inputs.state("ya"), inputs.state("yb")
        self.constants = inputs.constants("body_a"), inputs.constants("body_b")
        self.feature = inputs.array("feature", 7)
        of_a, of_b = Feature(*self.feature[:3]), Feature(*self.feature[3:6])
        self.a, self.b = (inputs.view(*of_body) for of_body in zip(self.states, self.constants, strict=True))
        self.geometry = contact_geometry(kind, self.a, self.b, of_a, of_b)
        self.room = room_on_feature(kind, self.a, self.b, of_a, of_b)

    def value(self, part: str, outputs: Sequence[Scalar]) -> str:
        """Function that computes something of the contact."""
        return law_function(f"{part}_{self.number}", _arguments(f"{_CONTACT_ARGUMENTS} out"), {"out": outputs})

    def vjp(self, part: str, outputs: Sequence[Scalar]) -> str:
        """Function of its derivative."""
        arrays = {
            "ya_bar": self.states[0],
            "yb_bar": self.states[1],
            "body_a_bar": self.constants[0],
            "body_b_bar": self.constants[1],
            "shared_bar": list(self._inputs.shared.values()),
        }
        bars = self._inputs.array("bar", len(outputs))
        return _vjp(f"{part}_vjp_{self.number}", f"{_CONTACT_ARGUMENTS} bar", outputs, bars, arrays)


def _contact_text(kind: ContactKind, effects: Sequence[Effect], layout: Layout) -> str:
    inputs = LawInputs(effects, layout)
    meeting = _Contact(kind, inputs)
    geometry = meeting.geometry
    result = contact(effects, geometry, meeting.a, meeting.b, inputs.shared, pressing=meeting.feature[6])
    velocities = [*result.a, *result.b]
    more = [result.closing_speed, result.normal_impulse, *geometry.point, *geometry.normal, geometry.gap]
    return meeting.value("contact_law", [*velocities, *more]) + meeting.vjp("contact_law", velocities)


def geometry_text() -> str:
    """Text of what holds for contacts in all models: the gap, and what keeps it."""
    text = ""
    for kind in ContactKind:
        meeting = _Contact(kind, LawInputs((), Layout(CONSTANTS, ())))
        gap, room = meeting.geometry.gap, meeting.room
        constraint = [*_gap_motion(gap, *meeting.states), room]
        text += meeting.vjp("gap_law", [gap])
        text += meeting.value("constraint_law", [*constraint, _rate(room, *meeting.states)])
        text += meeting.vjp("constraint_law", constraint)
    return text


def _gap_motion(gap: Symbol, state_a: Sequence[Symbol], state_b: Sequence[Symbol]) -> list[Symbol]:
    """Gradient of a gap by the positions of both bodies, and its second time derivative at constant velocities."""
    gradient = vector_jacobian([gap], [gap.recorder.constant(1.0)], [*state_a[:3], *state_b[:3]])
    return [*gradient, _rate(_rate(gap, state_a, state_b), state_a, state_b)]


def _rate(length: Symbol, state_a: Sequence[Symbol], state_b: Sequence[Symbol]) -> Symbol:
    """Time derivative, at constant velocities, of what depends on the states of two bodies."""
    gradient = vector_jacobian([length], [length.recorder.constant(1.0)], [*state_a[:3], *state_b[:3]])
    velocities = [*state_a[3:6], *state_b[3:6]]
    products = [slope * velocity for slope, velocity in zip(gradient, velocities, strict=True)]
    return sum(products[1:], products[0])


def law_text(effects: Sequence[Effect], layout: Layout) -> str:
    """Text of the laws of a model (`laws_kernel.py` says what they compute)."""
    parts = [
        _motion_text(effects, layout),
        _external_text(effects, layout),
        _pair_text(effects, layout),
        *(_kick_text(number, effect, effects, layout) for number, effect in enumerate(with_kick(effects))),
        *(_boundary_text(number, effect, effects, layout) for number, effect in enumerate(with_boundary(effects))),
        *(_contact_text(kind, effects, layout) for kind in ContactKind),
    ]
    return "".join(parts)

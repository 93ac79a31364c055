"""The laws of a model as compiled source: every hook is recorded once and written down with its derivative."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from vrdp_prob.models.effects.effect import BodyView, Effect
from vrdp_prob.models.parameters import Parameter, Scope
from vrdp_prob.models.simulator.contact import ContactKind, Feature, contact, contact_geometry, room_on_feature
from vrdp_prob.models.simulator.formula import (
    Recorder,
    Scalar,
    Symbol,
    assignments,
    depends,
    function_source,
    vector_jacobian,
)
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
"""Numbers of a body's state behind `STATE` in models where spheres slip."""
CONSTANTS = ("mass", "inverse_mass", "inverse_inertia", "restitution", "radius", "is_sphere")
"""Constants of a body that every model has, in the order of the kernel's array."""
_SIDES = 6
"""First column of the sides in the kernel's phases."""


def state_size(effects: Sequence[Effect]) -> int:
    """Numbers in a body's state."""
    return len(STATE) + (len(ROLLING) if slips(effects) else 0)


@dataclass(frozen=True)
class Layout:
    """Order of the numbers in the kernel's arrays.

    Parameters
    ----------
    constants
        Constants of a body.
    shared
        Parameters of a video.
    """

    constants: tuple[str, ...]
    shared: tuple[str, ...]

    @classmethod
    def of(cls, parameters: Sequence[Parameter]) -> "Layout":
        """Layout for the parameters of a model."""
        own = tuple(parameter.name for parameter in parameters if parameter.scope is Scope.BODY)
        shared = tuple(parameter.name for parameter in parameters if parameter.scope is Scope.SHARED)
        return cls(CONSTANTS + own, shared)


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
        self.shared = {name: self.recorder.input(f"shared[{i}]") for i, name in enumerate(layout.shared)}

    def array(self, text: str, size: int) -> list[Symbol]:
        """Symbols for the numbers of an array."""
        return [self.recorder.input(f"{text}[{index}]") for index in range(size)]

    def state(self, text: str) -> list[Symbol]:
        """Symbols for the state of a body."""
        return self.array(text, state_size(self.effects))

    def constants(self, text: str) -> list[Symbol]:
        """Symbols for the constants of a body."""
        return self.array(text, len(self.layout.constants))

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


def _targets(name: str, values: Sequence[Scalar]) -> dict[str, Scalar]:
    return {f"{name}[{index}]": value for index, value in enumerate(values)}


def _vjp_lines(outputs: Sequence[Scalar], bars: Sequence[Symbol], arrays: Mapping[str, Sequence[Symbol]]) -> list[str]:
    """Lines that add the adjoints of inputs to arrays, by the names of these."""
    adjoints = iter(vector_jacobian(outputs, bars, [symbol for symbols in arrays.values() for symbol in symbols]))
    targets = {target: next(adjoints) for array, symbols in arrays.items() for target in _targets(array, symbols)}
    return assignments(targets, add=True)


def _motion_source(effects: Sequence[Effect], layout: Layout) -> str:
    inputs = LawInputs(effects, layout)
    state, constants = inputs.state("y"), inputs.constants("body")
    phase = inputs.phase()
    body = inputs.view(state, constants, phase)
    outputs = derivative(effects, inputs.time, body, Phase(phase[0], phase[3]), inputs.shared)
    arguments = "t, y, phase, body, shared"
    value = function_source("motion", f"{arguments}, out", assignments(_targets("out", outputs)))
    arrays = {
        "y_bar": state,
        "body_bar": constants,
        "shared_bar": list(inputs.shared.values()),
        "t_bar": [inputs.time],
    }
    lines = _vjp_lines(outputs, inputs.array("bar", len(state)), arrays)
    return value + function_source("motion_vjp", f"{arguments}, bar, y_bar, body_bar, shared_bar, t_bar", lines)


def _external(effects: Sequence[Effect], inputs: LawInputs) -> list[Scalar]:
    """Acceleration without friction of a body that does not slip, what friction holds, and the brake of its spin."""
    phase = inputs.phase()
    body = inputs.view(inputs.state("y"), inputs.constants("body"), phase)
    ax, ay = external_acceleration(effects, inputs.time, body, inputs.shared)
    share = rolling_share(effects, body)
    limit = friction_limit(effects, inputs.time, body, inputs.shared)
    return [share * ax, share * ay, limit, spin_deceleration(effects, inputs.time, body, inputs.shared)]


def _external_source(effects: Sequence[Effect], layout: Layout) -> str:
    lines = assignments(_targets("out", _external(effects, LawInputs(effects, layout))))
    return function_source("external", "t, y, phase, body, shared, out", lines)


def is_timed(effects: Sequence[Effect], layout: Layout) -> bool:
    """Whether what pushes a body at rest, or its friction, changes with time."""
    inputs = LawInputs(effects, layout)
    return depends(_external(effects, inputs), inputs.time) or depends(_pair_force(effects, inputs), inputs.time)


def _pair_force(effects: Sequence[Effect], inputs: LawInputs) -> list[Scalar]:
    a = inputs.view(inputs.state("ya"), inputs.constants("body_a"))
    b = inputs.view(inputs.state("yb"), inputs.constants("body_b"))
    total: list[Scalar] = [0.0, 0.0]
    for effect in effects:
        force = effect.pair_force(inputs.time, a, b, inputs.shared)
        total = [total[0] + force[0], total[1] + force[1]]
    return total


def _pair_source(effects: Sequence[Effect], layout: Layout) -> str:
    inputs = LawInputs(effects, layout)
    force = _pair_force(effects, inputs)
    arguments = "t, ya, yb, body_a, body_b, shared"
    value = function_source("pair_force", f"{arguments}, out", assignments(_targets("out", force)))
    arrays = {
        "ya_bar": inputs.state("ya"),
        "yb_bar": inputs.state("yb"),
        "body_a_bar": inputs.constants("body_a"),
        "body_b_bar": inputs.constants("body_b"),
        "shared_bar": list(inputs.shared.values()),
        "t_bar": [inputs.time],
    }
    lines = _vjp_lines(force, inputs.array("bar", 2), arrays)
    return value + function_source("pair_force_vjp", f"{arguments}, bar, {', '.join(arrays)}", lines)


def _by_number(name: str, arguments: str, blocks: Sequence[Sequence[str]], nothing: str) -> str:
    """Function that does what belongs to the number `which`."""
    lines = []
    for number, block in enumerate(blocks):
        lines += [f"if which == {number}:", *(f"    {line}" for line in block or ["pass"])]
    return function_source(name, f"which, {arguments}", [*lines, nothing])


def _kick_source(effects: Sequence[Effect], layout: Layout) -> str:
    times, of_times, changes, of_changes = [], [], [], []
    for effect in with_kick(effects):
        inputs = LawInputs(effects, layout)
        shared, state, constants = list(inputs.shared.values()), inputs.state("y"), inputs.constants("body")
        time = inputs.recorder.constant(0.0) + effect.kick_time(inputs.shared)
        change = effect.kick(inputs.time, inputs.view(state, constants), inputs.shared)
        times.append([*assignments({"time": time}), "return time"])
        of_times.append(_vjp_lines([time], [inputs.recorder.input("bar")], {"shared_bar": shared}))
        changes.append(assignments(_targets("out", change)))
        arrays = {"y_bar": state, "body_bar": constants, "shared_bar": shared, "t_bar": [inputs.time]}
        of_changes.append(_vjp_lines(change, inputs.array("bar", 3), arrays))
    arguments = "t, y, body, shared"
    return (
        _by_number("kick_time", "shared", times, "return math.inf")
        + _by_number("kick_time_vjp", "shared, bar, shared_bar", of_times, "return")
        + _by_number("kick", f"{arguments}, out", changes, "return")
        + _by_number("kick_vjp", f"{arguments}, bar, y_bar, body_bar, shared_bar, t_bar", of_changes, "return")
    )


def _boundary_source(effects: Sequence[Effect], layout: Layout) -> str:
    values, rates, of_values = [], [], []
    for effect in with_boundary(effects):
        inputs = LawInputs(effects, layout)
        shared, state, constants = list(inputs.shared.values()), inputs.state("y"), inputs.constants("body")
        value = inputs.recorder.constant(0.0) + effect.boundary(inputs.view(state, constants), inputs.shared)
        slopes = vector_jacobian([value], [inputs.recorder.constant(1.0)], state)
        products = [slope * rate for slope, rate in zip(slopes, inputs.state("rate"), strict=True)]
        values.append([*assignments({"value": value}), "return value"])
        rates.append([*assignments({"rate_of": sum(products[1:], products[0])}), "return rate_of"])
        arrays = {"y_bar": state, "body_bar": constants, "shared_bar": shared}
        of_values.append(_vjp_lines([value], [inputs.recorder.input("bar")], arrays))
    return (
        _by_number("boundary", "y, body, shared", values, "return 1.0")
        + _by_number("boundary_rate", "y, rate, body, shared", rates, "return 0.0")
        + _by_number("boundary_vjp", "y, body, shared, bar, y_bar, body_bar, shared_bar", of_values, "return")
    )


_CONTACT_ARGUMENTS = "ya, yb, body_a, body_b, feature, shared"
_CONTACT_BARS = "bar, ya_bar, yb_bar, body_a_bar, body_b_bar, shared_bar"


def _contact_source(kind: ContactKind, effects: Sequence[Effect], layout: Layout) -> str:
    inputs = LawInputs(effects, layout)
    state_a, state_b = inputs.state("ya"), inputs.state("yb")
    constants_a, constants_b = inputs.constants("body_a"), inputs.constants("body_b")
    feature = inputs.array("feature", 7)
    a, b = inputs.view(state_a, constants_a), inputs.view(state_b, constants_b)
    of_a, of_b = Feature(*feature[:3]), Feature(*feature[3:6])
    geometry = contact_geometry(kind, a, b, of_a, of_b)
    result = contact(effects, geometry, a, b, inputs.shared, pressing=feature[6])
    velocities = [*result.a, *result.b]
    room = room_on_feature(kind, a, b, of_a, of_b)
    constraint = [*_gap_motion(geometry.gap, state_a, state_b), room]
    more = [result.closing_speed, result.normal_impulse, *geometry.point, *geometry.normal, geometry.gap]
    name = kind.name.lower()
    text = function_source(
        f"contact_{name}", f"{_CONTACT_ARGUMENTS}, out", assignments(_targets("out", [*velocities, *more]))
    )
    text += function_source(
        f"constraint_{name}",
        f"{_CONTACT_ARGUMENTS}, out",
        assignments(_targets("out", [*constraint, _rate(room, state_a, state_b)])),
    )
    arrays = {
        "ya_bar": state_a,
        "yb_bar": state_b,
        "body_a_bar": constants_a,
        "body_b_bar": constants_b,
        "shared_bar": list(inputs.shared.values()),
    }
    for part, outputs in (("contact", velocities), ("gap", [geometry.gap]), ("constraint", constraint)):
        lines = _vjp_lines(outputs, inputs.array("bar", len(outputs)), arrays)
        text += function_source(f"{part}_{name}_vjp", f"{_CONTACT_ARGUMENTS}, {_CONTACT_BARS}", lines)
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


def _choice_source(part: str, suffix: str, arguments: str) -> str:
    arguments = f"{_CONTACT_ARGUMENTS}, {arguments}"
    lines = [
        f"if kind == {int(ContactKind.LINE_POINT)}:",
        f"    {part}_{ContactKind.LINE_POINT.name.lower()}{suffix}({arguments})",
        "else:",
        f"    {part}_{ContactKind.POINT_POINT.name.lower()}{suffix}({arguments})",
    ]
    return function_source(f"{part}_law{suffix}", f"kind, {arguments}", lines)


def law_source(effects: Sequence[Effect], layout: Layout) -> str:
    """Source of all compiled laws of a model (see `laws_kernel.py`)."""
    parts = [
        _motion_source(effects, layout),
        _external_source(effects, layout),
        _pair_source(effects, layout),
        _kick_source(effects, layout),
        _boundary_source(effects, layout),
        *(_contact_source(kind, effects, layout) for kind in ContactKind),
        _choice_source("contact", "", "out"),
        _choice_source("constraint", "", "out"),
        *(_choice_source(part, "_vjp", _CONTACT_BARS) for part in ("contact", "gap", "constraint")),
    ]
    return "".join(parts)

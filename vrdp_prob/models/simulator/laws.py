"""The laws of a model as compiled source: every hook is recorded once and written down with its derivative."""

from collections.abc import Sequence
from dataclasses import dataclass

from vrdp_prob.models.effects.effect import BodyView, Effect
from vrdp_prob.models.parameters import Parameter, Scope
from vrdp_prob.models.simulator.contact import ContactKind, Feature, contact, contact_geometry, room_on_feature
from vrdp_prob.models.simulator.formula import Recorder, Scalar, Symbol, assignments, vector_jacobian
from vrdp_prob.models.simulator.mathematics import length, where
from vrdp_prob.models.simulator.motion import (
    Phase,
    derivative,
    external_acceleration,
    friction_limit,
    spin_deceleration,
)

STATE = ("x", "y", "angle", "vx", "vy", "spin")
CONSTANTS = ("mass", "inverse_mass", "inverse_inertia", "restitution", "radius", "is_sphere")
"""Constants of a body that every model has, in the order of the kernel's array."""


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


class _Inputs:
    """Symbols for the arrays of a compiled law."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self.recorder = Recorder()
        self.shared = {name: self.recorder.input(f"shared[{i}]") for i, name in enumerate(layout.shared)}

    def array(self, text: str, size: int) -> list[Symbol]:
        return [self.recorder.input(f"{text}[{index}]") for index in range(size)]

    def view(
        self, state: Sequence[Symbol], constants: Sequence[Symbol], reference: tuple[Scalar, Scalar] | None = None
    ) -> BodyView:
        values = dict(zip(STATE, state, strict=True))
        speed = length(values["vx"], values["vy"])
        if reference is not None:
            along = values["vx"] * reference[0] + values["vy"] * reference[1]
            speed = where(along < 0, -1.0, 1.0) * speed
        named = dict(zip(self.layout.constants, constants, strict=True))
        own = {name: named.pop(name) for name in self.layout.constants[len(CONSTANTS) :]}
        return BodyView(**values, speed=speed, **named, parameters=own)


def _function(name: str, arguments: str, lines: Sequence[str], ending: str = "") -> str:
    body = [*lines, ending] if ending else [*lines]
    return "\n".join(["@compiled", f"def {name}({arguments}):", *(f"    {line}" for line in body), "\n"])


def _targets(name: str, values: Sequence[Scalar]) -> dict[str, Scalar]:
    return {f"{name}[{index}]": value for index, value in enumerate(values)}


def _motion_source(effects: Sequence[Effect], layout: Layout) -> str:
    inputs = _Inputs(layout)
    time = inputs.recorder.input("t")
    state, constants = inputs.array("y", len(STATE)), inputs.array("body", len(layout.constants))
    phase = inputs.array("phase", 4)
    body = inputs.view(state, constants, (phase[1], phase[2]))
    outputs = derivative(effects, time, body, Phase(phase[0], phase[3]), inputs.shared)
    arguments = "t, y, phase, body, shared"
    value = _function("motion", f"{arguments}, out", assignments(_targets("out", outputs)))
    shared = list(inputs.shared.values())
    adjoints = vector_jacobian(outputs, inputs.array("bar", len(STATE)), [*state, *constants, *shared, time])
    split = len(state), len(state) + len(constants)
    lines = assignments(
        {
            **_targets("y_bar", adjoints[: split[0]]),
            **_targets("body_bar", adjoints[split[0] : split[1]]),
            **_targets("shared_bar", adjoints[split[1] : -1]),
            "t_bar[0]": adjoints[-1],
        },
        add=True,
    )
    return value + _function("motion_vjp", f"{arguments}, bar, y_bar, body_bar, shared_bar, t_bar", lines or ["pass"])


def _external_source(effects: Sequence[Effect], layout: Layout) -> str:
    inputs = _Inputs(layout)
    time = inputs.recorder.input("t")
    body = inputs.view(inputs.array("y", len(STATE)), inputs.array("body", len(layout.constants)))
    push = external_acceleration(effects, time, body, inputs.shared)
    limit = friction_limit(effects, time, body, inputs.shared)
    braking = spin_deceleration(effects, time, body, inputs.shared)
    lines = assignments(_targets("out", [*push, limit, braking]))
    return _function("external", "t, y, phase, body, shared, out", lines)


_CONTACT_ARGUMENTS = "ya, yb, body_a, body_b, feature, shared"
_CONTACT_BARS = "bar, ya_bar, yb_bar, body_a_bar, body_b_bar, shared_bar"


def _contact_source(kind: ContactKind, effects: Sequence[Effect], layout: Layout) -> str:
    inputs = _Inputs(layout)
    state_a, state_b = inputs.array("ya", len(STATE)), inputs.array("yb", len(STATE))
    constants_a = inputs.array("body_a", len(layout.constants))
    constants_b = inputs.array("body_b", len(layout.constants))
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
    text = _function(
        f"contact_{name}", f"{_CONTACT_ARGUMENTS}, out", assignments(_targets("out", [*velocities, *more]))
    )
    text += _function(
        f"constraint_{name}",
        f"{_CONTACT_ARGUMENTS}, out",
        assignments(_targets("out", [*constraint, _rate(room, state_a, state_b)])),
    )
    sizes = {
        "ya_bar": state_a,
        "yb_bar": state_b,
        "body_a_bar": constants_a,
        "body_b_bar": constants_b,
        "shared_bar": list(inputs.shared.values()),
    }
    for part, outputs in (("contact", velocities), ("gap", [geometry.gap]), ("constraint", constraint)):
        wanted = [symbol for symbols in sizes.values() for symbol in symbols]
        adjoints = iter(vector_jacobian(outputs, inputs.array("bar", len(outputs)), wanted))
        targets = {target: next(adjoints) for array, symbols in sizes.items() for target in _targets(array, symbols)}
        lines = assignments(targets, add=True)
        text += _function(f"{part}_{name}_vjp", f"{_CONTACT_ARGUMENTS}, {_CONTACT_BARS}", lines)
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
    return _function(f"{part}_law{suffix}", f"kind, {arguments}", lines)


def law_source(effects: Sequence[Effect], layout: Layout) -> str:
    """Source of all compiled laws of a model (see `laws_kernel.py`)."""
    parts = [
        _motion_source(effects, layout),
        _external_source(effects, layout),
        *(_contact_source(kind, effects, layout) for kind in ContactKind),
        _choice_source("contact", "", "out"),
        _choice_source("constraint", "", "out"),
        *(_choice_source(part, "_vjp", _CONTACT_BARS) for part in ("contact", "gap", "constraint")),
    ]
    return "".join(parts)

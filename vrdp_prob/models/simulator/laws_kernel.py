"""Signatures of the compiled laws of a model; the generated functions take their place when the kernel is assembled.

Arrays: `y` is a body's state (x, y, angle, vx, vy, spin, for models with slip also the rolling velocity), `phase` its
phase (see `motion_kernel.py`), `body` its constants and `shared` the parameters of the video. A function ending in
`_vjp` adds the vector-Jacobian product with `bar` to the arrays ending in `_bar`.
"""

# ruff: noqa: PLR0917 - compiled functions take their arrays by position
from typing import Any

from numba import njit

compiled = njit(nogil=True, error_model="numpy")
"""How kernels are compiled: without the interpreter's lock; a division by zero gives inf or NaN, as in numpy.

The assembled module compiles without counting references too, which doubles the speed of short functions; so they
must not make arrays, nor return them. Numbers that choose a variant of a function are floats: of integers and truth
values that are written down in a call, numba compiles a variant each.
"""
allocating = compiled
"""How the few functions are compiled that make arrays."""
STATE_SIZE = 6
"""Numbers in a body's state."""
SLIPS = False
"""Whether spheres may slip, so that their state has a rolling velocity."""
RUBS = False
"""Whether contacts have friction, so that bodies which press do not move together but hop."""
COUPLED = False
"""Whether forces act between bodies that do not touch, so that all of them move together."""
TIMED = False
"""Whether what pushes a body at rest, or friction, changes with time."""
KICKS = 0
"""Number of effects that change velocities at one time."""
BOUNDARIES = 0
"""Number of effects with a boundary, beyond which other laws hold."""


def stage_state(y: Any, stages: Any, body: Any, stage: Any, h: Any, out: Any) -> None:
    """State of a body at which a stage of a step of length `h` from `y` is evaluated, from the earlier stages."""


def stage_state_vjp(before: Any, bars: Any, body: Any, stage: Any, h: Any) -> None:
    """Add the adjoint `before` of that state to those of the earlier stages."""


def dense_output(stages: Any, body: Any, h: Any, out: Any) -> None:
    """Write the polynomial of a step, constant term apart, from its stages."""


def dense_output_vjp(bar: Any, body: Any, h: Any, bars: Any) -> None:
    """Write the adjoints of the stages from that of the polynomial."""


def motion(t: Any, y: Any, phase: Any, body: Any, shared: Any, out: Any) -> None:
    """Time derivative of a body's state."""


def motion_vjp(
    t: Any, y: Any, phase: Any, body: Any, shared: Any, bar: Any, y_bar: Any, body_bar: Any, shared_bar: Any, t_bar: Any
) -> None:
    """Derivative of `motion`."""


def external(t: Any, y: Any, phase: Any, body: Any, shared: Any, out: Any) -> None:
    """Acceleration without dry friction (2 numbers), what dry friction can hold, and the deceleration of the spin."""


def pair_force(t: Any, ya: Any, yb: Any, body_a: Any, body_b: Any, shared: Any, out: Any) -> None:
    """Force (2 numbers, N) of the second body on the first."""


def pair_force_vjp(
    t: Any,
    ya: Any,
    yb: Any,
    body_a: Any,
    body_b: Any,
    shared: Any,
    bar: Any,
    ya_bar: Any,
    yb_bar: Any,
    body_a_bar: Any,
    body_b_bar: Any,
    shared_bar: Any,
    t_bar: Any,
) -> None:
    """Derivative of `pair_force`."""


def kick_time(which: Any, shared: Any) -> Any:
    """Time in s of a kick."""


def kick_time_vjp(which: Any, shared: Any, bar: Any, shared_bar: Any) -> None:
    """Derivative of `kick_time`."""


def kick(which: Any, t: Any, y: Any, body: Any, shared: Any, out: Any) -> None:
    """Write the change of a body's velocities (3 numbers)."""


def kick_vjp(
    which: Any, t: Any, y: Any, body: Any, shared: Any, bar: Any, y_bar: Any, body_bar: Any, shared_bar: Any, t_bar: Any
) -> None:
    """Derivative of `kick`."""


def boundary(which: Any, y: Any, body: Any, shared: Any) -> Any:
    """Number whose sign tells on which side of a boundary a body is."""


def boundary_rate(which: Any, y: Any, rate: Any, body: Any, shared: Any) -> Any:
    """Time derivative of `boundary` where the state changes at a rate."""


def boundary_vjp(
    which: Any, y: Any, body: Any, shared: Any, bar: Any, y_bar: Any, body_bar: Any, shared_bar: Any
) -> None:
    """Derivative of `boundary`."""


def contact_law(kind: Any, ya: Any, yb: Any, body_a: Any, body_b: Any, feature: Any, shared: Any, out: Any) -> None:
    """Write (vx, vy, spin) of both after a contact, closing speed, impulse, point (2), normal (2) and gap."""


def contact_law_vjp(
    kind: Any,
    ya: Any,
    yb: Any,
    body_a: Any,
    body_b: Any,
    feature: Any,
    shared: Any,
    bar: Any,
    ya_bar: Any,
    yb_bar: Any,
    body_a_bar: Any,
    body_b_bar: Any,
    shared_bar: Any,
) -> None:
    """Derivative of the six velocities after a contact."""


def gap_law_vjp(
    kind: Any,
    ya: Any,
    yb: Any,
    body_a: Any,
    body_b: Any,
    feature: Any,
    shared: Any,
    bar: Any,
    ya_bar: Any,
    yb_bar: Any,
    body_a_bar: Any,
    body_b_bar: Any,
    shared_bar: Any,
) -> None:
    """Derivative of the gap."""


def constraint_law(kind: Any, ya: Any, yb: Any, body_a: Any, body_b: Any, feature: Any, shared: Any, out: Any) -> None:
    """Write what keeps a gap: nine numbers.

    The gradient of the gap by (x, y, angle) of both, its second time derivative without accelerations, the way that is
    left until the contact passes to another feature, and the rate of that.
    """


def constraint_law_vjp(
    kind: Any,
    ya: Any,
    yb: Any,
    body_a: Any,
    body_b: Any,
    feature: Any,
    shared: Any,
    bar: Any,
    ya_bar: Any,
    yb_bar: Any,
    body_a_bar: Any,
    body_b_bar: Any,
    shared_bar: Any,
) -> None:
    """Derivative of all numbers of `constraint_law` but the last."""

"""Compiled: how kernels call the laws of a model, which are machine code of their own (see `machine_code.py`).

A model is an array of integers: what kind of model it is, then the addresses of its laws. So one kernel serves all
models, and a new one costs the compilation of its formulas only.

Arrays: `y` is a body's state (x, y, angle, vx, vy, spin and the rolling velocity, which means something in models with
slip only), `phase` its phase (see `motion_kernel.py`), `body` its constants and `shared` the parameters of the video. A
function ending in `_vjp` adds the vector-Jacobian product with `bar` to the arrays ending in `_bar`.
"""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: PLR0917

from numba import njit

from vrdp_prob.models.simulator.calls import call, call_for_number

compiled = njit(  # type: ignore[call-overload]  # numba's types leave these options out
    nogil=True, error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True, _nrt=False
)
"""How kernels are compiled: without the interpreter's lock; a division by zero gives inf or NaN, as in numpy.

They do not count references, which doubles the speed of short functions; so they must not make arrays, nor return
them. Numbers that choose a variant of a function are floats: of integers and truth values that are written down in a
call, numba compiles a variant each.
"""
STATE_SIZE = 8
"""Numbers in a body's state."""
AFTER_CONTACT = 5
"""Numbers of a body that a contact changes: the velocity, the spin and the rolling velocity, behind its position."""
# Entries of a model. Whether spheres may slip, so that their rolling velocity means something; whether contacts have
# friction, so that bodies which press do not move together but hop; whether forces act between bodies that do not
# touch, so that all of them move together; whether what pushes a body at rest, or friction, changes with time; how many
# effects change velocities at one time, and how many have a boundary, beyond which other laws hold.
SLIPS, RUBS, COUPLED, TIMED, KICKS, BOUNDARIES = 0, 1, 2, 3, 4, 5
# Addresses of single functions.
MOTION, MOTION_VJP, EXTERNAL, PAIR_FORCE, PAIR_FORCE_VJP = 6, 7, 8, 9, 10
STAGE_STATE, BODY_STAGES, BODY_STAGES_VJP, DENSE_OUTPUT, DENSE_OUTPUT_VJP, STEP_ERRORS = 11, 12, 13, 14, 15, 16
# Addresses of kernels that are compiled apart, see `apart_kernel.py`.
ADVANCE, ADD_FORCES, CHOOSE_CONTACTS, SEARCH_PAIR, DEPTH, BEGIN_CLUSTERS, RESTART = 17, 18, 19, 20, 21, 22, 23
END_PIECES, COLLIDE, LOAD_BLOCK, REVERSE_PIECES, REVERSE_EVENT = 24, 25, 26, 27, 28
# First addresses of functions of each kind of contact, then of each kick, then (behind all kicks) of each boundary.
CONTACT_LAW, CONTACT_LAW_VJP, GAP_LAW_VJP, CONSTRAINT_LAW, CONSTRAINT_LAW_VJP, FIRST_KICK = 29, 31, 33, 35, 37, 39
KICK_FUNCTIONS, BOUNDARY_FUNCTIONS = 4, 3


@compiled
def stage_state(model, y, stages, body, stage, h, out):
    """State of a body at which a stage of a step of length `h` from `y` is evaluated, from the earlier stages."""
    stride = stages.shape[1] * STATE_SIZE
    call(model[STAGE_STATE], y, stages[0, body], stride, stage, h, out)


@compiled
def body_stages(model, y, stages, phase, constants, shared, body, state, t, h, begin, end):
    """Stages `begin` to `end` of a step of one moving body from `y`, apart from forces of other bodies."""
    stride = stages.shape[1] * STATE_SIZE
    of_body = stages[0, body]
    call(model[BODY_STAGES], model[MOTION], y, of_body, state, phase, constants, shared, stride, t, h, begin, end)


@compiled
def body_stages_vjp(
    model,
    y,
    stages,
    phase,
    constants,
    shared,
    bars,
    before,
    y_bar,
    constants_bar,
    shared_bar,
    t_bar,
    body,
    state,
    t,
    h,
    begin,
    end,
    still,
):
    """Derivative of `body_stages`, from `begin` down to before `end`.

    `bars` are the adjoints of the stages; `before` holds what forces of other bodies add to that of the state at which
    the first is evaluated, and is cleared.
    """
    stride = stages.shape[1] * STATE_SIZE
    call(
        model[BODY_STAGES_VJP],
        model[MOTION_VJP],
        y,
        stages[0, body],
        state,
        phase,
        constants,
        shared,
        bars[0, body],
        before,
        y_bar,
        constants_bar,
        shared_bar,
        t_bar,
        stride,
        t,
        h,
        begin,
        end,
        still,
    )


@compiled
def dense_output(model, stages, body, h, out):
    """Write the polynomial of a step, constant term apart, from its stages."""
    call(model[DENSE_OUTPUT], stages[0, body], stages.shape[1] * STATE_SIZE, h, out)


@compiled
def dense_output_vjp(model, bar, body, h, bars):
    """Write the adjoints of the stages from that of the polynomial."""
    call(model[DENSE_OUTPUT_VJP], bar, h, bars[0, body], bars.shape[1] * STATE_SIZE)


@compiled
def step_errors(model, stages, body, out):
    """Write the estimates of the error of a step, of third and of fifth order, over its length."""
    call(model[STEP_ERRORS], stages[0, body], stages.shape[1] * STATE_SIZE, out)


@compiled
def motion(model, t, y, phase, body, shared, out):
    """Time derivative of a body's state."""
    call(model[MOTION], t, y, phase, body, shared, out)


@compiled
def external(model, t, y, phase, body, shared, out):
    """Acceleration without dry friction (2 numbers), what dry friction can hold, and the deceleration of the spin."""
    call(model[EXTERNAL], t, y, phase, body, shared, out)


@compiled
def pair_force(model, t, ya, yb, body_a, body_b, shared, out):
    """Force (2 numbers, N) of the second body on the first."""
    call(model[PAIR_FORCE], t, ya, yb, body_a, body_b, shared, out)


@compiled
def pair_force_vjp(
    model, t, ya, yb, body_a, body_b, shared, bar, ya_bar, yb_bar, body_a_bar, body_b_bar, shared_bar, t_bar
):
    """Derivative of `pair_force`."""
    address = model[PAIR_FORCE_VJP]
    call(address, t, ya, yb, body_a, body_b, shared, bar, ya_bar, yb_bar, body_a_bar, body_b_bar, shared_bar, t_bar)


@compiled
def kick_entry(which):
    """First entry of a kick."""
    return FIRST_KICK + KICK_FUNCTIONS * which


@compiled
def kick_time(model, which, shared):
    """Time in s of a kick."""
    return call_for_number(model[kick_entry(which)], shared)


@compiled
def kick_time_vjp(model, which, shared, bar, shared_bar):
    """Derivative of `kick_time`."""
    call(model[kick_entry(which) + 1], shared, bar, shared_bar)


@compiled
def kick(model, which, t, y, body, shared, out):
    """Write the change of a body's velocities (3 numbers)."""
    call(model[kick_entry(which) + 2], t, y, body, shared, out)


@compiled
def kick_vjp(model, which, t, y, body, shared, bar, y_bar, body_bar, shared_bar, t_bar):
    """Derivative of `kick`."""
    call(model[kick_entry(which) + 3], t, y, body, shared, bar, y_bar, body_bar, shared_bar, t_bar)


@compiled
def boundary_entry(model, which):
    """First entry of a boundary."""
    return kick_entry(model[KICKS]) + BOUNDARY_FUNCTIONS * which


@compiled
def boundary(model, which, y, body, shared):
    """Number whose sign tells on which side of a boundary a body is."""
    return call_for_number(model[boundary_entry(model, which)], y, body, shared)


@compiled
def boundary_rate(model, which, y, rate, body, shared):
    """Time derivative of `boundary` where the state changes at a rate."""
    return call_for_number(model[boundary_entry(model, which) + 1], y, rate, body, shared)


@compiled
def boundary_vjp(model, which, y, body, shared, bar, y_bar, body_bar, shared_bar):
    """Derivative of `boundary`."""
    call(model[boundary_entry(model, which) + 2], y, body, shared, bar, y_bar, body_bar, shared_bar)


@compiled
def contact_law(model, kind, ya, yb, body_a, body_b, feature, shared, out):
    """Write what both bodies do after a contact, closing speed, impulse, point (2), normal (2) and gap.

    Of each body these are the `AFTER_CONTACT` numbers (vx, vy, spin, rolling_x, rolling_y).
    """
    call(model[CONTACT_LAW + kind], ya, yb, body_a, body_b, feature, shared, out)


@compiled
def constraint_law(model, kind, ya, yb, body_a, body_b, feature, shared, out):
    """Write what keeps a gap: nine numbers.

    The gradient of the gap by (x, y, angle) of both, its second time derivative without accelerations, the way that is
    left until the contact passes to another feature, and the rate of that.
    """
    call(model[CONSTRAINT_LAW + kind], ya, yb, body_a, body_b, feature, shared, out)


@compiled
def contact_vjp(
    address, ya, yb, body_a, body_b, feature, shared, bar, ya_bar, yb_bar, body_a_bar, body_b_bar, shared_bar
):
    """Derivative of something of a contact: of both bodies' velocities after it, its gap, or what keeps its gap.

    The address is that of an entry `CONTACT_LAW_VJP`, `GAP_LAW_VJP` or `CONSTRAINT_LAW_VJP` (all but its last number).
    """
    call(address, ya, yb, body_a, body_b, feature, shared, bar, ya_bar, yb_bar, body_a_bar, body_b_bar, shared_bar)

"""Compiled reverse sweep over the events of a tape; what a piece of motion does is in `adjoint_kernel.py`."""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: PLR0917

from vrdp_prob.models.simulator.adjoint_kernel import (
    FLATTEST,
    OF_A,
    OF_B,
    ONE,
    RATE_A,
    VALUE_A,
    VALUE_B,
    VELOCITIES,
    clear,
    continue_legs,
    end_legs,
    fold_state,
    load,
    load_touches,
    product,
    read_frames,
    shift_of,
)
from vrdp_prob.models.simulator.apart_kernel import reverse_event_apart, reverse_pieces_apart
from vrdp_prob.models.simulator.cluster_kernel import (
    ROOM_RATE,
    cluster_of,
    constraint_bar_states,
    set_constraints,
)
from vrdp_prob.models.simulator.laws_kernel import (
    AFTER_CONTACT,
    CONTACT_LAW_VJP,
    GAP_LAW_VJP,
    STATE_SIZE,
    boundary_rate,
    boundary_vjp,
    compiled,
    contact_vjp,
    kick_time_vjp,
    kick_vjp,
)
from vrdp_prob.models.simulator.motion import ROLLING_SHARE
from vrdp_prob.models.simulator.motion_kernel import take_states
from vrdp_prob.models.simulator.tape_kernel import (
    BEFORE_FIRST,
    BEFORE_SECOND,
    BLOCK,
    BLOCK_PIECES,
    BLOCK_TOUCHES,
    CLOSING_SPEED,
    CONTACT,
    CONTACT_KIND,
    CONTINUE,
    CROSS,
    FEATURE,
    FIRST,
    FRAME_BEGIN,
    FRAME_END,
    HOLDS,
    KICK,
    KIND,
    PART,
    PIECE,
    PRESS,
    RELEASE,
    SECOND,
    SPIN_STOP,
    STOP,
    TIME,
)
from vrdp_prob.models.simulator.world_kernel import (
    FIXED,
    MOVING,
    PRESENT,
    REFERENCE_X,
    REFERENCE_Y,
    RELEASE_TIME,
    SLIPPING,
    clear_world,
    evaluate,
    roll_along,
    share_of,
)


@compiled
def reverse_release(world, adjoint, body, other, t):
    """The state with which a body is released, and its time; `other` is a body that moved on with it, or -1."""
    for c in range(STATE_SIZE):
        adjoint.start[body, c] += adjoint.state[body, c]
        adjoint.state[body, c] = 0.0
    adjoint.start[body, RELEASE_TIME] += adjoint.leg[body]
    adjoint.leg[body] = 0.0
    if other >= 0:
        cluster = cluster_of(world, other)
        adjoint.start[body, RELEASE_TIME] += shift_of(world, adjoint, cluster, t)
        end_legs(world, adjoint, cluster, t)


@compiled
def reverse_stop(world, adjoint, body, t):
    """A body stops, or begins to roll: what vanishes sets the time."""
    cluster = cluster_of(world, body)
    phase, bar = world.phase[body], adjoint.state[body]
    rolls = phase[MOVING] == SLIPPING
    if rolls:
        for c in range(2):
            both = bar[3 + c] + bar[6 + c]
            bar[3 + c], bar[6 + c] = ROLLING_SHARE * both, (1.0 - ROLLING_SHARE) * both
    else:
        bar[3], bar[4], bar[6], bar[7] = 0.0, 0.0, 0.0, 0.0
    of_time = shift_of(world, adjoint, cluster, t)
    product(world, adjoint, body, bar, t)
    rate = adjoint.local[RATE_A]
    x, y = phase[REFERENCE_X], phase[REFERENCE_Y]
    falling = rate[3] * x + rate[4] * y
    if rolls:
        falling -= rate[6] * x + rate[7] * y
    if abs(falling) > FLATTEST * (x * x + y * y):
        factor = -of_time / falling
        bar[3], bar[4] = bar[3] + factor * x, bar[4] + factor * y
        if rolls:
            bar[6], bar[7] = bar[6] - factor * x, bar[7] - factor * y
    end_legs(world, adjoint, cluster, t)


@compiled
def reverse_spin_stop(world, adjoint, body, t):
    """A body stops to spin: its spin vanishes."""
    cluster = cluster_of(world, body)
    bar = adjoint.state[body]
    bar[5] = 0.0
    of_time = shift_of(world, adjoint, cluster, t)
    product(world, adjoint, body, bar, t)
    rate = adjoint.local[RATE_A]
    if abs(rate[5]) > FLATTEST:
        bar[5] = -of_time / rate[5]
    end_legs(world, adjoint, cluster, t)


@compiled
def reverse_cross(world, adjoint, body, which, t):
    """A body crosses a boundary: what vanishes there sets the time."""
    cluster = cluster_of(world, body)
    bar, y = adjoint.state[body], adjoint.local[VALUE_A]
    of_time = shift_of(world, adjoint, cluster, t)
    product(world, adjoint, body, bar, t)
    evaluate(world.polynomial[body], share_of(world, body, t), y)
    rate = boundary_rate(world.model, which, y, adjoint.local[RATE_A], world.body[body], world.shared)
    if abs(rate) > FLATTEST:
        factor = -of_time / rate
        constants, shared = world.body[body], world.shared
        boundary_vjp(world.model, which, y, constants, shared, factor, bar, adjoint.body[body], adjoint.shared)
    end_legs(world, adjoint, cluster, t)


@compiled
def reverse_kick(world, adjoint, body, which, t):
    """A kick changes the velocities of a body at a time that the parameters set."""
    cluster = cluster_of(world, body)
    y, bar, of_body = adjoint.local[VALUE_A], adjoint.local[VELOCITIES], adjoint.local[OF_A]
    evaluate(world.polynomial[body], share_of(world, body, t), y)
    for c in range(STATE_SIZE):
        of_body[c] = 0.0
    for c in range(3):
        bar[c] = adjoint.state[body, 3 + c]
    one = adjoint.local[ONE]
    one[0] = 0.0
    constants, shared = world.body[body], world.shared
    kick_vjp(world.model, which, t, y, constants, shared, bar, of_body, adjoint.body[body], adjoint.shared, one)
    of_time = one[0] + product(world, adjoint, body, of_body, t) + shift_of(world, adjoint, cluster, t)
    kick_time_vjp(world.model, which, world.shared, of_time, adjoint.shared)
    for c in range(STATE_SIZE):
        adjoint.state[body, c] += of_body[c]
    end_legs(world, adjoint, cluster, t)


@compiled
def reverse_slide(world, adjoint, cluster, touch, t):
    """A contact slides off its feature, where the force jumps: its room on the feature vanishes."""
    bar = adjoint.constraint
    take_states(world, cluster, share_of(world, cluster, t))
    set_constraints(world, cluster)
    of_time = shift_of(world, adjoint, cluster, t)
    rate = world.touching[touch, ROOM_RATE]
    if abs(rate) > FLATTEST:
        for c in range(7):
            bar[c] = 0.0
        bar[7] = -of_time / rate
        constraint_bar_states(world, adjoint, touch, adjoint.state)
    end_legs(world, adjoint, cluster, t)


@compiled
def take_velocities(world, adjoint, body, of_body, bar):
    """Move the adjoints of a body's state after a contact: positions pass through, velocities go to the law."""
    for c in range(STATE_SIZE):
        of_body[c] = 0.0
    for c in range(AFTER_CONTACT):
        bar[c] = 0.0
    if not world.kind[body, FIXED]:
        for c in range(AFTER_CONTACT):
            bar[c] = adjoint.state[body, 3 + c]
            adjoint.state[body, 3 + c] = 0.0


@compiled
def give_back(world, adjoint, body, of_body):
    """Add what the laws of a contact say to the adjoint of a body's state before it."""
    for c in range(STATE_SIZE):
        if world.kind[body, FIXED]:
            adjoint.start[body, c] += of_body[c]
        else:
            adjoint.state[body, c] += of_body[c]


@compiled
def reverse_contact(world, adjoint, kind, a, b, together, numbers, t):
    """A contact: the gap vanishes, the laws give the velocities after it; `together` in one cluster before it."""
    ya, yb = adjoint.local[VALUE_A], adjoint.local[VALUE_B]
    of_a, of_b, bar, one = adjoint.local[OF_A], adjoint.local[OF_B], adjoint.local[VELOCITIES], adjoint.local[ONE]
    evaluate(world.polynomial[a], share_of(world, a, t), ya)
    evaluate(world.polynomial[b], share_of(world, b, t), yb)
    roll_along(world, a, ya)
    roll_along(world, b, yb)
    feature = numbers[FEATURE : FEATURE + 7]
    take_velocities(world, adjoint, a, of_a, bar[0:AFTER_CONTACT])
    take_velocities(world, adjoint, b, of_b, bar[AFTER_CONTACT : 2 * AFTER_CONTACT])
    body, shared = adjoint.body, adjoint.shared
    law, gap = world.model[CONTACT_LAW_VJP + kind], world.model[GAP_LAW_VJP + kind]
    contact_vjp(
        law, ya, yb, world.body[a], world.body[b], feature, world.shared, bar, of_a, of_b, body[a], body[b], shared
    )
    fold_state(world, a, of_a)
    fold_state(world, b, of_b)
    of_time = product(world, adjoint, a, of_a, t) + product(world, adjoint, b, of_b, t)
    of_first = not world.kind[a, FIXED]
    of_second = not world.kind[b, FIXED] and not (of_first and together)
    if of_first:
        of_time += shift_of(world, adjoint, cluster_of(world, a), t)
    if of_second:
        of_time += shift_of(world, adjoint, cluster_of(world, b), t)
    one[0] = of_time / numbers[CLOSING_SPEED]
    contact_vjp(
        gap, ya, yb, world.body[a], world.body[b], feature, world.shared, one, of_a, of_b, body[a], body[b], shared
    )
    give_back(world, adjoint, a, of_a)
    give_back(world, adjoint, b, of_b)
    if of_first:
        end_legs(world, adjoint, cluster_of(world, a), t)
    if of_second:
        end_legs(world, adjoint, cluster_of(world, b), t)


@compiled
def read_unreleased(world, adjoint, tape):
    """Before its release, or where it is removed, a body shows the state of its release."""
    for body in range(tape.trajectory.shape[1]):
        for frame in range(tape.times.shape[0]):
            if world.kind[body, PRESENT] and tape.times[frame] >= world.start[body, RELEASE_TIME]:
                break
            for c in range(3):
                adjoint.start[body, c] += tape.trajectory[frame, body, c]
                if tape.velocity.shape[0] > 0:
                    adjoint.start[body, 3 + c] += tape.velocity[frame, body, c]


@compiled
def reverse_world(world, adjoint, tape, begin, end):
    """Read the tape of a world, its rows from `begin` to `end`, backwards."""
    clear_world(world)
    read_unreleased(world, adjoint, tape)
    clear_adjoint(adjoint)
    for row in range(end - 1, begin - 1, -1):
        entry = tape.integers[row]
        kind, first = entry[KIND], entry[FIRST]
        if kind == PIECE:
            load(world, adjoint, tape, row)
            read_frames(world, adjoint, tape, first, entry[FRAME_BEGIN], entry[FRAME_END])
            if entry[BLOCK] == row:
                reverse_pieces_apart(world, adjoint, tape, row)
        elif kind != PRESS:
            before, other = entry[BEFORE_FIRST], entry[BEFORE_SECOND]
            if before >= 0:
                load(world, adjoint, tape, before)
            if other >= 0:
                load(world, adjoint, tape, other)
            reverse_event_apart(world, adjoint, tape, row)


@compiled
def clear_adjoint(adjoint):
    """Nothing read yet."""
    clear(adjoint.state)
    clear(adjoint.before)
    for body in range(adjoint.leg.shape[0]):
        adjoint.leg[body], adjoint.loaded[body] = 0.0, -1
        clear(adjoint.polynomial[body])


@compiled
def reverse_event(world, adjoint, tape, row):
    """Pass the adjoints of the states after an event on to those before it; the pieces that it ended are loaded."""
    entry = tape.integers[row]
    kind, first, second, t = entry[KIND], entry[FIRST], entry[SECOND], tape.numbers[row, TIME]
    before, other = entry[BEFORE_FIRST], entry[BEFORE_SECOND]
    if kind == CONTINUE or (kind == PART and entry[HOLDS] < 0):
        continue_legs(world, adjoint, cluster_of(world, first), t)
    elif kind == RELEASE:
        reverse_release(world, adjoint, first, second, t)
    elif kind == STOP:
        reverse_stop(world, adjoint, first, t)
    elif kind == SPIN_STOP:
        reverse_spin_stop(world, adjoint, first, t)
    elif kind == CROSS:
        reverse_cross(world, adjoint, first, second, t)
    elif kind == KICK:
        reverse_kick(world, adjoint, first, second, t)
    elif kind == PART:
        # Takes the contacts of the pieces that end here as those at hand; nothing else reads them until others are.
        block = tape.integers[before, BLOCK]
        touches = tape.integers[block, BLOCK_TOUCHES]
        load_touches(world, tape, block + tape.integers[block, BLOCK_PIECES], touches)
        reverse_slide(world, adjoint, cluster_of(world, first), entry[HOLDS], t)
    elif kind == CONTACT:
        together = before >= 0 and other >= 0 and tape.integers[before, BLOCK] == tape.integers[other, BLOCK]
        reverse_contact(world, adjoint, entry[CONTACT_KIND], first, second, together, tape.numbers[row], t)

"""Compiled reverse sweep over the events of a tape; what a piece of motion does is in `adjoint_kernel.py`."""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: PLR0912, PLR0917
from vrdp_prob.models.simulator.adjoint_kernel import (
    FLATTEST,
    OF_A,
    OF_B,
    ONE,
    RATE_A,
    RATE_B,
    VALUE_A,
    VALUE_B,
    VELOCITIES,
    end_leg,
    load,
    read_frames,
    reverse_piece,
    shift_of,
)
from vrdp_prob.models.simulator.laws_kernel import (
    GROUP_SIZE,
    SLIPS,
    STATE_SIZE,
    compiled,
    contact_law_vjp,
    gap_law_vjp,
)
from vrdp_prob.models.simulator.tableau import DENSE
from vrdp_prob.models.simulator.tape_kernel import (
    BEFORE_FIRST,
    BEFORE_SECOND,
    CLOSING_SPEED,
    CONTACT,
    CONTACT_KIND,
    CONTINUE,
    FEATURE,
    FIRST,
    FRAME_BEGIN,
    FRAME_END,
    KIND,
    PIECE,
    RELEASE,
    SECOND,
    SPIN_STOP,
    STOP,
    TIME,
)
from vrdp_prob.models.simulator.world_kernel import (
    FIXED,
    LENGTH,
    MOVING,
    ORIGIN,
    PRESENT,
    REFERENCE_X,
    REFERENCE_Y,
    RELEASE_TIME,
    SLIPPING,
    evaluate,
    evaluate_rate,
    share_of,
)


@compiled
def reverse_continue(adjoint, group):
    """The next piece of a leg begins where the one before ends."""
    for slot in range(GROUP_SIZE):
        for c in range(STATE_SIZE):
            for power in range(DENSE.shape[0]):
                adjoint.polynomial[group, power, slot, c] += adjoint.state[group, slot, c]


@compiled
def reverse_release(world, adjoint, body, t, has_before):
    """The state with which a body is released, and its time."""
    group = body // GROUP_SIZE
    slot = body - group * GROUP_SIZE
    for c in range(STATE_SIZE):
        adjoint.start[body, c] += adjoint.state[group, slot, c]
        adjoint.state[group, slot, c] = 0.0
    adjoint.start[body, RELEASE_TIME] += adjoint.leg[group]
    adjoint.leg[group] = 0.0
    if has_before:
        adjoint.start[body, RELEASE_TIME] += shift_of(world, adjoint, group, t)
        end_leg(world, adjoint, group, t)


@compiled
def reverse_stop(world, adjoint, body, t):
    """A body stops, or begins to roll: what vanishes sets the time."""
    group = body // GROUP_SIZE
    slot = body - group * GROUP_SIZE
    phase = world.phase[body]
    bar = adjoint.state[group, slot]
    rolls = SLIPS and phase[MOVING] == SLIPPING
    if rolls:
        bar[3], bar[4] = bar[3] + bar[6], bar[4] + bar[7]
        bar[6], bar[7] = 0.0, 0.0
    else:
        bar[3], bar[4] = 0.0, 0.0
    of_time = adjoint.leg[group] + shift_of(world, adjoint, group, t)
    rate = adjoint.local[RATE_A]
    evaluate_rate(world.polynomial[group], slot, share_of(world, group, t), world.clock[group, LENGTH], rate)
    x, y = phase[REFERENCE_X], phase[REFERENCE_Y]
    falling = rate[3] * x + rate[4] * y
    if rolls:
        falling -= rate[6] * x + rate[7] * y
    if abs(falling) > FLATTEST * (x * x + y * y):
        factor = -of_time / falling
        bar[3], bar[4] = bar[3] + factor * x, bar[4] + factor * y
        if rolls:
            bar[6], bar[7] = bar[6] - factor * x, bar[7] - factor * y
    end_leg(world, adjoint, group, t)


@compiled
def reverse_spin_stop(world, adjoint, body, t):
    """A body stops to spin: its spin vanishes."""
    group = body // GROUP_SIZE
    slot = body - group * GROUP_SIZE
    bar = adjoint.state[group, slot]
    bar[5] = 0.0
    of_time = adjoint.leg[group] + shift_of(world, adjoint, group, t)
    rate = adjoint.local[RATE_A]
    evaluate_rate(world.polynomial[group], slot, share_of(world, group, t), world.clock[group, LENGTH], rate)
    if abs(rate[5]) > FLATTEST:
        bar[5] = -of_time / rate[5]
    end_leg(world, adjoint, group, t)


@compiled
def take_velocities(world, adjoint, body, of_body, bar):
    """Move the adjoints of a body's state after a contact: positions pass through, velocities go to the law."""
    group = body // GROUP_SIZE
    slot = body - group * GROUP_SIZE
    for c in range(STATE_SIZE):
        of_body[c] = 0.0
    for c in range(3):
        bar[c] = 0.0
    if not world.kind[body, FIXED]:
        for c in range(3):
            bar[c] = adjoint.state[group, slot, 3 + c]
            adjoint.state[group, slot, 3 + c] = 0.0


@compiled
def give_back(world, adjoint, body, of_body, t):
    """Add what the laws of a contact say to the adjoint of a body's state before it."""
    group = body // GROUP_SIZE
    slot = body - group * GROUP_SIZE
    for c in range(STATE_SIZE):
        if world.kind[body, FIXED]:
            adjoint.polynomial[group, 0, slot, c] += of_body[c]
        else:
            adjoint.state[group, slot, c] += of_body[c]


@compiled
def product(world, adjoint, body, of_body, t):
    """Product of an adjoint of a body's state with its rate before a contact."""
    group = body // GROUP_SIZE
    rate = adjoint.local[RATE_B]
    share = share_of(world, group, t)
    evaluate_rate(world.polynomial[group], body - group * GROUP_SIZE, share, world.clock[group, LENGTH], rate)
    total = 0.0
    for c in range(STATE_SIZE):
        total += of_body[c] * rate[c]
    return total


@compiled
def reverse_contact(world, adjoint, kind, a, b, numbers, t):
    """A contact: the gap vanishes, the laws give the velocities after it."""
    group_a, group_b = a // GROUP_SIZE, b // GROUP_SIZE
    ya, yb = adjoint.local[VALUE_A], adjoint.local[VALUE_B]
    of_a, of_b, bar, one = adjoint.local[OF_A], adjoint.local[OF_B], adjoint.local[VELOCITIES], adjoint.local[ONE]
    evaluate(world.polynomial[group_a], a - group_a * GROUP_SIZE, share_of(world, group_a, t), ya)
    evaluate(world.polynomial[group_b], b - group_b * GROUP_SIZE, share_of(world, group_b, t), yb)
    feature = numbers[FEATURE : FEATURE + 7]
    take_velocities(world, adjoint, a, of_a, bar[0:3])
    take_velocities(world, adjoint, b, of_b, bar[3:6])
    body, shared = adjoint.body, adjoint.shared
    contact_law_vjp(
        kind, ya, yb, world.body[a], world.body[b], feature, world.shared, bar, of_a, of_b, body[a], body[b], shared
    )
    of_time = product(world, adjoint, a, of_a, t) + product(world, adjoint, b, of_b, t)
    if not world.kind[a, FIXED]:
        of_time += adjoint.leg[group_a] + shift_of(world, adjoint, group_a, t)
    if not world.kind[b, FIXED] and group_a != group_b:
        of_time += adjoint.leg[group_b] + shift_of(world, adjoint, group_b, t)
    one[0] = of_time / numbers[CLOSING_SPEED]
    gap_law_vjp(
        kind, ya, yb, world.body[a], world.body[b], feature, world.shared, one, of_a, of_b, body[a], body[b], shared
    )
    give_back(world, adjoint, a, of_a, t)
    give_back(world, adjoint, b, of_b, t)
    if not world.kind[a, FIXED]:
        end_leg(world, adjoint, group_a, t)
    if not world.kind[b, FIXED] and group_a != group_b:
        end_leg(world, adjoint, group_b, t)


@compiled
def read_unreleased(world, adjoint, times, states_bar):
    """Before its release, or where it is removed, a body shows the state of its release."""
    for frame in range(times.shape[0]):
        for body in range(world.kind.shape[0]):
            if not world.kind[body, PRESENT] or times[frame] < world.start[body, RELEASE_TIME]:
                for c in range(STATE_SIZE):
                    adjoint.start[body, c] += states_bar[frame, body, c]


@compiled
def reverse_world(world, adjoint, integers, numbers, times, states_bar):
    """Read the tape of a world backwards."""
    read_unreleased(world, adjoint, times, states_bar)
    for group in range(adjoint.leg.shape[0]):
        adjoint.leg[group], adjoint.loaded[group] = 0.0, -1
        for slot in range(GROUP_SIZE):
            for c in range(STATE_SIZE):
                adjoint.state[group, slot, c] = 0.0
                for power in range(DENSE.shape[0]):
                    adjoint.polynomial[group, power, slot, c] = 0.0
    for row in range(integers.shape[0] - 1, -1, -1):
        entry = integers[row]
        kind, first, second, t = entry[KIND], entry[FIRST], entry[SECOND], numbers[row, TIME]
        if kind == PIECE:
            load(world, adjoint, integers, numbers, first, row)
            read_frames(world, adjoint, first, entry[FRAME_BEGIN], entry[FRAME_END], times, states_bar)
            reverse_piece(world, adjoint, first, world.clock[first, ORIGIN])
            continue
        if entry[BEFORE_FIRST] >= 0:
            load(world, adjoint, integers, numbers, first // GROUP_SIZE, entry[BEFORE_FIRST])
        if entry[BEFORE_SECOND] >= 0:
            load(world, adjoint, integers, numbers, second // GROUP_SIZE, entry[BEFORE_SECOND])
        if kind == CONTINUE:
            reverse_continue(adjoint, first // GROUP_SIZE)
        elif kind == RELEASE:
            reverse_release(world, adjoint, first, t, entry[BEFORE_FIRST] >= 0)
        elif kind == STOP:
            reverse_stop(world, adjoint, first, t)
        elif kind == SPIN_STOP:
            reverse_spin_stop(world, adjoint, first, t)
        elif kind == CONTACT:
            reverse_contact(world, adjoint, entry[CONTACT_KIND], first, second, numbers[row], t)

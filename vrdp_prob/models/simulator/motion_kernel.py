"""Compiled motion between events: one Runge-Kutta step of a group of bodies, and its polynomial."""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: PLR0917

import math

import numpy as np

from vrdp_prob.models.simulator.laws_kernel import GROUP_SIZE, SLIPS, STATE_SIZE, compiled, external, motion
from vrdp_prob.models.simulator.tableau import DENSE, ERRORS, NODES, WEIGHTS
from vrdp_prob.models.simulator.world_kernel import (
    ALIVE,
    CONTINUES,
    ENDING,
    ENDING_BODY,
    FIXED,
    LENGTH,
    MOVING,
    ORIGIN,
    REFERENCE_X,
    REFERENCE_Y,
    RESTING,
    SLIDING,
    SLIPPING,
    SPIN_SENSE,
    SPIN_STOPS,
    STEP,
    STOPS,
    TRAVEL,
    UNTIL,
    evaluate,
    hold,
)

TOLERANCE = 1e-11
"""Error of one step, in m, m/s, rad and rad/s."""
SMALLEST_STEP = 1e-12
"""Step in s below which the motion counts as not solvable."""
VANISHED = 1e-7
"""Speed in m/s across the direction of motion below which a body at its turning point rests."""
SLOWEST = 1e-10
"""Speed in m/s (or rad/s) below which a body rests, and with which it starts when a force moves it."""
STAGES = WEIGHTS.shape[0]
IS_SPHERE = 5


@compiled
def derivatives(world, group, t, stage):
    """Time derivative of all bodies of a group at the state in the work row, into the row of a stage."""
    first = group * GROUP_SIZE
    for slot in range(GROUP_SIZE):
        phase = world.phase[first + slot]
        out = world.stages[stage, slot]
        if phase[MOVING] == RESTING and phase[SPIN_SENSE] == 0.0:
            for c in range(STATE_SIZE):
                out[c] = 0.0
        else:
            motion(t, world.stages[STAGES, slot], phase, world.body[first + slot], world.shared, out)


@compiled
def stage_state(world, group, stage, h):
    """State at which a stage is evaluated, into the work row."""
    for slot in range(GROUP_SIZE):
        out = world.stages[STAGES, slot]
        for c in range(STATE_SIZE):
            out[c] = world.polynomial[group, 0, slot, c]
        for earlier in range(stage):
            weight = h * WEIGHTS[stage, earlier]
            if weight != 0.0:
                for c in range(STATE_SIZE):
                    out[c] += weight * world.stages[earlier, slot, c]


@compiled
def compute_stages(world, group, t, h, begin, end):
    """Stages `begin` to `end` of a step from the state in the polynomial's constant term."""
    for stage in range(begin, end):
        stage_state(world, group, stage, h)
        derivatives(world, group, t + NODES[stage] * h, stage)


@compiled
def step_error(stages, h):
    """Error of a step relative to the tolerance (Hairer's combination of two estimates)."""
    worst = 0.0
    for slot in range(GROUP_SIZE):
        for c in range(STATE_SIZE):
            third, fifth = 0.0, 0.0
            for stage in range(12):
                if ERRORS[1, stage] != 0.0:
                    third += ERRORS[0, stage] * stages[stage, slot, c]
                    fifth += ERRORS[1, stage] * stages[stage, slot, c]
            scale = math.sqrt(fifth * fifth + 0.01 * third * third)
            if not math.isfinite(scale):
                return math.inf
            if scale > 0.0:
                worst = max(worst, abs(h) * fifth * fifth / (scale * TOLERANCE))
    return worst


@compiled
def set_polynomial(world, group, h):
    """Turn the stages of a step into the polynomial of its motion."""
    for power in range(1, DENSE.shape[0]):
        for slot in range(GROUP_SIZE):
            out = world.polynomial[group, power, slot]
            for c in range(STATE_SIZE):
                out[c] = 0.0
            for stage in range(STAGES):
                weight = h * DENSE[power, stage]
                if weight != 0.0:
                    for c in range(STATE_SIZE):
                        out[c] += weight * world.stages[stage, slot, c]
    note_travel(world, group)


@compiled
def note_travel(world, group):
    """Bound how far each body of a group comes from where its piece begins."""
    for slot in range(GROUP_SIZE):
        x, y = 0.0, 0.0
        for power in range(1, DENSE.shape[0]):
            x += abs(world.polynomial[group, power, slot, 0])
            y += abs(world.polynomial[group, power, slot, 1])
        world.phase[group * GROUP_SIZE + slot, TRAVEL] = math.hypot(x, y)


@compiled
def along(polynomial, slot, phase, share):
    """What vanishes when a body stops (its velocity along the reference direction) or begins to roll (its slip)."""
    total = 0.0
    slipping = SLIPS and phase[MOVING] == SLIPPING
    for power in range(polynomial.shape[0] - 1, -1, -1):
        coefficients = polynomial[power, slot]
        x, y = coefficients[3], coefficients[4]
        if slipping:
            x, y = x - coefficients[6], y - coefficients[7]
        total = total * share + x * phase[REFERENCE_X] + y * phase[REFERENCE_Y]
    return total


@compiled
def spin_along(polynomial, slot, phase, share):
    """What vanishes when a spinning body stops to spin."""
    total = 0.0
    for power in range(polynomial.shape[0] - 1, -1, -1):
        total = total * share + polynomial[power, slot, 5] * phase[SPIN_SENSE]
    return total


@compiled
def vanishing_share(polynomial, slot, phase, of_spin):
    """Share of the step at which `along` (or `spin_along`) falls to zero, by bisection to the last digit."""
    low, high = 0.0, 1.0
    while True:
        middle = 0.5 * (low + high)
        if middle <= low or middle >= high:
            return high
        value = spin_along(polynomial, slot, phase, middle) if of_spin else along(polynomial, slot, phase, middle)
        if value > 0.0:
            low = middle
        else:
            high = middle


@compiled
def settle(world, body, t, y):
    """Set the phase of a body from its state; a resting body stays while friction can hold it."""
    phase = world.phase[body]
    for c in range(ALIVE):
        phase[c] = 0.0
    if world.kind[body, FIXED]:
        return
    push = np.empty(4)
    external(t, y, phase, world.body[body], world.shared, push)
    # What no friction holds at rest counts as moving with speed 0: its derivative by the velocity does not vanish.
    if abs(y[5]) > SLOWEST or push[3] == 0.0:
        phase[SPIN_SENSE] = math.copysign(1.0, y[5])
    else:
        y[5] = 0.0
    if SLIPS:
        slip = math.hypot(y[3] - y[6], y[4] - y[7])
        if world.body[body, IS_SPHERE] != 0.0 and slip > SLOWEST:
            phase[MOVING] = SLIPPING
            return
        y[6], y[7] = y[3], y[4]
    phase[MOVING] = SLIDING
    if math.hypot(y[3], y[4]) > SLOWEST:
        return
    y[3], y[4] = 0.0, 0.0
    external(t, y, phase, world.body[body], world.shared, push)
    size = math.hypot(push[0], push[1])
    if size > push[2]:
        y[3], y[4] = SLOWEST * push[0] / size, SLOWEST * push[1] / size
    elif push[2] > 0.0:
        phase[MOVING] = RESTING
    if SLIPS:
        y[6], y[7] = y[3], y[4]


@compiled
def set_references(world, group):
    """Take the velocities (or slips) at the start of a piece as reference directions."""
    for slot in range(GROUP_SIZE):
        phase = world.phase[group * GROUP_SIZE + slot]
        y = world.polynomial[group, 0, slot]
        if phase[MOVING] != RESTING:
            phase[REFERENCE_X], phase[REFERENCE_Y] = y[3], y[4]
        if SLIPS and phase[MOVING] == SLIPPING:
            phase[REFERENCE_X], phase[REFERENCE_Y] = y[3] - y[6], y[4] - y[7]


@compiled
def first_step(world, group, h):
    """Limit a step to a little more than the time in which friction stops the first body."""
    for slot in range(GROUP_SIZE):
        phase = world.phase[group * GROUP_SIZE + slot]
        x, y = world.stages[0, slot, 3], world.stages[0, slot, 4]
        if SLIPS and phase[MOVING] == SLIPPING:
            x, y = x - world.stages[0, slot, 6], y - world.stages[0, slot, 7]
        braking = -(x * phase[REFERENCE_X] + y * phase[REFERENCE_Y])
        square = phase[REFERENCE_X] ** 2 + phase[REFERENCE_Y] ** 2
        if phase[MOVING] != RESTING and braking > 0.0 and h * braking > 1.25 * square:
            h = 1.25 * square / braking
    return h


@compiled
def cut(world, group, share, root, ending, body):
    """Let a piece end at a root if nothing ended it before; returns the share at which it ends."""
    if root >= share and world.clock[group, ENDING] != CONTINUES:
        return share
    world.clock[group, ENDING], world.clock[group, ENDING_BODY] = ending, body
    return root


@compiled
def find_ending(world, group):
    """Share of the step at which a body of the group first stops to move or to spin, 1 where none does."""
    polynomial = world.polynomial[group]
    share = 1.0
    world.clock[group, ENDING] = CONTINUES
    for slot in range(GROUP_SIZE):
        body = group * GROUP_SIZE + slot
        phase = world.phase[body]
        spins = phase[SPIN_SENSE] != 0.0 and polynomial[0, slot, 5] != 0.0
        if spins and spin_along(polynomial, slot, phase, 1.0) <= 0.0:
            share = cut(world, group, share, vanishing_share(polynomial, slot, phase, True), SPIN_STOPS, body)
        moves = phase[REFERENCE_X] != 0.0 or phase[REFERENCE_Y] != 0.0
        if moves and along(polynomial, slot, phase, 1.0) <= 0.0:
            share = cut(world, group, share, vanishing_share(polynomial, slot, phase, False), STOPS, body)
    return share


@compiled
def really_stops(world, group, share):
    """Whether the velocity (or slip) vanishes where its part along the reference direction does."""
    if world.clock[group, ENDING] != STOPS:
        return True
    body = int(world.clock[group, ENDING_BODY])
    slot = body - group * GROUP_SIZE
    y = world.stages[STAGES, slot]
    evaluate(world.polynomial[group], slot, share, y)
    if SLIPS and world.phase[body, MOVING] == SLIPPING:
        return math.hypot(y[3] - y[6], y[4] - y[7]) <= VANISHED
    return math.hypot(y[3], y[4]) <= VANISHED


@compiled
def is_still(world, group):
    """Whether no body of a group moves or spins."""
    for slot in range(GROUP_SIZE):
        phase = world.phase[group * GROUP_SIZE + slot]
        if phase[MOVING] != RESTING or phase[SPIN_SENSE] != 0.0:
            return False
    return True


@compiled
def begin_step(world, group, t):
    """First stage of a step."""
    set_references(world, group)
    compute_stages(world, group, t, 0.0, 0, 1)


@compiled
def advance(world, group, t, horizon):
    """Compute the next piece of motion of a group from the state in its constant term; False where that fails."""
    if is_still(world, group):
        hold(world, group, t)
        return True
    clock = world.clock[group]
    begin_step(world, group, t)
    h = first_step(world, group, min(clock[STEP], max(horizon - t, SMALLEST_STEP)))
    while h >= SMALLEST_STEP:
        compute_stages(world, group, t, h, 1, 12)
        error = step_error(world.stages, h)
        if error <= 1.0:
            compute_stages(world, group, t, h, 12, STAGES)
            set_polynomial(world, group, h)
            share = find_ending(world, group)
            if really_stops(world, group, share):
                clock[ORIGIN], clock[LENGTH], clock[UNTIL] = t, h, t + share * h
                clock[STEP] = h * min(5.0, 0.9 * max(error, 1e-9) ** (-0.125))
                return True
            h *= 0.5 * max(share, 0.1)
        else:
            h *= max(0.1, 0.9 * error ** (-0.125))
    hold(world, group, t)
    return False

"""Compiled motion between events: a Runge-Kutta step of a cluster of bodies, and its polynomial."""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: PLR0917

import math

import numpy as np

from vrdp_prob.models.simulator.cluster_kernel import (
    constrain,
    presses,
    set_constraints,
)
from vrdp_prob.models.simulator.laws_kernel import GROUP_SIZE, SLIPS, STATE_SIZE, compiled, external, motion
from vrdp_prob.models.simulator.tableau import DENSE, ERRORS, NODES, WEIGHTS
from vrdp_prob.models.simulator.world_kernel import (
    ALIVE,
    CONTINUES,
    ENDING,
    ENDING_BODY,
    FIXED,
    MOVING,
    PUSH,
    REFERENCE_X,
    REFERENCE_Y,
    RESTING,
    SLIDING,
    SLIPPING,
    SPIN_SENSE,
    SPIN_STOPS,
    STAGES,
    STOPS,
    TRAVEL,
    WORK,
    evaluate,
)

TOLERANCE = 1e-11
"""Error of one step, in m, m/s, rad and rad/s."""
VANISHED = 1e-7
"""Speed in m/s across the direction of motion below which a body at its turning point rests."""
LINGERING = 1e-6
"""Speed in m/s below which a body stops that moves with others.

The force of the others turns its motion ever faster while it slows down, which would take many short steps.
"""
SLOWEST = 1e-10
"""Speed in m/s (or rad/s) below which a body rests, and with which it starts when a force moves it."""
IS_SPHERE = 5
PARTS_OF_STEP = np.array([0, 1, 12, STAGES])
"""First stages of the parts of a step: its beginning, what its error needs, and its polynomial; and the last and one.

An array, because numba compiles a variant of a function for every integer that is written down in a call.
"""


@compiled
def derivatives(world, group, t, rates):
    """Time derivatives of the bodies of a group without lasting contacts, at the states at hand, into `rates`."""
    for body in range(group * GROUP_SIZE, (group + 1) * GROUP_SIZE):
        phase = world.phase[body]
        out = rates[body]
        if phase[MOVING] == RESTING and phase[SPIN_SENSE] == 0.0:
            for c in range(STATE_SIZE):
                out[c] = 0.0
        else:
            motion(t, world.stages[WORK, body], phase, world.body[body], world.shared, out)


@compiled
def cluster_derivatives(world, cluster, t, rates):
    """Time derivative of all bodies of a cluster at the states in the work row, into `rates`."""
    for place in range(world.members[cluster, 0]):
        derivatives(world, world.members[cluster, 1 + place], t, rates)
    if presses(world, cluster):
        set_constraints(world, cluster)
        constrain(world, cluster, rates, 1.0)


@compiled
def stage_state(world, group, stage, h):
    """State at which a stage is evaluated, into the work row."""
    for slot in range(GROUP_SIZE):
        body = group * GROUP_SIZE + slot
        out = world.stages[WORK, body]
        for c in range(STATE_SIZE):
            out[c] = world.polynomial[group, 0, slot, c]
        for earlier in range(stage):
            weight = h * WEIGHTS[stage, earlier]
            if weight != 0.0:
                for c in range(STATE_SIZE):
                    out[c] += weight * world.stages[earlier, body, c]


@compiled
def stage_states(world, cluster, stage, h):
    """States of a cluster at which a stage is evaluated, into the work row."""
    for place in range(world.members[cluster, 0]):
        stage_state(world, world.members[cluster, 1 + place], stage, h)


@compiled
def compute_stages(world, cluster, t, h, begin, end):
    """Stages `begin` to `end` of a step from the states in the polynomials' constant terms."""
    for stage in range(begin, end):
        stage_states(world, cluster, stage, h)
        cluster_derivatives(world, cluster, t + NODES[stage] * h, world.stages[stage])


@compiled
def take_states(world, cluster, share):
    """States of the bodies of a cluster at a share of their pieces, into the work row."""
    for place in range(world.members[cluster, 0]):
        group = world.members[cluster, 1 + place]
        for slot in range(GROUP_SIZE):
            evaluate(world.polynomial[group], slot, share, world.stages[WORK, group * GROUP_SIZE + slot])


@compiled
def match_velocities(world, cluster):
    """Take the velocities at which gaps change from the states with which a piece begins."""
    if presses(world, cluster):
        take_states(world, cluster, 0.0)
        set_constraints(world, cluster)
        constrain(world, cluster, world.stages[WORK], 0.0)
        for place in range(world.members[cluster, 0]):
            group = world.members[cluster, 1 + place]
            for slot in range(GROUP_SIZE):
                for c in range(3, 6):
                    world.polynomial[group, 0, slot, c] = world.stages[WORK, group * GROUP_SIZE + slot, c]


@compiled
def step_error(world, group, h):
    """Error of a step relative to the tolerance (Hairer's combination of two estimates)."""
    worst = 0.0
    for body in range(group * GROUP_SIZE, (group + 1) * GROUP_SIZE):
        for c in range(STATE_SIZE):
            third, fifth = 0.0, 0.0
            for stage in range(12):
                if ERRORS[1, stage] != 0.0:
                    third += ERRORS[0, stage] * world.stages[stage, body, c]
                    fifth += ERRORS[1, stage] * world.stages[stage, body, c]
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
                        out[c] += weight * world.stages[stage, group * GROUP_SIZE + slot, c]
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
def vanishing_share(polynomial, slot, phase, of_spin, least):
    """Share of the step at which `along` (or `spin_along`) falls to `least`, by bisection to the last digit."""
    low, high = 0.0, 1.0
    while True:
        middle = 0.5 * (low + high)
        if middle <= low or middle >= high:
            return high
        if of_spin != 0.0:
            value = spin_along(polynomial, slot, phase, middle)
        else:
            value = along(polynomial, slot, phase, middle)
        if value > least:
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
    push = world.stages[PUSH, body]
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
def first_step(world, group, h, most):
    """Limit a step to a multiple of the time in which friction stops the first body."""
    for body in range(group * GROUP_SIZE, (group + 1) * GROUP_SIZE):
        phase, rate = world.phase[body], world.stages[0, body]
        x, y = rate[3], rate[4]
        if SLIPS and phase[MOVING] == SLIPPING:
            x, y = x - rate[6], y - rate[7]
        braking = -(x * phase[REFERENCE_X] + y * phase[REFERENCE_Y])
        square = phase[REFERENCE_X] ** 2 + phase[REFERENCE_Y] ** 2
        if phase[MOVING] != RESTING and braking > 0.0 and h * braking > most * square:
            h = most * square / braking
    return h


@compiled
def cut(world, cluster, share, root, ending, what):
    """Let a piece end at a root if nothing ended it before; returns the share at which it ends."""
    if root >= share and world.clock[cluster, ENDING] != CONTINUES:
        return share
    world.clock[cluster, ENDING], world.clock[cluster, ENDING_BODY] = ending, what
    return root


@compiled
def stopping_level(world, cluster, phase):
    """Value of `along` at which a body stops."""
    if world.members[cluster, 0] == 1:
        return 0.0
    speed = math.hypot(phase[REFERENCE_X], phase[REFERENCE_Y])
    return min(LINGERING, 0.5 * speed) * speed


@compiled
def find_ending(world, cluster, group, share):
    """Share of the step, at most `share`, at which a body of a group first stops to move or to spin."""
    polynomial = world.polynomial[group]
    for slot in range(GROUP_SIZE):
        body = group * GROUP_SIZE + slot
        phase = world.phase[body]
        spins = phase[SPIN_SENSE] != 0.0 and polynomial[0, slot, 5] != 0.0
        if spins and spin_along(polynomial, slot, phase, 1.0) <= 0.0:
            root = vanishing_share(polynomial, slot, phase, 1.0, 0.0)
            share = cut(world, cluster, share, root, SPIN_STOPS, body)
        moves = phase[REFERENCE_X] != 0.0 or phase[REFERENCE_Y] != 0.0
        level = stopping_level(world, cluster, phase)
        if moves and along(polynomial, slot, phase, 1.0) <= level:
            root = vanishing_share(polynomial, slot, phase, 0.0, level)
            share = cut(world, cluster, share, root, STOPS, body)
    return share


@compiled
def really_stops(world, cluster, share):
    """Whether the velocity (or slip) vanishes where its part along the reference direction does."""
    if world.clock[cluster, ENDING] != STOPS:
        return True
    body = int(world.clock[cluster, ENDING_BODY])
    group = body // GROUP_SIZE
    slot = body - group * GROUP_SIZE
    y = world.stages[WORK, body]
    vanished = VANISHED if world.members[cluster, 0] == 1 else 2.0 * LINGERING
    evaluate(world.polynomial[group], slot, share, y)
    if SLIPS and world.phase[body, MOVING] == SLIPPING:
        return math.hypot(y[3] - y[6], y[4] - y[7]) <= vanished
    return math.hypot(y[3], y[4]) <= vanished


@compiled
def is_still(world, group):
    """Whether no body of a group moves or spins."""
    for slot in range(GROUP_SIZE):
        phase = world.phase[group * GROUP_SIZE + slot]
        if phase[MOVING] != RESTING or phase[SPIN_SENSE] != 0.0:
            return False
    return True

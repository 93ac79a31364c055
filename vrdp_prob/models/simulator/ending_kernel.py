"""Compiled: how bodies start to move, and where a piece of motion ends."""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: PLR0917

import math

from vrdp_prob.models.simulator.cluster_kernel import cluster_of, push_mobility
from vrdp_prob.models.simulator.laws_kernel import BOUNDARIES, COUPLED, SLIPS, boundary, compiled, external, pair_force
from vrdp_prob.models.simulator.motion_kernel import take_states
from vrdp_prob.models.simulator.world_kernel import (
    ALIVE,
    BRAKE,
    CONTINUES,
    CROSSES,
    ENDING,
    ENDING_BODY,
    FIXED,
    IS_SPHERE,
    MOVING,
    PUSH,
    REFERENCE_X,
    REFERENCE_Y,
    RESTING,
    SIDES,
    SLIDING,
    SLIPPING,
    SPIN_SENSE,
    SPIN_STOPS,
    STOPS,
    WORK,
    evaluate,
)

VANISHED = 1e-7
"""Speed in m/s across the direction of motion below which a body at its turning point rests."""
LINGERING = 1e-6
"""Speed in m/s below which a body stops whose direction of motion changes.

What is not friction turns its motion ever faster while it slows down, which would take many short steps.
"""
LINGERING_SLIP = 1e-7
"""The same for a slip: what a sphere has not slipped yet then, it misses as resistance to rolling."""
STRAIGHT = 1e-9
"""Sine of the angle between velocity and acceleration below which a motion counts as straight."""
SLOWEST = 1e-10
"""Speed in m/s (or rad/s) below which a body rests, and with which it starts where there is no friction."""
LAUNCH = 2.0 * VANISHED
"""Speed in m/s with which a body starts in spite of friction; far above the error of a step."""
GRIP = 1e-3
"""Relative excess of a push over friction up to which a body at rest stays.

While a body creeps, friction turns it towards the push within its speed over its deceleration. A start takes some
`1 / excess` steps of that length, and just above the limit they find no end.
"""
STIFFEST = 2.0
"""Longest step of a body that is pushed to move faster, in units of the time in which friction alone would stop it.

Friction turns it towards the push in that time, which its derivatives tell but not its motion, where that is straight.
"""
SMALLEST_SHARE = 1e-16
"""Relative change of a root at which its search ends."""
CROSSING_LOOKS = 32
"""Places in a step at which is looked on which side of a boundary a body is."""


@compiled
def coefficient(polynomial, phase, power, of_spin):
    """Coefficient of what vanishes when a body stops (to spin), or begins to roll."""
    if of_spin != 0.0:
        return polynomial[power, 5] * phase[SPIN_SENSE]
    x, y = polynomial[power, 3], polynomial[power, 4]
    if phase[MOVING] == SLIPPING:
        x, y = x - polynomial[power, 6], y - polynomial[power, 7]
    return x * phase[REFERENCE_X] + y * phase[REFERENCE_Y]


@compiled
def vanishing(polynomial, phase, share, of_spin):
    """What vanishes when a body stops to move (or to spin), or begins to roll, and its derivative by the share.

    For the motion that is the velocity, or the slip, along the reference direction.
    """
    value, slope = 0.0, 0.0
    for power in range(polynomial.shape[0] - 1, -1, -1):
        slope = slope * share + value
        value = value * share + coefficient(polynomial, phase, power, of_spin)
    return value, slope


@compiled
def vanishing_share(polynomial, phase, of_spin, least):
    """Share of the step at which `vanishing` falls to `least`, by Newton's method kept between bounds."""
    low, high, share = 0.0, 1.0, 1.0
    while True:
        value, slope = vanishing(polynomial, phase, share, of_spin)
        if value > least:
            low = share
        else:
            high = share
        following = share - (value - least) / slope
        if not low < following < high:
            following = 0.5 * (low + high)
        if following in (low, high) or abs(following - share) <= SMALLEST_SHARE * following:
            return following
        share = following


@compiled
def settle(world, body, t, y):
    """Set the phase of a body from its state; a resting body stays while friction can hold it."""
    phase = world.phase[body]
    for c in range(ALIVE):
        phase[c] = 0.0
    if world.kind[body, FIXED]:
        return
    push = world.stages[PUSH, body]
    if world.model[COUPLED]:
        take_states(world, cluster_of(world, body), 0.0)
    set_push_at(world, body, t, y)
    # What no friction holds at rest counts as moving with speed 0: its derivative by the velocity does not vanish.
    if abs(y[5]) > SLOWEST or push[BRAKE] == 0.0:
        phase[SPIN_SENSE] = math.copysign(1.0, y[5])
    else:
        y[5] = 0.0
    if world.model[SLIPS]:
        slip = math.hypot(y[3] - y[6], y[4] - y[7])
        if world.body[body, IS_SPHERE] != 0.0 and slip > SLOWEST:
            phase[MOVING] = SLIPPING
            return
        y[6], y[7] = y[3], y[4]
    phase[MOVING] = SLIDING
    if math.hypot(y[3], y[4]) > SLOWEST:
        return
    y[3], y[4] = 0.0, 0.0
    set_push_at(world, body, t, y)
    if yields(push):
        launch(y, push, LAUNCH if push[2] > 0.0 else SLOWEST)
    elif push[2] > 0.0:
        phase[MOVING] = RESTING
    if world.model[SLIPS]:
        y[6], y[7] = y[3], y[4]


@compiled
def yields(push):
    """Whether friction cannot hold a body at rest."""
    return math.hypot(push[0], push[1]) > push[2] * (1.0 + GRIP)


@compiled
def launch(y, push, speed):
    """Let a body at rest move the way it is pushed."""
    size = math.hypot(push[0], push[1])
    y[3], y[4] = speed * push[0] / size, speed * push[1] / size


@compiled
def rest_at_once(y):
    """Take the velocity from a state."""
    y[3], y[4], y[6], y[7] = 0.0, 0.0, 0.0, 0.0


@compiled
def set_push_at(world, body, t, y):
    """Note what pushes a body in state `y` without contacts (2 numbers, m/s^2), what friction holds, and the brake.

    The states of other bodies are those in the work row.
    """
    push = world.stages[PUSH, body]
    external(world.model, t, y, world.phase[body], world.body[body], world.shared, push)
    if world.model[COUPLED]:
        force, cluster = world.force[0], cluster_of(world, body)
        for place in range(world.members[cluster, 0]):
            other = world.members[cluster, 1 + place]
            if other != body:
                state = world.stages[WORK, other]
                pair_force(world.model, t, y, state, world.body[body], world.body[other], world.shared, force)
                for c in range(2):
                    push[c] += push_mobility(world, body) * force[c]


@compiled
def set_references(world, body):
    """Take the velocity (or slip) at the start of a piece as reference direction."""
    phase = world.phase[body]
    y = world.polynomial[body, 0]
    if phase[MOVING] != RESTING:
        phase[REFERENCE_X], phase[REFERENCE_Y] = y[3], y[4]
    if phase[MOVING] == SLIPPING:
        phase[REFERENCE_X], phase[REFERENCE_Y] = y[3] - y[6], y[4] - y[7]


@compiled
def first_step(world, body, h, most):
    """Limit a step to a multiple of the time in which friction stops the body, or would if nothing pushed it."""
    phase = world.phase[body]
    x, y = rate_of_reference(world, body)
    braking = -(x * phase[REFERENCE_X] + y * phase[REFERENCE_Y])
    square = phase[REFERENCE_X] ** 2 + phase[REFERENCE_Y] ** 2
    if phase[MOVING] != RESTING and braking > 0.0 and h * braking > most * square:
        h = most * square / braking
    if phase[MOVING] == SLIDING and braking < 0.0:
        friction, speed = world.stages[PUSH, body, 2], math.sqrt(square)
        if h * friction > STIFFEST * speed:
            h = STIFFEST * speed / friction
    return h


@compiled
def cut(world, cluster, share, root, ending, what):
    """Let a piece end at a root if nothing ended it before; returns the share at which it ends."""
    if root >= share and world.clock[cluster, ENDING] != CONTINUES:
        return share
    world.clock[cluster, ENDING], world.clock[cluster, ENDING_BODY] = ending, what
    return root


@compiled
def rate_of_reference(world, body):
    """Rate of what a piece has as reference direction, the velocity or the slip, where the piece begins."""
    rate = world.stages[0, body]
    if world.phase[body, MOVING] == SLIPPING:
        return rate[3] - rate[6], rate[4] - rate[7]
    return rate[3], rate[4]


@compiled
def bends(world, body):
    """Whether the velocity (or slip) with which a piece begins changes its direction."""
    phase = world.phase[body]
    x, y = rate_of_reference(world, body)
    across = abs(x * phase[REFERENCE_Y] - y * phase[REFERENCE_X])
    return across > STRAIGHT * math.hypot(x, y) * math.hypot(phase[REFERENCE_X], phase[REFERENCE_Y])


@compiled
def lingering(world, body):
    """Speed, or slip, below which a body stops whose direction of motion changes."""
    return LINGERING_SLIP if world.phase[body, MOVING] == SLIPPING else LINGERING


@compiled
def hardly_moves(world, body):
    """Whether a body that slows down on a bent path is so slow that it stops at once."""
    phase = world.phase[body]
    x, y = rate_of_reference(world, body)
    slow = 0.0 < math.hypot(phase[REFERENCE_X], phase[REFERENCE_Y]) < lingering(world, body)
    return slow and x * phase[REFERENCE_X] + y * phase[REFERENCE_Y] < 0.0 and bends(world, body)


@compiled
def lingers(world, cluster, body):
    """Whether a body would turn ever faster while it stops, or stops together with others."""
    return world.members[cluster, 0] > 1 or bends(world, body)


@compiled
def stopping_level(world, cluster, body):
    """Value of `vanishing` at which a body stops."""
    if not lingers(world, cluster, body):
        return 0.0
    speed = math.hypot(world.phase[body, REFERENCE_X], world.phase[body, REFERENCE_Y])
    return min(lingering(world, body), 0.5 * speed) * speed


@compiled
def find_ending(world, cluster, body, share):
    """Share of the step, at most `share`, at which a body first stops to move or to spin."""
    polynomial, phase = world.polynomial[body], world.phase[body]
    # Where nothing brakes the spin it may change its sense.
    braked = world.stages[PUSH, body, BRAKE] > 0.0
    spins = braked and phase[SPIN_SENSE] != 0.0 and polynomial[0, 5] != 0.0
    if spins and vanishing(polynomial, phase, 1.0, 1.0)[0] <= 0.0:
        root = vanishing_share(polynomial, phase, 1.0, 0.0)
        share = cut(world, cluster, share, root, SPIN_STOPS, body)
    moves = phase[REFERENCE_X] != 0.0 or phase[REFERENCE_Y] != 0.0
    level = stopping_level(world, cluster, body)
    if moves and vanishing(polynomial, phase, 1.0, 0.0)[0] <= level:
        root = vanishing_share(polynomial, phase, 0.0, level)
        share = cut(world, cluster, share, root, STOPS, body)
    return share


@compiled
def find_crossing(world, cluster, body, share):
    """Share of the step, at most `share`, at which a body first crosses a boundary."""
    y, phase = world.stages[WORK, body], world.phase[body]
    for which in range(world.model[BOUNDARIES]):
        side, low = phase[SIDES + which], 0.0
        for index in range(1, CROSSING_LOOKS + 1):
            high = share * index / CROSSING_LOOKS
            evaluate(world.polynomial[body], high, y)
            if side * boundary(world.model, which, y, world.body[body], world.shared) < 0.0:
                root = crossing_share(world, body, which, low, high)
                share = cut(world, cluster, share, root, CROSSES, body * world.model[BOUNDARIES] + which)
                break
            low = high
    return share


@compiled
def crossing_share(world, body, which, low, high):
    """Share of the step between two at which a body crosses a boundary, by bisection; the first place behind it."""
    y, side = world.stages[WORK, body], world.phase[body, SIDES + which]
    while True:
        middle = 0.5 * (low + high)
        if middle <= low or middle >= high:
            return high
        evaluate(world.polynomial[body], middle, y)
        if side * boundary(world.model, which, y, world.body[body], world.shared) < 0.0:
            high = middle
        else:
            low = middle


@compiled
def set_sides(world, body, y):
    """Note on which side of each boundary a body is."""
    for which in range(world.model[BOUNDARIES]):
        value = boundary(world.model, which, y, world.body[body], world.shared)
        world.phase[body, SIDES + which] = math.copysign(1.0, value)


@compiled
def really_stops(world, cluster, share):
    """Whether the velocity (or slip) vanishes where its part along the reference direction does."""
    if world.clock[cluster, ENDING] != STOPS:
        return True
    body = int(world.clock[cluster, ENDING_BODY])
    y = world.stages[WORK, body]
    vanished = 2.0 * lingering(world, body) if lingers(world, cluster, body) else VANISHED
    evaluate(world.polynomial[body], share, y)
    if world.phase[body, MOVING] == SLIPPING:
        return math.hypot(y[3] - y[6], y[4] - y[7]) <= vanished
    return math.hypot(y[3], y[4]) <= vanished

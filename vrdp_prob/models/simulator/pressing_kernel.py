"""Compiled decisions about lasting contacts: which of them hold when a cluster of bodies moves on, and until when."""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: PLR0917

import math

from vrdp_prob.models.simulator.cluster_kernel import (
    FORCE,
    GRADIENT,
    HOLD,
    LEANS,
    MATCHES,
    PARTED,
    PRESSES,
    ROOM,
    TOUCH_A,
    TOUCH_B,
    TOUCH_FEATURE,
    cluster_of_touch,
    constrain,
    coupling,
    product_with,
    push_mobility,
    set_constraints,
    set_touch_count,
    touch_count,
)
from vrdp_prob.models.simulator.ending_kernel import LAUNCH, SLOWEST, VANISHED, launch, set_push_at, settle, yields
from vrdp_prob.models.simulator.laws_kernel import COUPLED, compiled
from vrdp_prob.models.simulator.motion_kernel import add_pair_forces, cluster_derivatives, derivatives, take_states
from vrdp_prob.models.simulator.world_kernel import (
    BRAKE,
    CONTINUES,
    ENDING,
    ENDING_BODY,
    FIXED,
    INVERSE_INERTIA,
    LEANING,
    LEANS_MOVING,
    LEANS_TURNING,
    MOVING,
    PARTS,
    PUSH,
    RADIUS,
    RESTING,
    SLIDES_OFF,
    SLIDING,
    SPARE,
    SPIN_SENSE,
    TURN,
    TURNS,
    WORK,
    YIELDS,
)

GENTLE = 0.05
"""Closing speed in radii (of the smaller body) per second above which bodies in touch collide with their restitution.

Slower ones that press, or that meet again within `PRESSING_TIME` of `search_kernel.py`, do not rebound.
"""
OPENING = 1e-6
"""Speed in m/s at which bodies in touch count as parting."""
FAINT = 1e-9
"""Relative acceleration in m/s^2 that must bring two bodies together for their contact to last."""
PATIENCE = 0.02
"""Time in s between two looks at bodies at rest whose forces change with time."""
LOOKS = 4
"""Places in a step at which lasting contacts are looked at."""
STOPPING = 1e-3
"""Last part of a step, in which a body stops, that is not looked at: the direction of its friction is lost there."""
ROOM_COUNTS = TOUCH_FEATURE + 6


@compiled
def gentle_speed(world, a, b):
    """Closing speed below which two bodies in touch do not rebound."""
    return GENTLE * min(world.body[a, RADIUS], world.body[b, RADIUS])


@compiled
def pull(world, body, c):
    """Force (or torque, c = 2) of all pressing contacts on a body."""
    total = 0.0
    for touch in range(touch_count(world)):
        row = world.touching[touch]
        if row[HOLD] == PRESSES:
            for side in range(2):
                if int(row[TOUCH_A + side]) == body:
                    total += row[GRADIENT + 3 * side + c] * row[FORCE]
    return total


@compiled
def set_push(world, body, t):
    """Note what pushes a body that friction holds (2 numbers, m/s^2), what friction holds, and both for its spin."""
    push = world.stages[PUSH, body]
    set_push_at(world, body, t, world.stages[WORK, body])
    for c in range(2):
        push[c] += pull(world, body, c) * push_mobility(world, body)
    push[TURN] = pull(world, body, 2) * world.body[body, INVERSE_INERTIA]


@compiled
def turns(push):
    """Whether friction cannot hold a body from spinning."""
    return abs(push[TURN]) > push[BRAKE]


@compiled
def stays(push):
    """Whether a body leans on others at rest."""
    return push[LEANING] in (LEANS_MOVING, LEANS_MOVING + LEANS_TURNING)


@compiled
def failure(world, cluster, t):
    """What ends the pieces of a cluster at the states at hand: how, and for which contact or body."""
    cluster_derivatives(world, cluster, t, SPARE)
    for touch in range(touch_count(world)):
        row = world.touching[touch]
        if row[HOLD] == PRESSES and cluster_of_touch(world, touch) == cluster:
            if row[FORCE] <= 0.0:
                return PARTS, touch
            if row[ROOM_COUNTS] != 0.0 and row[ROOM] < 0.0:
                return SLIDES_OFF, touch
    for place in range(world.members[cluster, 0]):
        body = world.members[cluster, 1 + place]
        phase, push = world.phase[body], world.stages[PUSH, body]
        set_push(world, body, t)
        if phase[MOVING] == RESTING and not stays(push) and yields(push):
            return YIELDS, body
        if phase[SPIN_SENSE] == 0.0 and push[LEANING] < LEANS_TURNING and turns(push):
            return TURNS, body
    return CONTINUES, -1


@compiled
def find_parting(world, cluster, t, h, share):
    """Share of the step, at most `share`, at which the contacts of a cluster no longer hold as they do."""
    until = share if world.clock[cluster, ENDING] == CONTINUES else (1.0 - STOPPING) * share
    low = 0.0
    for index in range(1, LOOKS + 1):
        high = until * index / LOOKS
        take_states(world, cluster, high)
        ending, _ = failure(world, cluster, t + high * h)
        if ending != CONTINUES:
            break
        low = high
    if ending == CONTINUES:
        return share
    return failing_share(world, cluster, t, h, low, high)


@compiled
def failing_share(world, cluster, t, h, low, high):
    """Share of the step between two at which the contacts of a cluster no longer hold as they do, by bisection."""
    take_states(world, cluster, high)
    ending, what = failure(world, cluster, t + high * h)
    while True:
        middle = 0.5 * (low + high)
        if middle <= low or middle >= high:
            world.clock[cluster, ENDING], world.clock[cluster, ENDING_BODY] = ending, what
            return high
        take_states(world, cluster, middle)
        found, which = failure(world, cluster, t + middle * h)
        if found == CONTINUES:
            low = middle
        else:
            high, ending, what = middle, found, which


@compiled
def find_yielding(world, cluster, t, horizon):
    """Let bodies at rest stay until forces that change with time move one of them; returns the time of that."""
    begin = t
    while begin < horizon:
        end = min(begin + PATIENCE, horizon)
        take_states(world, cluster, 0.0)
        ending, _ = failure(world, cluster, end)
        if ending != CONTINUES:
            return begin + (end - begin) * failing_share(world, cluster, begin, end - begin, 0.0, 1.0)
        begin = end
    return math.inf


@compiled
def start(world, body):
    """Let a body at rest move the way it is pushed."""
    world.phase[body, MOVING] = SLIDING
    launch(world.polynomial[body, 0], world.stages[PUSH, body], LAUNCH)


@compiled
def start_spin(world, body):
    """Let a body that does not spin do so the way it is pushed."""
    sense = math.copysign(1.0, world.stages[PUSH, body, TURN])
    world.phase[body, SPIN_SENSE] = sense
    world.polynomial[body, 0, 5] = 2.0 * SLOWEST * sense


@compiled
def loosened(world, cluster, t):
    """Let bodies at rest move, or not spinning turn, that are pushed too hard; returns whether any does."""
    changed = False
    for place in range(world.members[cluster, 0]):
        body = world.members[cluster, 1 + place]
        phase, push = world.phase[body], world.stages[PUSH, body]
        set_push(world, body, t)
        if phase[MOVING] == RESTING and not stays(push) and yields(push):
            start(world, body)
            changed = True
        if phase[SPIN_SENSE] == 0.0 and push[LEANING] < LEANS_TURNING and turns(push):
            start_spin(world, body)
            changed = True
    return changed


@compiled
def blocked(world, cluster):
    """Let bodies rest that others stop and friction then holds; returns whether any does, or slides off instead."""
    changed = False
    for place in range(world.members[cluster, 0]):
        body = world.members[cluster, 1 + place]
        phase, push, y = world.phase[body], world.stages[PUSH, body], world.stages[WORK, body]
        slow = math.hypot(y[3], y[4]) <= VANISHED and push[2] > 0.0
        if phase[MOVING] != SLIDING or not slow:
            continue
        changed = True
        # A body that others stop is pushed just as hard as friction holds.
        if yields(push):
            start(world, body)
        else:
            at_rest = world.polynomial[body, 0]
            phase[MOVING], at_rest[3], at_rest[4] = RESTING, 0.0, 0.0
            push[LEANING] += LEANS_MOVING
    return changed


@compiled
def blocked_turning(world, cluster):
    """Let bodies not spin that just began to, where their contacts turn them back; returns whether any does."""
    changed = False
    for place in range(world.members[cluster, 0]):
        body = world.members[cluster, 1 + place]
        phase, push = world.phase[body], world.stages[PUSH, body]
        begins = abs(world.polynomial[body, 0, 5]) <= 4.0 * SLOWEST and push[BRAKE] > 0.0
        if phase[SPIN_SENSE] * world.stages[SPARE, body, 5] < 0.0 and begins:
            phase[SPIN_SENSE], world.polynomial[body, 0, 5] = 0.0, 0.0
            push[LEANING] += LEANS_TURNING
            changed = True
    return changed


@compiled
def check_room(world, cluster):
    """Let a corner press that lies beyond the end of a side: it stands for the corner of the other square before it."""
    for touch in range(touch_count(world)):
        row = world.touching[touch]
        if cluster_of_touch(world, touch) == cluster and row[ROOM] < 0.0:
            row[ROOM_COUNTS] = 0.0


@compiled
def match(world, cluster):
    """Choose the contacts whose velocities are matched: none that rebounds, and none that would have to pull."""
    for touch in range(touch_count(world)):
        row = world.touching[touch]
        if cluster_of_touch(world, touch) == cluster:
            a, b = int(row[TOUCH_A]), int(row[TOUCH_B])
            if coupling(world, touch, touch, 0.0) == 0.0:
                row[HOLD] = LEANS
            elif product_with(world, touch, world.stages[WORK]) < -gentle_speed(world, a, b):
                row[HOLD] = PARTED
    while True:
        take_states(world, cluster, 0.0)
        constrain(world, cluster, world.stages[WORK], 0.0)
        if not drop(world, cluster, -OPENING, PARTED, 0.0):
            return


@compiled
def press(world, cluster, t):
    """Choose the contacts that press, after their velocities were matched."""
    while True:
        for place in range(world.members[cluster, 0]):
            derivatives(world, world.members[cluster, 1 + place], t, world.stages[SPARE])
        if world.model[COUPLED]:
            add_pair_forces(world, cluster, t, world.stages[SPARE])
        constrain(world, cluster, world.stages[SPARE], 1.0)
        if not drop(world, cluster, FAINT, MATCHES, 1.0):
            return


@compiled
def drop(world, cluster, least, hold, curved):
    """Give up the contact that pulls most, if any does what is less than `least`; whether one was."""
    worst = -1
    for touch in range(touch_count(world)):
        row = world.touching[touch]
        if row[HOLD] > hold and row[HOLD] != LEANS and cluster_of_touch(world, touch) == cluster:
            effect = row[FORCE] * coupling(world, touch, touch, curved)
            if effect < least:
                least, worst = effect, touch
    if worst >= 0:
        world.touching[worst, HOLD] = hold
    return worst >= 0


@compiled
def leans(world, touch, t):
    """Whether one of two bodies at rest would move without the other."""
    for side in range(2):
        body = int(world.touching[touch, TOUCH_A + side])
        if not world.kind[body, FIXED]:
            set_push_at(world, body, t, world.stages[WORK, body])
            if yields(world.stages[PUSH, body]):
                return True
    return False


@compiled
def choose_contacts(world, cluster, t):
    """Decide which contacts of a cluster last, and which of its bodies move.

    A body at rest starts to move when it is pushed harder than friction holds (by more than `GRIP`); one that its own
    forces would move but that is held by others leans on them, and no longer pushes them while all are at rest.
    """
    for place in range(world.members[cluster, 0]):
        body = world.members[cluster, 1 + place]
        settle(world, body, t, world.polynomial[body, 0])
        world.stages[PUSH, body, LEANING] = 0.0
    for _ in range(4 * world.members[cluster, 0] + 4):
        for touch in range(touch_count(world)):
            if cluster_of_touch(world, touch) == cluster:
                world.touching[touch, HOLD] = PRESSES
        take_states(world, cluster, 0.0)
        set_constraints(world, cluster)
        check_room(world, cluster)
        match(world, cluster)
        press(world, cluster, t)
        if not (loosened(world, cluster, t) or blocked(world, cluster) or blocked_turning(world, cluster)):
            break
    for touch in range(touch_count(world)):
        row = world.touching[touch]
        if cluster_of_touch(world, touch) == cluster and row[HOLD] == LEANS and not leans(world, touch, t):
            row[HOLD] = PARTED


@compiled
def forget_touch(world, touch):
    """Remove a lasting contact from the list."""
    count = touch_count(world) - 1
    for c in range(world.touching.shape[1]):
        world.touching[touch, c] = world.touching[count, c]
    set_touch_count(world, count)


@compiled
def touches(world, i, j):
    """Number of lasting contacts of two bodies."""
    number = 0
    for touch in range(touch_count(world)):
        a, b = int(world.touching[touch, TOUCH_A]), int(world.touching[touch, TOUCH_B])
        if (a == i and b == j) or (a == j and b == i):
            number += 1
    return number

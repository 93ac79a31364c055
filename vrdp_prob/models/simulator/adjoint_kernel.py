"""Compiled reverse sweep: the exact derivative of a simulated world, its order of events held fixed.

The tape is read backwards. A piece passes the adjoint of its polynomial back through the stages of its Runge-Kutta step
(step lengths are constants), an event passes the adjoint of the states after it to the states before it and to its
time, and the time of a contact or a stop follows from what vanishes there (implicit function theorem). A leg, the
pieces from one event to the next, also has an adjoint of its beginning: what is read from it at a fixed time changes
against its rate when it begins later.
"""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: PLR0917

from typing import NamedTuple

import numpy as np

from vrdp_prob.models.simulator.cluster_kernel import (
    HOLD,
    TOUCH_A,
    TOUCH_B,
    TOUCH_FEATURE,
    TOUCH_KIND,
    constrain_vjp,
    note_member,
    presses,
    set_touch_count,
    spread,
)
from vrdp_prob.models.simulator.laws_kernel import (
    GROUP_SIZE,
    STATE_SIZE,
    compiled,
    motion_vjp,
)
from vrdp_prob.models.simulator.motion_kernel import (
    PARTS_OF_STEP,
    cluster_derivatives,
    compute_stages,
    match_velocities,
    set_polynomial,
    stage_states,
)
from vrdp_prob.models.simulator.tableau import DENSE, NODES, WEIGHTS
from vrdp_prob.models.simulator.tape_kernel import (
    BLOCK,
    BLOCK_PIECES,
    BLOCK_TOUCHES,
    CONTACT_KIND,
    FEATURE,
    FIRST,
    HOLDS,
    SECOND,
    TIME,
)
from vrdp_prob.models.simulator.world_kernel import (
    ALIVE,
    FIXED,
    LENGTH,
    MOVING,
    ORIGIN,
    PHASE_SIZE,
    RESTING,
    SPIN_SENSE,
    STAGES,
    WORK,
    evaluate_rate,
    hold,
    share_of,
)

# Rows of `local`.
OF_A, OF_B, RATE_A, RATE_B, VALUE_A, VALUE_B, VELOCITIES, ONE = 0, 1, 2, 3, 4, 5, 6, 7
FLATTEST = 1e-12
"""Rate below which the time of a stop has no derivative."""


class Adjoint(NamedTuple):
    """Adjoints of one world while its tape is read backwards."""

    body: np.ndarray  # [body, constant]
    shared: np.ndarray  # [parameter]
    start: np.ndarray  # [body, (state, release time)]
    times: np.ndarray  # [time]
    polynomial: np.ndarray  # [group, power, slot, state]
    state: np.ndarray  # [body, state], of the state with which the current piece begins
    leg: np.ndarray  # [group], of the beginning of the current leg
    loaded: np.ndarray  # [group], row of the piece whose polynomial is at hand
    stages: np.ndarray  # [stage, body, state], adjoints of the stages
    before: np.ndarray  # [body, state], of the state at which a stage or the contacts were evaluated
    constraint: np.ndarray  # [8], of the constraint of one contact
    local: np.ndarray  # [8, 16]


@compiled
def load(world, adjoint, integers, numbers, row):
    """Compute the polynomials of recorded pieces of a cluster again, where one of them is not at hand."""
    if adjoint.loaded[integers[row, FIRST]] != row:
        load_block(world, adjoint, integers, numbers, integers[row, BLOCK])


@compiled
def load_block(world, adjoint, integers, numbers, block):
    """Compute the polynomials of the recorded pieces of a cluster, which becomes the one at hand with its contacts."""
    size, touches = integers[block, BLOCK_PIECES], integers[block, BLOCK_TOUCHES]
    cluster = integers[block, FIRST]
    world.members[world.clock.shape[0] + 1, 0] = 0
    for place in range(size):
        note_member(world, integers[block + place, FIRST])
    spread(world)
    moving = False
    for row in range(block, block + size):
        group = integers[row, FIRST]
        adjoint.loaded[group] = row
        moving = load_states(world, group, numbers[row]) or moving
    load_touches(world, integers, numbers, block + size, touches)
    if moving:
        match_velocities(world, cluster)
        compute_stages(world, cluster, numbers[block, TIME], numbers[block, 1], PARTS_OF_STEP[0], PARTS_OF_STEP[3])
        for row in range(block, block + size):
            world.clock[integers[row, FIRST], LENGTH] = numbers[block, 1]
            set_polynomial(world, integers[row, FIRST], numbers[block, 1])


@compiled
def load_states(world, group, numbers):
    """States and phases with which a recorded piece begins; returns whether a body moves."""
    moving = False
    for slot in range(GROUP_SIZE):
        phase = world.phase[group * GROUP_SIZE + slot]
        at = 2 + slot * (STATE_SIZE + PHASE_SIZE)
        for c in range(STATE_SIZE):
            world.polynomial[group, 0, slot, c] = numbers[at + c]
        for c in range(PHASE_SIZE):
            phase[c] = numbers[at + STATE_SIZE + c]
        moving = moving or phase[MOVING] != RESTING or phase[SPIN_SENSE] != 0.0
    hold(world, group, numbers[TIME])
    return moving


@compiled
def load_touches(world, integers, numbers, begin, count):
    """Take the recorded lasting contacts of a cluster as those at hand."""
    set_touch_count(world, count)
    for touch in range(count):
        row, entry = world.touching[touch], integers[begin + touch]
        row[TOUCH_A], row[TOUCH_B], row[TOUCH_KIND] = entry[FIRST], entry[SECOND], entry[CONTACT_KIND]
        row[HOLD] = entry[HOLDS]
        for c in range(7):
            row[TOUCH_FEATURE + c] = numbers[begin + touch, FEATURE + c]


@compiled
def read_frames(world, adjoint, group, begin, end, times, states_bar):
    """Adjoint of the frames that a piece shows."""
    rate = adjoint.local[RATE_A]
    for frame in range(begin, end):
        share = share_of(world, group, times[frame])
        for slot in range(GROUP_SIZE):
            body = group * GROUP_SIZE + slot
            if world.phase[body, ALIVE] != 0.0 and not world.kind[body, FIXED]:
                bar = states_bar[frame, body]
                evaluate_rate(world.polynomial[group], slot, share, world.clock[group, LENGTH], rate)
                shift = read(adjoint, group, slot, share, bar, rate)
                adjoint.times[frame] += shift
                adjoint.leg[group] -= shift


@compiled
def read(adjoint, group, slot, share, bar, rate):
    """Adjoint of a state that was read from a piece; returns its product with the rate of the state."""
    shift = 0.0
    for c in range(STATE_SIZE):
        shift += bar[c] * rate[c]
    factor = 1.0
    for power in range(DENSE.shape[0]):
        out = adjoint.polynomial[group, power, slot]
        for c in range(STATE_SIZE):
            out[c] += factor * bar[c]
        factor *= share
    return shift


@compiled
def reverse_step(world, adjoint, cluster, t, h):
    """Adjoints of the states with which the pieces of a cluster begin, from those of their polynomials."""
    for place in range(world.members[cluster, 0]):
        reverse_polynomial(adjoint, world.members[cluster, 1 + place], h)
    pressing = presses(world, cluster)
    compute_stages(world, cluster, t, h, PARTS_OF_STEP[0], PARTS_OF_STEP[3])
    for stage in range(STAGES - 1, -1, -1):
        stage_states(world, cluster, stage, h)
        if pressing:
            # Computes the forces of this stage again.
            cluster_derivatives(world, cluster, t + NODES[stage] * h, world.stages[stage])
        for place in range(world.members[cluster, 0]):
            group = world.members[cluster, 1 + place]
            for body in range(group * GROUP_SIZE, (group + 1) * GROUP_SIZE):
                for c in range(STATE_SIZE):
                    adjoint.before[body, c] = 0.0
        if pressing:
            bars = adjoint.stages[stage]
            constrain_vjp(world, adjoint, cluster, world.stages[stage], bars, adjoint.before, 1.0)
        for place in range(world.members[cluster, 0]):
            reverse_stage(world, adjoint, world.members[cluster, 1 + place], t, h, stage)


@compiled
def reverse_polynomial(adjoint, group, h):
    """Adjoints of the stages of a group's step from that of its polynomial."""
    for slot in range(GROUP_SIZE):
        body = group * GROUP_SIZE + slot
        for c in range(STATE_SIZE):
            adjoint.state[body, c] = adjoint.polynomial[group, 0, slot, c]
        for stage in range(STAGES):
            out = adjoint.stages[stage, body]
            for c in range(STATE_SIZE):
                out[c] = 0.0
            for power in range(1, DENSE.shape[0]):
                weight = h * DENSE[power, stage]
                if weight != 0.0:
                    for c in range(STATE_SIZE):
                        out[c] += weight * adjoint.polynomial[group, power, slot, c]


@compiled
def reverse_stage(world, adjoint, group, t, h, stage):
    """Pass the adjoint of a group's derivative in one stage on to the earlier ones and to the beginning."""
    for body in range(group * GROUP_SIZE, (group + 1) * GROUP_SIZE):
        phase, before = world.phase[body], adjoint.before[body]
        if phase[MOVING] != RESTING or phase[SPIN_SENSE] != 0.0:
            motion_vjp(
                t + NODES[stage] * h,
                world.stages[WORK, body],
                phase,
                world.body[body],
                world.shared,
                adjoint.stages[stage, body],
                before,
                adjoint.body[body],
                adjoint.shared,
                adjoint.leg[group : group + 1],
            )
        for c in range(STATE_SIZE):
            adjoint.state[body, c] += before[c]
        for earlier in range(stage):
            weight = h * WEIGHTS[stage, earlier]
            if weight != 0.0:
                for c in range(STATE_SIZE):
                    adjoint.stages[earlier, body, c] += weight * before[c]


@compiled
def reverse_pieces(world, adjoint, integers, numbers, block):
    """Pass the adjoints of the pieces of a cluster on to the states with which they begin."""
    cluster = integers[block, FIRST]
    if integers[block, BLOCK_PIECES] > 1 or integers[block, BLOCK_TOUCHES] > 0:
        load_block(world, adjoint, integers, numbers, block)
    moving = False
    for place in range(world.members[cluster, 0]):
        group = world.members[cluster, 1 + place]
        for body in range(group * GROUP_SIZE, (group + 1) * GROUP_SIZE):
            moving = moving or world.phase[body, MOVING] != RESTING or world.phase[body, SPIN_SENSE] != 0.0
    if moving:
        reverse_step(world, adjoint, cluster, world.clock[cluster, ORIGIN], world.clock[cluster, LENGTH])
        reverse_match(world, adjoint, numbers, block, cluster)
    for place in range(world.members[cluster, 0]):
        reverse_beginning(world, adjoint, world.members[cluster, 1 + place], moving)


@compiled
def reverse_match(world, adjoint, numbers, block, cluster):
    """Velocities were matched in the recorded states before the pieces of a cluster began."""
    if not presses(world, cluster):
        return
    for place in range(world.members[cluster, 0]):
        load_states(world, world.members[cluster, 1 + place], numbers[block + place])
        adjoint.loaded[world.members[cluster, 1 + place]] = -1
    match_velocities(world, cluster)
    for body in range(adjoint.before.shape[0]):
        for c in range(STATE_SIZE):
            adjoint.before[body, c] = 0.0
    constrain_vjp(world, adjoint, cluster, world.stages[WORK], adjoint.state, adjoint.before, 0.0)
    for body in range(adjoint.before.shape[0]):
        for c in range(STATE_SIZE):
            adjoint.state[body, c] += adjoint.before[body, c]


@compiled
def reverse_beginning(world, adjoint, group, moving):
    """The adjoint of a piece is read; a resting body was set to rest, whatever small velocity it came with."""
    for slot in range(GROUP_SIZE):
        phase = world.phase[group * GROUP_SIZE + slot]
        bar = adjoint.state[group * GROUP_SIZE + slot]
        for c in range(STATE_SIZE):
            if not moving:
                bar[c] = adjoint.polynomial[group, 0, slot, c]
            for power in range(DENSE.shape[0]):
                adjoint.polynomial[group, power, slot, c] = 0.0
        if phase[MOVING] == RESTING:
            bar[3], bar[4] = 0.0, 0.0
        if phase[SPIN_SENSE] == 0.0:
            bar[5] = 0.0


@compiled
def shift_of(world, adjoint, cluster, t):
    """Adjoint of the time of an event by the legs that begin with it and by the states after it.

    The latter is the product of their adjoints with the rates before the event, of all bodies of a cluster.
    """
    total = 0.0
    rate = adjoint.local[RATE_A]
    for place in range(world.members[cluster, 0]):
        group = world.members[cluster, 1 + place]
        share = share_of(world, group, t)
        total += adjoint.leg[group]
        for slot in range(GROUP_SIZE):
            evaluate_rate(world.polynomial[group], slot, share, world.clock[group, LENGTH], rate)
            for c in range(STATE_SIZE):
                total += adjoint.state[group * GROUP_SIZE + slot, c] * rate[c]
    return total


@compiled
def end_legs(world, adjoint, cluster, t):
    """Read the states before an event from the pieces that it ended; the legs before it are the current ones then."""
    rate = adjoint.local[RATE_A]
    for place in range(world.members[cluster, 0]):
        group = world.members[cluster, 1 + place]
        share = share_of(world, group, t)
        adjoint.leg[group] = 0.0
        for slot in range(GROUP_SIZE):
            evaluate_rate(world.polynomial[group], slot, share, world.clock[group, LENGTH], rate)
            adjoint.leg[group] -= read(adjoint, group, slot, share, adjoint.state[group * GROUP_SIZE + slot], rate)


@compiled
def continue_legs(world, adjoint, cluster, t):
    """Read the states in which pieces go on from those before, within a leg."""
    for place in range(world.members[cluster, 0]):
        group = world.members[cluster, 1 + place]
        share = share_of(world, group, t)
        for slot in range(GROUP_SIZE):
            rate = adjoint.local[RATE_A]
            read(adjoint, group, slot, share, adjoint.state[group * GROUP_SIZE + slot], rate)

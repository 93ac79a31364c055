"""Compiled reverse sweep: the exact derivative of a simulated world, its order of events held fixed.

The tape is read backwards. A piece passes the adjoint of its polynomial back through the stages of its Runge-Kutta step
(step lengths are constants), an event passes the adjoint of the states after it to the states before it and to its
time, and the time of a contact or a stop follows from what vanishes there (implicit function theorem). A leg, the
pieces from one event to the next, also has an adjoint of its beginning: what is read from it at a fixed time changes
against its rate when it begins later.
"""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: PLR0912, PLR0917

from typing import NamedTuple

import numpy as np

from vrdp_prob.models.simulator.laws_kernel import (
    GROUP_SIZE,
    STATE_SIZE,
    compiled,
    motion_vjp,
)
from vrdp_prob.models.simulator.motion_kernel import STAGES, compute_stages, set_polynomial, stage_state
from vrdp_prob.models.simulator.tableau import DENSE, NODES, WEIGHTS
from vrdp_prob.models.simulator.tape_kernel import (
    TIME,
)
from vrdp_prob.models.simulator.world_kernel import (
    ALIVE,
    FIXED,
    LENGTH,
    MOVING,
    PHASE_SIZE,
    RESTING,
    SPIN_SENSE,
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
    state: np.ndarray  # [group, slot, state], of the state with which the current piece begins
    leg: np.ndarray  # [group], of the beginning of the current leg
    loaded: np.ndarray  # [group], row of the piece whose polynomial is at hand
    stages: np.ndarray  # [stage, slot, state], adjoints of the stages
    local: np.ndarray  # [8, 16]


@compiled
def load(world, adjoint, integers, numbers, group, row):
    """Compute the polynomial of a recorded piece again, if it is not at hand."""
    if adjoint.loaded[group] == row:
        return
    adjoint.loaded[group] = row
    at = 2
    moving = False
    for slot in range(GROUP_SIZE):
        phase = world.phase[group * GROUP_SIZE + slot]
        for c in range(STATE_SIZE):
            world.polynomial[group, 0, slot, c] = numbers[row, at + c]
        at += STATE_SIZE
        for c in range(PHASE_SIZE):
            phase[c] = numbers[row, at + c]
        at += PHASE_SIZE
        moving = moving or phase[MOVING] != RESTING or phase[SPIN_SENSE] != 0.0
    hold(world, group, numbers[row, TIME])
    if moving:
        world.clock[group, LENGTH] = numbers[row, 1]
        compute_stages(world, group, numbers[row, TIME], numbers[row, 1], 0, STAGES)
        set_polynomial(world, group, numbers[row, 1])


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
def reverse_step(world, adjoint, group, t, h):
    """Adjoint of the state with which a piece begins, from that of its polynomial."""
    for slot in range(GROUP_SIZE):
        for c in range(STATE_SIZE):
            adjoint.state[group, slot, c] = adjoint.polynomial[group, 0, slot, c]
        for stage in range(STAGES):
            out = adjoint.stages[stage, slot]
            for c in range(STATE_SIZE):
                out[c] = 0.0
            for power in range(1, DENSE.shape[0]):
                weight = h * DENSE[power, stage]
                if weight != 0.0:
                    for c in range(STATE_SIZE):
                        out[c] += weight * adjoint.polynomial[group, power, slot, c]
    compute_stages(world, group, t, h, 0, STAGES)
    before = adjoint.local[VALUE_A]
    for stage in range(STAGES - 1, -1, -1):
        stage_state(world, group, stage, h)
        for slot in range(GROUP_SIZE):
            body = group * GROUP_SIZE + slot
            phase = world.phase[body]
            if phase[MOVING] == RESTING and phase[SPIN_SENSE] == 0.0:
                continue
            for c in range(STATE_SIZE):
                before[c] = 0.0
            motion_vjp(
                t + NODES[stage] * h,
                world.stages[STAGES, slot],
                phase,
                world.body[body],
                world.shared,
                adjoint.stages[stage, slot],
                before,
                adjoint.body[body],
                adjoint.shared,
                adjoint.leg[group : group + 1],
            )
            for c in range(STATE_SIZE):
                adjoint.state[group, slot, c] += before[c]
            for earlier in range(stage):
                weight = h * WEIGHTS[stage, earlier]
                if weight != 0.0:
                    for c in range(STATE_SIZE):
                        adjoint.stages[earlier, slot, c] += weight * before[c]


@compiled
def reverse_piece(world, adjoint, group, t):
    """Pass the adjoint of a piece on to the state with which it begins."""
    moving = False
    for slot in range(GROUP_SIZE):
        phase = world.phase[group * GROUP_SIZE + slot]
        moving = moving or phase[MOVING] != RESTING or phase[SPIN_SENSE] != 0.0
    if moving:
        reverse_step(world, adjoint, group, t, world.clock[group, LENGTH])
    for slot in range(GROUP_SIZE):
        phase = world.phase[group * GROUP_SIZE + slot]
        bar = adjoint.state[group, slot]
        for c in range(STATE_SIZE):
            if not moving:
                bar[c] = adjoint.polynomial[group, 0, slot, c]
            for power in range(DENSE.shape[0]):
                adjoint.polynomial[group, power, slot, c] = 0.0
        # A resting body was set to rest, whatever small velocity it came with.
        if phase[MOVING] == RESTING:
            bar[3], bar[4] = 0.0, 0.0
        if phase[SPIN_SENSE] == 0.0:
            bar[5] = 0.0


@compiled
def shift_of(world, adjoint, group, t):
    """Product of the adjoints of the states after an event with the rates before it: an adjoint of the event's time."""
    total = 0.0
    share = share_of(world, group, t)
    rate = adjoint.local[RATE_A]
    for slot in range(GROUP_SIZE):
        evaluate_rate(world.polynomial[group], slot, share, world.clock[group, LENGTH], rate)
        for c in range(STATE_SIZE):
            total += adjoint.state[group, slot, c] * rate[c]
    return total


@compiled
def end_leg(world, adjoint, group, t):
    """Read the states before an event from the piece that it ended; the leg before it is the current one then."""
    share = share_of(world, group, t)
    rate = adjoint.local[RATE_A]
    adjoint.leg[group] = 0.0
    for slot in range(GROUP_SIZE):
        evaluate_rate(world.polynomial[group], slot, share, world.clock[group, LENGTH], rate)
        adjoint.leg[group] -= read(adjoint, group, slot, share, adjoint.state[group, slot], rate)

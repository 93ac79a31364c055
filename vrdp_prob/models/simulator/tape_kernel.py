"""Compiled record of a simulated world: its frames, and every piece of motion and every event in order."""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"

import math
from typing import NamedTuple

import numpy as np

from vrdp_prob.models.simulator.cluster_kernel import (
    HOLD,
    MATCHES,
    TOUCH_A,
    TOUCH_B,
    TOUCH_FEATURE,
    TOUCH_KIND,
    cluster_of_touch,
    touch_count,
)
from vrdp_prob.models.simulator.laws_kernel import GROUP_SIZE, STATE_SIZE, compiled
from vrdp_prob.models.simulator.world_kernel import (
    ALIVE,
    FIXED,
    LENGTH,
    ORIGIN,
    PHASE_SIZE,
    evaluate,
    evaluate_at,
    share_of,
)

# Kinds of rows.
PIECE, CONTINUE, RELEASE, STOP, SPIN_STOP, CONTACT, PRESS, PART = 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0
# Columns of integers. A row number of a piece says which piece an event ended. A piece is of a group; the pieces of a
# cluster stand together, its lasting contacts (PRESS) behind them, and know their first row and both numbers of rows.
# Where contacts part (PART) the motion stays smooth, except where one slides off its feature, which is named.
KIND, FIRST, SECOND, BEFORE_FIRST, BEFORE_SECOND, FRAME_BEGIN, FRAME_END = 0, 1, 2, 3, 4, 5, 6
CONTACT_KIND, HOLDS = FRAME_BEGIN, FRAME_END
BLOCK, BLOCK_PIECES, BLOCK_TOUCHES = SECOND, BEFORE_FIRST, BEFORE_SECOND
INTEGERS = 7
# Columns of numbers. A piece: origin, length, states, phases. An event: its time. A contact: features, then its result
# (or, where it slides off, the rate at which its room on the feature shrinks).
TIME, FEATURE, CLOSING_SPEED = 0, 1, 8
NUMBERS = max(2 + GROUP_SIZE * (STATE_SIZE + PHASE_SIZE), 16)
# Columns of `place`: next frame of a body, row of the current piece of a group.
FRAME, ROW = 0, 1
# Columns of `counts`.
ROWS, EVENTS = 0, 1
# Rows of `local`: result of a contact, states of both bodies.
RESULT, STATE_A, STATE_B = 0, 1, 2


class Tape(NamedTuple):
    """Rows of the record, and where the output goes."""

    integers: np.ndarray  # [row, INTEGERS]
    numbers: np.ndarray  # [row, NUMBERS]
    counts: np.ndarray  # [(rows, events)]
    place: np.ndarray  # [body or group, (frame, row)]
    times: np.ndarray  # [time], s
    states: np.ndarray  # [time, body, state]
    local: np.ndarray  # [(result, state a, state b), 16]


@compiled
def clear_tape(tape, start):
    """Nothing recorded; before its release a body shows the state it is released with."""
    tape.counts[ROWS], tape.counts[EVENTS] = 0, 0
    for body in range(tape.place.shape[0]):
        tape.place[body, FRAME], tape.place[body, ROW] = 0, -1
    for frame in range(tape.times.shape[0]):
        for body in range(tape.place.shape[0]):
            for c in range(STATE_SIZE):
                tape.states[frame, body, c] = start[body, c]


@compiled
def add_row(tape, kind, first, time):
    """Append a row of one body (or of a group, for a piece) and return its number; the caller keeps a reserve."""
    row = tape.counts[ROWS]
    integers = tape.integers[row]
    integers[KIND], integers[FIRST], integers[SECOND] = int(kind), first, -1
    integers[FRAME_BEGIN], integers[FRAME_END] = 0, 0
    integers[BEFORE_FIRST], integers[BEFORE_SECOND] = -1, -1
    if kind != PIECE:
        integers[BEFORE_FIRST] = tape.place[first // GROUP_SIZE, ROW]
    tape.numbers[row, TIME] = time
    tape.counts[ROWS] = row + 1
    return row


@compiled
def add_pair(tape, kind, first, second, time):
    """Append a row of two bodies and return its number."""
    row = add_row(tape, kind, first, time)
    tape.integers[row, SECOND] = second
    tape.integers[row, BEFORE_SECOND] = tape.place[second // GROUP_SIZE, ROW]
    return row


@compiled
def add_pieces(tape, world, cluster):
    """Append the next pieces of a cluster, with the states they begin with, and its lasting contacts."""
    block, size = tape.counts[ROWS], world.members[cluster, 0]
    for place in range(size):
        group = world.members[cluster, 1 + place]
        row = add_row(tape, PIECE, group, 0.0)
        tape.integers[row, BLOCK] = block
        numbers = tape.numbers[row]
        for slot in range(GROUP_SIZE):
            at = 2 + slot * (STATE_SIZE + PHASE_SIZE)
            for c in range(STATE_SIZE):
                numbers[at + c] = world.polynomial[group, 0, slot, c]
        tape.place[group, ROW] = block + place
    touches = 0
    for touch in range(touch_count(world)):
        row = world.touching[touch]
        if row[HOLD] >= MATCHES and cluster_of_touch(world, touch) == cluster:
            index = add_pair(tape, PRESS, int(row[TOUCH_A]), int(row[TOUCH_B]), 0.0)
            tape.integers[index, CONTACT_KIND], tape.integers[index, HOLDS] = int(row[TOUCH_KIND]), int(row[HOLD])
            for c in range(7):
                tape.numbers[index, FEATURE + c] = row[TOUCH_FEATURE + c]
            touches += 1
    for index in range(block, block + size):
        tape.integers[index, BLOCK_PIECES], tape.integers[index, BLOCK_TOUCHES] = size, touches


@compiled
def complete_pieces(tape, world, cluster):
    """Add to the last pieces of a cluster what is known when their step was done."""
    for place in range(world.members[cluster, 0]):
        group = world.members[cluster, 1 + place]
        numbers = tape.numbers[tape.place[group, ROW]]
        numbers[TIME], numbers[1] = world.clock[group, ORIGIN], world.clock[group, LENGTH]
        for slot in range(GROUP_SIZE):
            at = 2 + slot * (STATE_SIZE + PHASE_SIZE) + STATE_SIZE
            for c in range(PHASE_SIZE):
                numbers[at + c] = world.phase[group * GROUP_SIZE + slot, c]


@compiled
def skip_frames(tape, body, until):
    """Leave out the frames of a body before a time."""
    while tape.place[body, FRAME] < tape.times.shape[0] and tape.times[tape.place[body, FRAME]] < until:
        tape.place[body, FRAME] += 1


@compiled
def write_frames(tape, world, group, until):
    """Write the frames before a time that the current piece of a group covers."""
    row = tape.place[group, ROW]
    for slot in range(GROUP_SIZE):
        body = group * GROUP_SIZE + slot
        # What cannot move shows its state from the start.
        if world.phase[body, ALIVE] == 0.0 or world.kind[body, FIXED]:
            continue
        frame = tape.place[body, FRAME]
        tape.integers[row, FRAME_BEGIN] = frame
        while frame < tape.times.shape[0] and tape.times[frame] < until:
            share = share_of(world, group, tape.times[frame])
            evaluate(world.polynomial[group], slot, share, tape.states[frame, body])
            frame += 1
        tape.place[body, FRAME] = frame
        tape.integers[row, FRAME_END] = frame


@compiled
def finish(tape, world, now, broken):
    """Write the frames that are left; where the simulation broke off, bodies are shown where they were then."""
    for group in range(world.clock.shape[0]):
        if tape.place[group, ROW] >= 0:
            write_frames(tape, world, group, now if broken != 0.0 else math.inf)
    if broken != 0.0:
        for body in range(tape.place.shape[0]):
            if world.phase[body, ALIVE] != 0.0:
                for frame in range(tape.place[body, FRAME], tape.times.shape[0]):
                    evaluate_at(world, body, now, tape.states[frame, body])

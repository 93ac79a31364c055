"""Compiled record of a simulated world: its frames, and every piece of motion and every event in order."""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"

import math
from typing import NamedTuple

import numpy as np

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
PIECE, CONTINUE, RELEASE, STOP, SPIN_STOP, CONTACT = 0, 1, 2, 3, 4, 5
# Columns of integers. A piece is of a group; a row number of a piece says which piece an event ended.
KIND, FIRST, SECOND, BEFORE_FIRST, BEFORE_SECOND, FRAME_BEGIN, FRAME_END = 0, 1, 2, 3, 4, 5, 6
CONTACT_KIND = FRAME_BEGIN
INTEGERS = 7
# Columns of numbers. A piece: origin, length, states, phases. An event: its time. A contact: features, then its result.
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
def add_row(tape, kind, first, second, time):
    """Append a row and return its number; the caller keeps a reserve of rows."""
    row = tape.counts[ROWS]
    integers = tape.integers[row]
    integers[KIND], integers[FIRST], integers[SECOND] = kind, first, second
    integers[FRAME_BEGIN], integers[FRAME_END] = 0, 0
    integers[BEFORE_FIRST], integers[BEFORE_SECOND] = -1, -1
    if kind != PIECE:
        integers[BEFORE_FIRST] = tape.place[first // GROUP_SIZE, ROW]
        if second >= 0:
            integers[BEFORE_SECOND] = tape.place[second // GROUP_SIZE, ROW]
    tape.numbers[row, TIME] = time
    tape.counts[ROWS] = row + 1
    return row


@compiled
def add_piece(tape, world, group):
    """Append the current piece of a group."""
    row = add_row(tape, PIECE, group, -1, world.clock[group, ORIGIN])
    numbers = tape.numbers[row]
    numbers[1] = world.clock[group, LENGTH]
    at = 2
    for slot in range(GROUP_SIZE):
        for c in range(STATE_SIZE):
            numbers[at + c] = world.polynomial[group, 0, slot, c]
        at += STATE_SIZE
        for c in range(PHASE_SIZE):
            numbers[at + c] = world.phase[group * GROUP_SIZE + slot, c]
        at += PHASE_SIZE
    tape.place[group, ROW] = row


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
            write_frames(tape, world, group, now if broken else math.inf)
    if broken:
        for body in range(tape.place.shape[0]):
            if world.phase[body, ALIVE] != 0.0:
                for frame in range(tape.place[body, FRAME], tape.times.shape[0]):
                    evaluate_at(world, body, now, tape.states[frame, body])

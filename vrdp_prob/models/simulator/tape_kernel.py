"""Compiled record of a simulated world: its frames, and every piece of motion and every event in order."""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"

import math

from vrdp_prob.models.simulator.bundle import Bundle, floats, integer_room, integers, room
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
from vrdp_prob.models.simulator.laws_kernel import STATE_SIZE, compiled
from vrdp_prob.models.simulator.world_kernel import (
    ALIVE,
    FIXED,
    LENGTH,
    ORIGIN,
    evaluate,
    evaluate_at,
    share_of,
)

# Kinds of rows.
PIECE, CONTINUE, RELEASE, STOP, SPIN_STOP, CONTACT, PRESS, PART = 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0
KICK, CROSS = 8.0, 9.0
# Columns of integers. A row number of a piece says which piece an event ended. A piece is of a body; the pieces of a
# cluster stand together, its lasting contacts (PRESS) behind them, and know their first row and both numbers of rows.
# Where contacts part (PART) the motion stays smooth, except where one slides off its feature, which is named.
KIND, FIRST, SECOND, BEFORE_FIRST, BEFORE_SECOND, FRAME_BEGIN, FRAME_END = 0, 1, 2, 3, 4, 5, 6
CONTACT_KIND, HOLDS = FRAME_BEGIN, FRAME_END
BLOCK, BLOCK_PIECES, BLOCK_TOUCHES = SECOND, BEFORE_FIRST, BEFORE_SECOND
INTEGERS = 7
# Columns of numbers. A piece: origin, length, states, phases. An event: its time. A contact: features, then its result
# (or, where it slides off, the rate at which its room on the feature shrinks).
TIME, FEATURE, CLOSING_SPEED = 0, 1, 8
PIECE_PHASE = 2 + STATE_SIZE
# Columns of `place`: next frame of a body, row of its current piece.
FRAME, ROW = 0, 1
# Columns of `counts`.
ROWS, EVENTS = 0, 1
# Rows of `local`: result of a contact, states of both bodies, the state to show.
RESULT, STATE_A, STATE_B, SHOWN = 0, 1, 2, 3


Tape = Bundle(
    "Tape",
    integers=integers("row", INTEGERS),
    numbers=floats("row", "number"),
    times=floats("frame"),  # s
    trajectory=floats("frame", "shown", 3),  # [frame, body, (x, y, angle)], or its adjoint
    velocity=floats("moving_frame", "shown", 3),  # the same of (vx, vy, spin); its adjoint may be empty
    counts=integer_room(2),  # [(rows, events)]
    place=integer_room("body", 2),  # [body, (frame, row)]
    local=room(4, 20),  # [(result, state a, state b, state to show), 20]
)
"""Rows of the record, of all worlds behind each other, and where the output of a world goes."""


@compiled
def clear_tape(tape, start, begin):
    """Nothing recorded of a world whose rows begin at `begin`; before its release a body shows how it is released."""
    tape.counts[ROWS], tape.counts[EVENTS] = begin, 0
    for body in range(tape.place.shape[0]):
        tape.place[body, FRAME], tape.place[body, ROW] = 0, -1
    for frame in range(tape.times.shape[0]):
        for body in range(tape.trajectory.shape[1]):
            show(tape, frame, body, start[body])


@compiled
def show(tape, frame, body, state):
    """Write the state of a body into a frame."""
    for c in range(3):
        tape.trajectory[frame, body, c] = state[c]
        tape.velocity[frame, body, c] = state[3 + c]


@compiled
def add_row(tape, kind, first, time):
    """Append a row of one body and return its number; the caller keeps a reserve."""
    row = tape.counts[ROWS]
    integers = tape.integers[row]
    integers[KIND], integers[FIRST], integers[SECOND] = int(kind), first, -1
    integers[FRAME_BEGIN], integers[FRAME_END] = 0, 0
    integers[BEFORE_FIRST], integers[BEFORE_SECOND] = -1, -1
    if kind != PIECE:
        integers[BEFORE_FIRST] = tape.place[first, ROW]
    tape.numbers[row, TIME] = time
    tape.counts[ROWS] = row + 1
    return row


@compiled
def add_pair(tape, kind, first, second, time):
    """Append a row of two bodies and return its number."""
    row = add_row(tape, kind, first, time)
    tape.integers[row, SECOND] = second
    tape.integers[row, BEFORE_SECOND] = tape.place[second, ROW]
    return row


@compiled
def add_pieces(tape, world, cluster):
    """Append the next pieces of a cluster, with the states they begin with, and its lasting contacts."""
    block, size = tape.counts[ROWS], world.members[cluster, 0]
    for place in range(size):
        body = world.members[cluster, 1 + place]
        row = add_row(tape, PIECE, body, 0.0)
        tape.integers[row, BLOCK] = block
        for c in range(STATE_SIZE):
            tape.numbers[row, 2 + c] = world.polynomial[body, 0, c]
        tape.place[body, ROW] = block + place
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
        body = world.members[cluster, 1 + place]
        numbers = tape.numbers[tape.place[body, ROW]]
        numbers[TIME], numbers[1] = world.clock[body, ORIGIN], world.clock[body, LENGTH]
        for c in range(world.phase.shape[1]):
            numbers[PIECE_PHASE + c] = world.phase[body, c]


@compiled
def skip_frames(tape, body, until):
    """Leave out the frames of a body before a time."""
    while tape.place[body, FRAME] < tape.times.shape[0] and tape.times[tape.place[body, FRAME]] < until:
        tape.place[body, FRAME] += 1


@compiled
def write_frames(tape, world, body, until):
    """Write the frames before a time that the current piece of a body covers."""
    # What cannot move shows its state from the start.
    if world.phase[body, ALIVE] == 0.0 or world.kind[body, FIXED]:
        return
    row, frame, state = tape.place[body, ROW], tape.place[body, FRAME], tape.local[SHOWN]
    tape.integers[row, FRAME_BEGIN] = frame
    while frame < tape.times.shape[0] and tape.times[frame] < until:
        evaluate(world.polynomial[body], share_of(world, body, tape.times[frame]), state)
        show(tape, frame, body, state)
        frame += 1
    tape.place[body, FRAME] = frame
    tape.integers[row, FRAME_END] = frame


@compiled
def finish(tape, world, now, broken):
    """Write the frames that are left; where the simulation broke off, bodies are shown where they were then."""
    for body in range(world.clock.shape[0]):
        if tape.place[body, ROW] >= 0:
            write_frames(tape, world, body, now if broken != 0.0 else math.inf)
    if broken != 0.0:
        state = tape.local[SHOWN]
        for body in range(tape.trajectory.shape[1]):
            if world.phase[body, ALIVE] != 0.0:
                evaluate_at(world, body, now, state)
                for frame in range(tape.place[body, FRAME], tape.times.shape[0]):
                    show(tape, frame, body, state)

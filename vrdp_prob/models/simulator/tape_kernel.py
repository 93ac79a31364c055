"""Compiled record of one simulated world: every piece of motion and every event, in order."""

from typing import NamedTuple

import numpy as np

from vrdp_prob.models.simulator.laws_kernel import GROUP_SIZE, STATE_SIZE, compiled

PIECE, CONTINUE, RELEASE, STOP, SPIN_STOP, CONTACT = 0, 1, 2, 3, 4, 5
PHASE_SIZE = 4
INTEGERS = 7
"""Kind, group or first body, second body, piece before of the first and of the second, then for a piece its first and
last+1 frame, for a contact its kind."""
NUMBERS = max(2 + GROUP_SIZE * (STATE_SIZE + PHASE_SIZE), 16)
"""Piece: origin, length, states, phases. Event: time; contact: features (6), closing speed, impulse, point, normal."""


class Tape(NamedTuple):
    """Rows of the record."""

    integers: np.ndarray  # [row, INTEGERS]
    numbers: np.ndarray  # [row, NUMBERS]
    count: np.ndarray  # [(rows, contacts and stops)]


@compiled
def add_row(tape, kind, first, second, before_first, before_second, time):
    """Append a row and return its number; the caller keeps a reserve of rows."""
    row = tape.count[0]
    tape.integers[row, 0], tape.integers[row, 1], tape.integers[row, 2] = kind, first, second
    tape.integers[row, 3], tape.integers[row, 4] = before_first, before_second
    tape.integers[row, 5], tape.integers[row, 6] = 0, 0
    tape.numbers[row, 0] = time
    tape.count[0] = row + 1
    return row


@compiled
def add_piece(tape, motion_state, group):
    """Append the current piece of a group."""
    row = add_row(tape, PIECE, group, -1, -1, -1, motion_state.origin[group])
    numbers = tape.numbers[row]
    numbers[1] = motion_state.length[group]
    at = 2
    for slot in range(GROUP_SIZE):
        for c in range(STATE_SIZE):
            numbers[at] = motion_state.polynomial[group, 0, slot, c]
            at += 1
    for slot in range(GROUP_SIZE):
        for c in range(PHASE_SIZE):
            numbers[at] = motion_state.phase[group * GROUP_SIZE + slot, c]
            at += 1
    return row

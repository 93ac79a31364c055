"""Compiled entries: a batch of worlds, one after the other, forward and backward."""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: PLR0917

import numpy as np
from numba import njit

from vrdp_prob.models.simulator.adjoint_events_kernel import reverse_world
from vrdp_prob.models.simulator.adjoint_kernel import Adjoint
from vrdp_prob.models.simulator.detection_kernel import new_pairs
from vrdp_prob.models.simulator.laws_kernel import STATE_SIZE, allocating, compiled
from vrdp_prob.models.simulator.rollout_kernel import rollout_world
from vrdp_prob.models.simulator.tableau import DENSE
from vrdp_prob.models.simulator.tape_kernel import INTEGERS, NUMBERS, ROWS, Tape
from vrdp_prob.models.simulator.world_kernel import NOT_FINITE, STAGES, TAPE_FULL, new_world


@allocating
def is_finite(values):
    """Whether all numbers of an array are finite."""
    total = 0.0
    for value in values.flat:
        total += 0.0 * value
    return total == 0.0


@allocating
def joined(integers, numbers, first_row, world, tape):
    """Append the tape of a world to the tapes of the batch, which grow where they must."""
    begin, rows = first_row[world], tape.counts[ROWS]
    first_row[world + 1] = begin + rows
    if begin + rows > integers.shape[0]:
        more = begin + rows + integers.shape[0]
        longer_integers, longer_numbers = np.zeros((more, INTEGERS), np.int64), np.zeros((more, NUMBERS))
        copy_rows(longer_integers, longer_numbers, 0, integers, numbers, begin)
        integers, numbers = longer_integers, longer_numbers
    copy_rows(integers, numbers, begin, tape.integers, tape.numbers, rows)
    return integers, numbers


@compiled
def copy_rows(integers, numbers, begin, from_integers, from_numbers, rows):
    """Copy the first rows of a tape to a place in another."""
    for row in range(rows):
        for c in range(INTEGERS):
            integers[begin + row, c] = from_integers[row, c]
        for c in range(NUMBERS):
            numbers[begin + row, c] = from_numbers[row, c]


@compiled
def row_of(values, index):
    """Row of an array with one row for each world, or with one for all (or none)."""
    return min(index, max(values.shape[0] - 1, 0))


@njit(nogil=True, error_model="numpy", cache=True)
def rollout_batch(kinds, bodies, shared, start, times, event_limit, trajectory, velocity, outcomes):
    """Simulate worlds into the last three arrays; returns the joined tapes and the first row of each world.

    Arrays: `kinds` [world, body, (shape, fixed, present)], `bodies` [world, body, constant], `shared` [world,
    parameter], `start` [world, body, (state, release time)], `times` [world or 1, time] in s, `trajectory` and
    `velocity` [world, time, shown body, 3], `outcomes` [world].
    """
    worlds, count = kinds.shape[0], kinds.shape[1]
    capacity = 256 + 64 * count
    integers, numbers = np.zeros((64 * worlds, INTEGERS), np.int64), np.zeros((64 * worlds, NUMBERS))
    first_row = np.zeros(worlds + 1, np.int64)
    pairs = new_pairs(count)
    row_integers, row_numbers = np.zeros((capacity, INTEGERS), np.int64), np.zeros((capacity, NUMBERS))
    counts, place, local = np.zeros(2, np.int64), np.zeros((count, 2), np.int64), np.zeros((4, 16))
    for index in range(worlds):
        world = new_world(kinds[index], bodies[index], shared[index], start[index])
        of_world = times[row_of(times, index)], trajectory[index], velocity[index], local
        tape = Tape(row_integers, row_numbers, counts, place, *of_world)
        if is_finite(bodies[index]) and is_finite(shared[index]) and is_finite(start[index]):
            outcomes[index] = rollout_world(world, pairs, tape, event_limit)
            while outcomes[index] == TAPE_FULL:
                capacity = 2 * capacity
                row_integers, row_numbers = np.zeros((capacity, INTEGERS), np.int64), np.zeros((capacity, NUMBERS))
                tape = Tape(row_integers, row_numbers, counts, place, *of_world)
                outcomes[index] = rollout_world(world, pairs, tape, event_limit)
        else:
            outcomes[index] = NOT_FINITE
            counts[ROWS] = 0
            trajectory[index], velocity[index] = 0.0, 0.0
        integers, numbers = joined(integers, numbers, first_row, index, tape)
    return integers[: first_row[-1]], numbers[: first_row[-1]], first_row


@njit(nogil=True, error_model="numpy", cache=True)
def reverse_batch(
    kinds,
    bodies,
    shared,
    start,
    times,
    outcomes,
    integers,
    numbers,
    first_row,
    trajectory_bar,
    velocity_bar,
    bodies_bar,
    shared_bar,
    start_bar,
    times_bar,
):
    """Add the derivative to the last four arrays, from the adjoints of trajectory and velocity.

    Axes are as in `rollout_batch`; `velocity_bar` and `times_bar` may have no frames where nobody needs them.
    """
    count = kinds.shape[1]
    polynomial, frames = np.zeros((count, DENSE.shape[0], STATE_SIZE)), np.zeros((DENSE.shape[0], STATE_SIZE))
    state, leg, loaded = np.zeros((count, STATE_SIZE)), np.zeros(count), np.zeros(count, np.int64)
    stages, before = np.zeros((STAGES, count, STATE_SIZE)), np.zeros((count, STATE_SIZE))
    constraint, local = np.zeros(8), np.zeros((7, 16))
    for index in range(kinds.shape[0]):
        if outcomes[index] == NOT_FINITE:
            continue
        world = new_world(kinds[index], bodies[index], shared[index], start[index])
        adjoint = Adjoint(
            bodies_bar[index],
            shared_bar[index],
            start_bar[index],
            times_bar[row_of(times_bar, index)],
            polynomial,
            state,
            leg,
            loaded,
            stages,
            before,
            frames,
            constraint,
            local,
        )
        rows = slice(first_row[index], first_row[index + 1])
        bars = trajectory_bar[index], velocity_bar[row_of(velocity_bar, index)]
        reverse_world(world, adjoint, integers[rows], numbers[rows], times[row_of(times, index)], *bars)

"""Compiled entry: a batch of worlds, one after the other."""

import numpy as np
from numba import njit

from vrdp_prob.models.simulator.detection_kernel import Pairs
from vrdp_prob.models.simulator.laws_kernel import GROUP_SIZE, STATE_SIZE, compiled
from vrdp_prob.models.simulator.motion_kernel import Motion, Scene
from vrdp_prob.models.simulator.rollout_kernel import NOT_FINITE, RESULT_SIZE, TAPE_FULL, Track, rollout_world
from vrdp_prob.models.simulator.tableau import DENSE
from vrdp_prob.models.simulator.tape_kernel import INTEGERS, NUMBERS, PHASE_SIZE, Tape


@compiled
def new_motion(count):
    """Room for the motion of `count` bodies."""
    groups = count // GROUP_SIZE
    return Motion(
        np.zeros((count, PHASE_SIZE)),
        np.zeros(count, np.int64),
        np.zeros(groups),
        np.ones(groups),
        np.zeros(groups),
        np.zeros(groups, np.int64),
        np.zeros(groups, np.int64),
        np.zeros(groups),
        np.zeros((groups, DENSE.shape[0], GROUP_SIZE, STATE_SIZE)),
        np.zeros((DENSE.shape[1], GROUP_SIZE, STATE_SIZE)),
        np.zeros((GROUP_SIZE, STATE_SIZE)),
    )


@compiled
def new_pairs(count):
    """Room for the contacts of `count` bodies."""
    return Pairs(
        np.zeros((count, count)),
        np.zeros((count, count), np.int64),
        np.zeros((count, count), np.int64),
        np.zeros((count, count, 6)),
        np.zeros((count, count), np.int64),
        np.zeros((4, 8)),
        np.zeros(3),
        np.zeros(6),
    )


@compiled
def new_tape(rows):
    """Room for a record."""
    return Tape(np.zeros((rows, INTEGERS), np.int64), np.zeros((rows, NUMBERS)), np.zeros(2, np.int64))


@compiled
def is_finite(scene):
    """Whether all numbers of a world are finite."""
    return (
        np.isfinite(scene.body).all()
        and np.isfinite(scene.shared).all()
        and np.isfinite(scene.start).all()
        and np.isfinite(scene.release).all()
    )


@njit(nogil=True, error_model="numpy", cache=True)
def rollout_batch(shape, fixed, bodies, shared, start, release, present, times, event_limit, states, outcomes):
    """Simulate worlds into `states` and `outcomes`; returns the joined tapes and the first row of each world.

    Arrays: `shape`, `fixed` [body], `bodies` [world, body, constant], `shared` [world, parameter], `start` [world,
    body, state], `release` [world, body] in s, `present` [world, body], `times` [time] in s, `states` [world, time,
    body, state], `outcomes` [world].
    """
    worlds, count = release.shape
    motion_state, pairs, tape = new_motion(count), new_pairs(count), new_tape(64 + 16 * count)
    frame, row = np.zeros(count, np.int64), np.zeros(count // GROUP_SIZE, np.int64)
    result, ya, yb = np.zeros(RESULT_SIZE), np.zeros(STATE_SIZE), np.zeros(STATE_SIZE)
    first_row = np.zeros(worlds + 1, np.int64)
    integers, numbers = np.zeros((64 * worlds, INTEGERS), np.int64), np.zeros((64 * worlds, NUMBERS))
    for world in range(worlds):
        scene = Scene(shape, fixed, bodies[world], shared[world], start[world], release[world], present[world])
        track = Track(times, states[world], frame, row, result, ya, yb)
        if is_finite(scene):
            outcomes[world] = rollout_world(scene, motion_state, pairs, tape, track, event_limit)
            while outcomes[world] == TAPE_FULL:
                tape = new_tape(2 * tape.integers.shape[0])
                outcomes[world] = rollout_world(scene, motion_state, pairs, tape, track, event_limit)
            rows = tape.count[0]
        else:
            states[world] = 0.0
            outcomes[world] = NOT_FINITE
            rows = 0
        begin = first_row[world]
        first_row[world + 1] = begin + rows
        if begin + rows > integers.shape[0]:
            more = begin + rows + integers.shape[0]
            longer_integers, longer_numbers = np.zeros((more, INTEGERS), np.int64), np.zeros((more, NUMBERS))
            longer_integers[:begin], longer_numbers[:begin] = integers[:begin], numbers[:begin]
            integers, numbers = longer_integers, longer_numbers
        integers[begin : begin + rows] = tape.integers[:rows]
        numbers[begin : begin + rows] = tape.numbers[:rows]
    return integers[: first_row[-1]], numbers[: first_row[-1]], first_row

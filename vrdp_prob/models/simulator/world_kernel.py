"""Compiled: the arrays of one world while it is simulated.

Numbers that belong together share an array, with named columns, because the time to compile a function grows with the
number of arrays it is handed.
"""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"

import math
from typing import NamedTuple

import numpy as np

from vrdp_prob.models.simulator.laws_kernel import GROUP_SIZE, STATE_SIZE, allocating, compiled
from vrdp_prob.models.simulator.tableau import DENSE

DISC, SQUARE, WALL = 0, 1, 2
SHAPE, FIXED, PRESENT = 0, 1, 2
RADIUS = 4
RELEASE_TIME = STATE_SIZE
MOVING, REFERENCE_X, REFERENCE_Y, SPIN_SENSE, ALIVE, TRAVEL = 0, 1, 2, 3, 4, 5
PHASE_SIZE = 6
RESTING, SLIDING, SLIPPING = 0.0, 1.0, 2.0
ORIGIN, LENGTH, UNTIL, STEP, ENDING, ENDING_BODY = 0, 1, 2, 3, 4, 5
STAGES = DENSE.shape[1]
# Rows of `stages` behind those of a step: the state at hand, a derivative apart from the step, what pushes a body.
WORK, SPARE, PUSH = STAGES, STAGES + 1, STAGES + 2
# How a piece ends: its step is over, or a body stops (to spin), or never; in a cluster also by a contact that parts or
# passes to another feature, or by a resting body that is pushed to move or to spin.
CONTINUES, STOPS, SPIN_STOPS, LASTS, PARTS, SLIDES_OFF, YIELDS, TURNS = 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0
TOUCHES_PER_BODY = 4
"""Lasting contacts per body that a world has room for; two bodies in a plane share at most two, and few touch each."""


class World(NamedTuple):
    """What is simulated, and the current piece of motion of every group of bodies.

    A piece is a polynomial of the share of its length. A group holds one body, or all where an effect couples them.
    Groups that press on each other form a cluster, whose pieces begin and end together (see `cluster_kernel.py`).
    """

    kind: np.ndarray  # [body, (shape, fixed, present)]
    body: np.ndarray  # [body, constant]
    shared: np.ndarray  # [parameter]
    start: np.ndarray  # [body, (state at release, release time in s)]
    phase: np.ndarray  # [body, (moving, reference x, reference y, spin sense, alive, bound on the way)]
    clock: np.ndarray  # [group, (origin, length, end of validity, next step, how it ends, for which body)], s
    polynomial: np.ndarray  # [group, power, slot, state]
    stages: np.ndarray  # [stage and three for work, body, state]
    members: np.ndarray  # [group, (size of its cluster, groups in it)], two more rows of room
    touching: np.ndarray  # [lasting contact, (bodies, kind, features, how it holds, force, constraint)]
    matrix: np.ndarray  # [lasting contact, lasting contact and one], room for the equations of a cluster


@allocating
def new_world(kind, body, shared, start):
    """World with room for its motion, nothing released."""
    count = kind.shape[0]
    groups = count // GROUP_SIZE
    most = TOUCHES_PER_BODY * count
    world = World(
        kind,
        body,
        shared,
        start,
        np.zeros((count, PHASE_SIZE)),
        np.zeros((groups, 6)),
        np.zeros((groups, DENSE.shape[0], GROUP_SIZE, STATE_SIZE)),
        np.zeros((PUSH + 1, count, STATE_SIZE)),
        np.zeros((groups + 2, groups + 1), np.int64),
        np.zeros((most, 21)),
        np.zeros((most, most + 1)),
    )
    # What cannot move is always at hand.
    for fixed in range(count):
        if kind[fixed, FIXED]:
            for c in range(STATE_SIZE):
                world.stages[WORK, fixed, c] = start[fixed, c]
    return world


@compiled
def evaluate(polynomial, slot, share, out):
    """State of one body at a share of its piece."""
    for c in range(STATE_SIZE):
        out[c] = polynomial[DENSE.shape[0] - 1, slot, c]
    for power in range(DENSE.shape[0] - 2, -1, -1):
        for c in range(STATE_SIZE):
            out[c] = out[c] * share + polynomial[power, slot, c]


@compiled
def evaluate_rate(polynomial, slot, share, length, out):
    """Time derivative of the state of one body at a share of its piece."""
    for c in range(STATE_SIZE):
        out[c] = 0.0
    for power in range(DENSE.shape[0] - 1, 0, -1):
        for c in range(STATE_SIZE):
            out[c] = out[c] * share + power * polynomial[power, slot, c]
    for c in range(STATE_SIZE):
        out[c] /= length


@compiled
def share_of(world, group, t):
    """Share of a group's current piece at which a time lies."""
    return (t - world.clock[group, ORIGIN]) / world.clock[group, LENGTH]


@compiled
def evaluate_at(world, body, t, out):
    """State of a body at a time in its current piece."""
    group = body // GROUP_SIZE
    evaluate(world.polynomial[group], body - group * GROUP_SIZE, share_of(world, group, t), out)


@compiled
def clear_world(world):
    """Nothing released."""
    for body in range(world.phase.shape[0]):
        for c in range(PHASE_SIZE):
            world.phase[body, c] = 0.0
    world.members[world.clock.shape[0], 0] = 0
    for group in range(world.clock.shape[0]):
        world.members[group, 0], world.members[group, 1] = 1, group
        hold(world, group, 0.0)
        for slot in range(GROUP_SIZE):
            for c in range(STATE_SIZE):
                world.polynomial[group, 0, slot, c] = 0.0


@compiled
def hold(world, group, t):
    """Let a group stay in the state of its constant term."""
    world.clock[group, ORIGIN], world.clock[group, LENGTH] = t, 1.0
    world.clock[group, UNTIL], world.clock[group, ENDING] = math.inf, LASTS
    for power in range(1, DENSE.shape[0]):
        for slot in range(GROUP_SIZE):
            for c in range(STATE_SIZE):
                world.polynomial[group, power, slot, c] = 0.0
    for slot in range(GROUP_SIZE):
        world.phase[group * GROUP_SIZE + slot, TRAVEL] = 0.0

"""Compiled: the arrays of one world while it is simulated.

Numbers that belong together share an array, with named columns, because the time to compile a function grows with the
number of arrays it is handed.
"""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"

import math
from typing import NamedTuple

import numpy as np

from vrdp_prob.models.simulator.laws_kernel import BOUNDARIES, KICKS, STATE_SIZE, allocating, compiled, kick_time
from vrdp_prob.models.simulator.tableau import DENSE

DISC, SQUARE, WALL = 0, 1, 2
# Outcomes of a world, and that its tape has no room.
OK, OVERLAP, EVENT_LIMIT, NOT_SOLVED, NOT_FINITE, TAPE_FULL = 0, 1, 2, 3, 4, 5
SHAPE, FIXED, PRESENT = 0, 1, 2
INVERSE_MASS, INVERSE_INERTIA, RADIUS, IS_SPHERE = 1, 2, 4, 5
RELEASE_TIME = STATE_SIZE
MOVING, REFERENCE_X, REFERENCE_Y, SPIN_SENSE, ALIVE, TRAVEL, SIDES = 0, 1, 2, 3, 4, 5, 6
PHASE_SIZE = SIDES + BOUNDARIES
RESTING, SLIDING, SLIPPING = 0.0, 1.0, 2.0
ORIGIN, LENGTH, UNTIL, STEP, ENDING, ENDING_BODY = 0, 1, 2, 3, 4, 5
STAGES = DENSE.shape[1]
# Rows of `stages` behind those of a step: the state at hand, a derivative apart from the step, what pushes a body.
WORK, SPARE, PUSH = STAGES, STAGES + 1, STAGES + 2
# How a piece ends: its step is over, or a body stops (to spin), or never; in a cluster also by a contact that parts or
# passes to another feature, or by a resting body that is pushed to move or to spin; or a body crosses a boundary.
CONTINUES, STOPS, SPIN_STOPS, LASTS = 0.0, 1.0, 2.0, 3.0
PARTS, SLIDES_OFF, YIELDS, TURNS, CROSSES = 4.0, 5.0, 6.0, 7.0, 8.0
# What pushes a body, in the row PUSH: its acceleration without friction (2 numbers), what friction holds, the same for
# its spin; and whether it leans on others at rest.
BRAKE, TURN, LEANING = 3, 4, 5
# How a body leans: it would move alone, or it would turn; both add up.
LEANS_MOVING, LEANS_TURNING = 1.0, 2.0
TOUCHES_PER_BODY = 4
"""Lasting contacts per body that a world has room for; two bodies in a plane share at most two, and few touch each."""


class World(NamedTuple):
    """What is simulated, and the current piece of motion of every body.

    A piece is a polynomial of the share of its length. Bodies that press on each other, or all where an effect couples
    them, form a cluster, whose pieces begin and end together (see `cluster_kernel.py`).
    """

    kind: np.ndarray  # [body, (shape, fixed, present)]
    body: np.ndarray  # [body, constant]
    shared: np.ndarray  # [parameter]
    start: np.ndarray  # [body, (state at release, release time in s)]
    phase: np.ndarray  # [body, (moving, reference x, reference y, spin sense, alive, bound on the way, sides)]
    clock: np.ndarray  # [body, (origin, length, end of validity, next step, how it ends, for which body)], s
    polynomial: np.ndarray  # [body, power, state]
    stages: np.ndarray  # [stage and four for work, body, state]
    members: np.ndarray  # [body, (size of its cluster, bodies in it)], two more rows of room
    touching: np.ndarray  # [lasting contact, (bodies, kind, features, how it holds, force, constraint)]
    matrix: np.ndarray  # [lasting contact, lasting contact and one], room for the equations of a cluster
    force: np.ndarray  # [(force of a pair, its adjoint), 2], room for one
    kicks: np.ndarray  # [kick], times in s of those that are still to come


@allocating
def new_world(kind, body, shared, start):
    """World with room for its motion, nothing released."""
    count = kind.shape[0]
    most = TOUCHES_PER_BODY * count
    world = World(
        kind,
        body,
        shared,
        start,
        np.zeros((count, PHASE_SIZE)),
        np.zeros((count, 6)),
        np.zeros((count, DENSE.shape[0], STATE_SIZE)),
        np.zeros((PUSH + 2, count, STATE_SIZE)),
        np.zeros((count + 2, count + 1), np.int64),
        np.zeros((most, 21)),
        np.zeros((most, most + 1)),
        np.zeros((2, 2)),
        np.zeros(KICKS),
    )
    # What cannot move is always at hand.
    for fixed in range(count):
        if kind[fixed, FIXED]:
            for c in range(STATE_SIZE):
                world.stages[WORK, fixed, c] = start[fixed, c]
    return world


@compiled
def evaluate(polynomial, share, out):
    """State of a body at a share of its piece."""
    for c in range(STATE_SIZE):
        out[c] = polynomial[DENSE.shape[0] - 1, c]
    for power in range(DENSE.shape[0] - 2, -1, -1):
        for c in range(STATE_SIZE):
            out[c] = out[c] * share + polynomial[power, c]


@compiled
def evaluate_rate(polynomial, share, length, out):
    """Time derivative of the state of a body at a share of its piece."""
    for c in range(STATE_SIZE):
        out[c] = 0.0
    for power in range(DENSE.shape[0] - 1, 0, -1):
        for c in range(STATE_SIZE):
            out[c] = out[c] * share + power * polynomial[power, c]
    for c in range(STATE_SIZE):
        out[c] /= length


@compiled
def share_of(world, body, t):
    """Share of a body's current piece at which a time lies."""
    return (t - world.clock[body, ORIGIN]) / world.clock[body, LENGTH]


@compiled
def evaluate_at(world, body, t, out):
    """State of a body at a time in its current piece."""
    evaluate(world.polynomial[body], share_of(world, body, t), out)


@compiled
def clear_world(world):
    """Nothing released."""
    count = world.kind.shape[0]
    world.members[count, 0] = 0
    for which in range(KICKS):
        world.kicks[which] = kick_time(which, world.shared)
    for body in range(count):
        for c in range(PHASE_SIZE):
            world.phase[body, c] = 0.0
        world.members[body, 0], world.members[body, 1] = 1, body
        hold(world, body, 0.0)
        for c in range(STATE_SIZE):
            world.polynomial[body, 0, c] = 0.0


@compiled
def hold(world, body, t):
    """Let a body stay in the state of its constant term."""
    world.clock[body, ORIGIN], world.clock[body, LENGTH] = t, 1.0
    world.clock[body, UNTIL], world.clock[body, ENDING] = math.inf, LASTS
    world.phase[body, TRAVEL] = 0.0
    for power in range(1, DENSE.shape[0]):
        for c in range(STATE_SIZE):
            world.polynomial[body, power, c] = 0.0

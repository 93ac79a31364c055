"""Compiled: the arrays of one world while it is simulated.

Numbers that belong together share an array, with named columns, and the arrays a bundle (see `bundle.py`).
"""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"

import math

from vrdp_prob.models.simulator.bundle import Bundle, floats, integer_room, integers, room
from vrdp_prob.models.simulator.laws_kernel import KICKS, STATE_SIZE, compiled, kick_time
from vrdp_prob.models.simulator.tableau import DENSE

DISC, SQUARE, WALL = 0, 1, 2
# Outcomes of a world, and that its tape has no room.
OK, OVERLAP, EVENT_LIMIT, NOT_SOLVED, NOT_FINITE, TAPE_FULL = 0, 1, 2, 3, 4, 5
SHAPE, FIXED, PRESENT = 0, 1, 2
INVERSE_MASS, INVERSE_INERTIA, RADIUS, IS_SPHERE = 1, 2, 4, 5
RELEASE_TIME = STATE_SIZE
MOVING, REFERENCE_X, REFERENCE_Y, SPIN_SENSE, ALIVE, TRAVEL, SIDES = 0, 1, 2, 3, 4, 5, 6
RESTING, SLIDING, SLIPPING = 0.0, 1.0, 2.0
ORIGIN, LENGTH, UNTIL, STEP, ENDING, ENDING_BODY = 0, 1, 2, 3, 4, 5
TERMS, STAGES = DENSE.shape
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


World = Bundle(
    "World",
    kind=integers("body", 3),  # [body, (shape, fixed, present)]
    body=floats("body", "constant"),
    shared=floats("parameter"),
    start=floats("body", STATE_SIZE + 1),  # [body, (state at release, release time in s)]
    model=integers("entry"),  # see `laws_kernel.py`
    phase=room("body", "phase"),  # [body, (moving, reference x, reference y, spin sense, alive, bound on way, sides)]
    clock=room("body", 6),  # [body, (origin, length, end of validity, next step, how it ends, for which body)], s
    polynomial=room("body", TERMS, STATE_SIZE),
    stages=room(PUSH + 2, "body", STATE_SIZE),  # [stage and four for work, body, state]
    errors=room(2, STATE_SIZE),  # of the last step, see `step_errors`
    members=integer_room("list", "member"),  # [body, (size of its cluster, bodies in it)], two more rows of room
    touching=room("touch", 21),  # [lasting contact, (bodies, kind, features, how it holds, force, constraint)]
    matrix=room("touch", "column"),  # [lasting contact, lasting contact and one], the equations of a cluster
    force=room(2, 2),  # [(force of a pair, its adjoint), 2]
    kicks=room("kick"),  # [kick], times in s of those that are still to come
)
"""What is simulated, and the current piece of motion of every body.

A piece is a polynomial of the share of its length. Bodies that press on each other, or all where an effect couples
them, form a cluster, whose pieces begin and end together (see `cluster_kernel.py`).
"""


@compiled
def evaluate(polynomial, share, out):
    """State of a body at a share of its piece."""
    for c in range(STATE_SIZE):
        out[c] = polynomial[TERMS - 1, c]
    for power in range(TERMS - 2, -1, -1):
        for c in range(STATE_SIZE):
            out[c] = out[c] * share + polynomial[power, c]


@compiled
def evaluate_rate(polynomial, share, length, out):
    """Time derivative of the state of a body at a share of its piece."""
    for c in range(STATE_SIZE):
        out[c] = 0.0
    for power in range(TERMS - 1, 0, -1):
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
def roll_along(world, body, y):
    """While a body does not slip, its rolling velocity is its velocity, and only that is integrated."""
    if world.phase[body, MOVING] != SLIPPING:
        y[6], y[7] = y[3], y[4]


@compiled
def clear_world(world):
    """Nothing released; what cannot move is always at hand."""
    count = world.kind.shape[0]
    world.members[count, 0] = 0
    for which in range(world.model[KICKS]):
        world.kicks[which] = kick_time(world.model, which, world.shared)
    for body in range(count):
        for c in range(world.phase.shape[1]):
            world.phase[body, c] = 0.0
        world.members[body, 0], world.members[body, 1] = 1, body
        hold(world, body, 0.0)
        for c in range(STATE_SIZE):
            world.polynomial[body, 0, c] = 0.0
            for stage in range(world.stages.shape[0]):
                world.stages[stage, body, c] = 0.0
            if world.kind[body, FIXED]:
                world.stages[WORK, body, c] = world.start[body, c]


@compiled
def hold(world, body, t):
    """Let a body stay in the state of its constant term."""
    world.clock[body, ORIGIN], world.clock[body, LENGTH] = t, 1.0
    world.clock[body, UNTIL], world.clock[body, ENDING] = math.inf, LASTS
    world.phase[body, TRAVEL] = 0.0
    for power in range(1, TERMS):
        for c in range(STATE_SIZE):
            world.polynomial[body, power, c] = 0.0

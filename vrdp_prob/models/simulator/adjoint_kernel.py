"""Compiled reverse sweep: the exact derivative of a simulated world, its order of events held fixed.

The tape is read backwards. A piece passes the adjoint of its polynomial back through the stages of its Runge-Kutta step
(step lengths are constants), an event passes the adjoint of the states after it to the states before it and to its
time, and the time of a contact or a stop follows from what vanishes there (implicit function theorem). A leg, the
pieces from one event to the next, also has an adjoint of its beginning: what is read from it at a fixed time changes
against its rate when it begins later.
"""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: PLR0917

from vrdp_prob.models.simulator.apart_kernel import load_block_apart
from vrdp_prob.models.simulator.bundle import Bundle, floats, integer_room, room
from vrdp_prob.models.simulator.cluster_kernel import (
    HOLD,
    TOUCH_A,
    TOUCH_B,
    TOUCH_FEATURE,
    TOUCH_KIND,
    note_member,
    set_touch_count,
    spread,
)
from vrdp_prob.models.simulator.laws_kernel import STATE_SIZE, compiled
from vrdp_prob.models.simulator.motion_kernel import (
    PARTS_OF_STEP,
    compute_stages,
    is_still,
    match_velocities,
    set_polynomial,
)
from vrdp_prob.models.simulator.tape_kernel import (
    BLOCK,
    BLOCK_PIECES,
    BLOCK_TOUCHES,
    CONTACT_KIND,
    FEATURE,
    FIRST,
    HOLDS,
    PIECE_PHASE,
    SECOND,
    TIME,
)
from vrdp_prob.models.simulator.world_kernel import (
    ALIVE,
    FIXED,
    LENGTH,
    MOVING,
    SLIPPING,
    STAGES,
    TERMS,
    evaluate_rate,
    hold,
    share_of,
)

# Rows of `local`.
OF_A, OF_B, RATE_A, VALUE_A, VALUE_B, VELOCITIES, ONE = 0, 1, 2, 3, 4, 5, 6
FLATTEST = 1e-12
"""Rate below which the time of a stop has no derivative."""


Adjoint = Bundle(
    "Adjoint",
    body=floats("body", "constant"),
    shared=floats("parameter"),
    start=floats("body", STATE_SIZE + 1),  # [body, (state, release time)]
    times=floats("asked_frame"),  # or empty where nobody asks for it
    polynomial=room("body", TERMS, STATE_SIZE),
    state=room("body", STATE_SIZE),  # of the state with which the current piece begins
    leg=room("body"),  # of the beginning of the current leg
    loaded=integer_room("body"),  # row of the piece whose polynomial is at hand
    stages=room(STAGES, "body", STATE_SIZE),
    before=room("body", STATE_SIZE),  # of the state at which a stage or the contacts were evaluated
    frames=room(TERMS, STATE_SIZE),  # of the polynomial by the frames of one piece
    constraint=room(8),  # of the constraint of one contact
    local=room(7, 16),
)
"""Adjoints of one world while its tape is read backwards; those of its output are in the tape."""


@compiled
def load(world, adjoint, tape, row):
    """Compute the polynomials of recorded pieces of a cluster again, where one of them is not at hand."""
    if adjoint.loaded[tape.integers[row, FIRST]] != row:
        load_block_apart(world, adjoint, tape, tape.integers[row, BLOCK])


@compiled
def load_block(world, adjoint, tape, block):
    """Compute the polynomials of the recorded pieces of a cluster, which becomes the one at hand with its contacts."""
    size, touches = tape.integers[block, BLOCK_PIECES], tape.integers[block, BLOCK_TOUCHES]
    cluster = tape.integers[block, FIRST]
    world.members[world.clock.shape[0] + 1, 0] = 0
    for place in range(size):
        note_member(world, tape.integers[block + place, FIRST])
    spread(world)
    moving = False
    for row in range(block, block + size):
        body = tape.integers[row, FIRST]
        adjoint.loaded[body] = row
        load_state(world, body, tape.numbers[row])
        moving = moving or not is_still(world, body)
    load_touches(world, tape, block + size, touches)
    if moving:
        match_velocities(world, cluster)
        compute_stages(
            world, cluster, tape.numbers[block, TIME], tape.numbers[block, 1], PARTS_OF_STEP[0], PARTS_OF_STEP[3]
        )
        for row in range(block, block + size):
            world.clock[tape.integers[row, FIRST], LENGTH] = tape.numbers[block, 1]
            set_polynomial(world, tape.integers[row, FIRST], tape.numbers[block, 1])


@compiled
def load_state(world, body, numbers):
    """State and phase with which a recorded piece begins."""
    for c in range(STATE_SIZE):
        world.polynomial[body, 0, c] = numbers[2 + c]
    for c in range(world.phase.shape[1]):
        world.phase[body, c] = numbers[PIECE_PHASE + c]
    hold(world, body, numbers[TIME])


@compiled
def load_touches(world, tape, begin, count):
    """Take the recorded lasting contacts of a cluster as those at hand."""
    set_touch_count(world, count)
    for touch in range(count):
        row, entry = world.touching[touch], tape.integers[begin + touch]
        row[TOUCH_A], row[TOUCH_B], row[TOUCH_KIND] = entry[FIRST], entry[SECOND], entry[CONTACT_KIND]
        row[HOLD] = entry[HOLDS]
        for c in range(7):
            row[TOUCH_FEATURE + c] = tape.numbers[begin + touch, FEATURE + c]


@compiled
def read_frames(world, adjoint, tape, body, begin, end):
    """Adjoint of the frames that a piece shows."""
    if begin == end or world.phase[body, ALIVE] == 0.0 or world.kind[body, FIXED]:
        return
    clear(adjoint.frames)
    for frame in range(begin, end):
        share, factor = share_of(world, body, tape.times[frame]), 1.0
        for power in range(TERMS):
            for c in range(3):
                adjoint.frames[power, c] += factor * tape.trajectory[frame, body, c]
                if tape.velocity.shape[0] > 0:
                    adjoint.frames[power, 3 + c] += factor * tape.velocity[frame, body, c]
            factor *= share
    # What is read at fixed times changes against the rate of the motion when the leg begins later.
    polynomial, total = world.polynomial[body], 0.0
    for power in range(TERMS):
        for c in range(6):
            adjoint.polynomial[body, power, c] += adjoint.frames[power, c]
            if power > 0:
                total += power * polynomial[power, c] * adjoint.frames[power - 1, c]
    adjoint.leg[body] -= total / world.clock[body, LENGTH]
    if adjoint.times.shape[0] > 0:
        read_times(world, adjoint, tape, body, begin, end)


@compiled
def read_times(world, adjoint, tape, body, begin, end):
    """Adjoint of the times of the frames that a piece shows."""
    rate = adjoint.local[RATE_A]
    for frame in range(begin, end):
        evaluate_rate(world.polynomial[body], share_of(world, body, tape.times[frame]), world.clock[body, LENGTH], rate)
        for c in range(3):
            adjoint.times[frame] += tape.trajectory[frame, body, c] * rate[c]
            if tape.velocity.shape[0] > 0:
                adjoint.times[frame] += tape.velocity[frame, body, c] * rate[3 + c]


@compiled
def clear(values):
    """Set the numbers of a matrix to 0."""
    for row in range(values.shape[0]):
        for c in range(values.shape[1]):
            values[row, c] = 0.0


@compiled
def read(adjoint, body, share, bar):
    """Adjoint of a state that was read from a piece."""
    factor = 1.0
    for power in range(TERMS):
        for c in range(STATE_SIZE):
            adjoint.polynomial[body, power, c] += factor * bar[c]
        factor *= share


@compiled
def fold(world, adjoint, cluster):
    """While a body does not slip, its rolling velocity is its velocity; so are their adjoints before an event."""
    for place in range(world.members[cluster, 0]):
        body = world.members[cluster, 1 + place]
        fold_state(world, body, adjoint.state[body])


@compiled
def fold_state(world, body, bar):
    """Adjoint of `roll_along`."""
    if world.phase[body, MOVING] != SLIPPING:
        bar[3], bar[4] = bar[3] + bar[6], bar[4] + bar[7]
        bar[6], bar[7] = 0.0, 0.0


@compiled
def shift_of(world, adjoint, cluster, t):
    """Adjoint of the time of an event by the legs that begin with it and by the states after it.

    The latter is the product of their adjoints with the rates before the event, of all bodies of a cluster.
    """
    fold(world, adjoint, cluster)
    total = 0.0
    for place in range(world.members[cluster, 0]):
        body = world.members[cluster, 1 + place]
        total += adjoint.leg[body] + product(world, adjoint, body, adjoint.state[body], t)
    return total


@compiled
def product(world, adjoint, body, bar, t):
    """Product of the adjoint of a body's state with its rate before an event, which is left in `local`."""
    rate, total = adjoint.local[RATE_A], 0.0
    evaluate_rate(world.polynomial[body], share_of(world, body, t), world.clock[body, LENGTH], rate)
    for c in range(STATE_SIZE):
        total += bar[c] * rate[c]
    return total


@compiled
def end_legs(world, adjoint, cluster, t):
    """Read the states before an event from the pieces that it ended; the legs before it are the current ones then."""
    fold(world, adjoint, cluster)
    for place in range(world.members[cluster, 0]):
        body = world.members[cluster, 1 + place]
        bar = adjoint.state[body]
        adjoint.leg[body] = -product(world, adjoint, body, bar, t)
        read(adjoint, body, share_of(world, body, t), bar)


@compiled
def continue_legs(world, adjoint, cluster, t):
    """Read the states in which pieces go on from those before, within a leg."""
    fold(world, adjoint, cluster)
    for place in range(world.members[cluster, 0]):
        body = world.members[cluster, 1 + place]
        read(adjoint, body, share_of(world, body, t), adjoint.state[body])

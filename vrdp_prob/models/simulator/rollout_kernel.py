"""Compiled event loop: the earliest of releases, piece ends and contacts, one after the other."""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: PLR0917

import math

from vrdp_prob.models.simulator.detection_kernel import (
    CONTACT_TIME,
    CRAWL,
    LAST_CONTACT,
    OVERLAPPING,
    OWNER,
    PAIR_FEATURE,
    PAIR_KIND,
    SLACK,
)
from vrdp_prob.models.simulator.laws_kernel import GROUP_SIZE, SLIPS, STATE_SIZE, compiled, contact_law
from vrdp_prob.models.simulator.motion_kernel import advance, settle
from vrdp_prob.models.simulator.search_kernel import depth, search_group, search_pair
from vrdp_prob.models.simulator.tape_kernel import (
    CLOSING_SPEED,
    CONTACT,
    CONTACT_KIND,
    CONTINUE,
    EVENTS,
    FEATURE,
    RELEASE,
    RESULT,
    ROW,
    ROWS,
    SPIN_STOP,
    STATE_A,
    STATE_B,
    STOP,
    add_piece,
    add_row,
    clear_tape,
    finish,
    skip_frames,
    write_frames,
)
from vrdp_prob.models.simulator.world_kernel import (
    ALIVE,
    CONTINUES,
    ENDING,
    ENDING_BODY,
    FIXED,
    MOVING,
    PRESENT,
    RELEASE_TIME,
    RESTING,
    SPIN_SENSE,
    STEP,
    STOPS,
    UNTIL,
    clear_world,
    evaluate,
    evaluate_at,
    hold,
    share_of,
)

OK, OVERLAP, EVENT_LIMIT, NOT_SOLVED, NOT_FINITE, TAPE_FULL = 0, 1, 2, 3, 4, 5
ROWS_PER_EVENT = 16
"""Rows of the tape after which a world counts as having too many events, per event that is allowed."""


@compiled
def leave_piece(world, tape, group, t):
    """Finish the current piece of a group at a time and put its state there into the constant term."""
    write_frames(tape, world, group, t)
    share = share_of(world, group, t)
    for slot in range(GROUP_SIZE):
        y = tape.local[STATE_A]
        evaluate(world.polynomial[group], slot, share, y)
        phase = world.phase[group * GROUP_SIZE + slot]
        if phase[MOVING] == RESTING:
            y[3], y[4] = 0.0, 0.0
        if phase[SPIN_SENSE] == 0.0:
            y[5] = 0.0
        for c in range(STATE_SIZE):
            world.polynomial[group, 0, slot, c] = y[c]
    hold(world, group, t)


@compiled
def begin_piece(world, tape, group, t, horizon):
    """Start a piece of a group from its constant term; returns an outcome."""
    solved = advance(world, group, t, horizon)
    add_piece(tape, world, group)
    return OK if solved else NOT_SOLVED


@compiled
def overlaps(world, pairs, body, t):
    """Note the bodies that overlap with one that appears; returns an outcome."""
    outcome = OK
    for other in range(world.kind.shape[0]):
        if other == body or world.phase[other, ALIVE] == 0.0 or (world.kind[body, FIXED] and world.kind[other, FIXED]):
            continue
        i, j = min(body, other), max(body, other)
        if depth(world, pairs, i, j, t) < -SLACK:
            pairs.table[i, j, OVERLAPPING] = 1.0
            outcome = OVERLAP
    return outcome


@compiled
def release(world, pairs, tape, body, horizon):
    """Let a body into the world; returns an outcome."""
    t = world.start[body, RELEASE_TIME]
    group = body // GROUP_SIZE
    slot = body - group * GROUP_SIZE
    add_row(tape, RELEASE, body, -1, t)
    if tape.place[group, ROW] >= 0:
        leave_piece(world, tape, group, t)
    y = world.polynomial[group, 0, slot]
    for c in range(STATE_SIZE):
        y[c] = world.start[body, c]
    world.phase[body, ALIVE] = 1.0
    skip_frames(tape, body, t)
    settle(world, body, t, y)
    hold(world, group, t)
    world.clock[group, STEP] = math.inf
    outcome = overlaps(world, pairs, body, t)
    result = begin_piece(world, tape, group, t, horizon)
    search_group(world, pairs, group, t, horizon)
    return max(outcome, result)


@compiled
def end_piece(world, pairs, tape, group, horizon):
    """Go on where a piece of motion ends: with the next piece, with rolling or with rest."""
    t, ending = world.clock[group, UNTIL], world.clock[group, ENDING]
    body = int(world.clock[group, ENDING_BODY])
    if ending == CONTINUES:
        add_row(tape, CONTINUE, group * GROUP_SIZE, -1, t)
        leave_piece(world, tape, group, t)
    else:
        add_row(tape, STOP if ending == STOPS else SPIN_STOP, body, -1, t)
        tape.counts[EVENTS] += 1
        leave_piece(world, tape, group, t)
        y = world.polynomial[group, 0, body - group * GROUP_SIZE]
        if ending != STOPS:
            y[5] = 0.0
        elif SLIPS and world.phase[body, MOVING] == 2.0:
            y[6], y[7] = y[3], y[4]
        else:
            y[3], y[4] = 0.0, 0.0
        settle(world, body, t, y)
    result = begin_piece(world, tape, group, t, horizon)
    search_group(world, pairs, group, t, horizon)
    return result


@compiled
def resume(world, tape, body, t, result):
    """Give a body the velocities after a contact."""
    group = body // GROUP_SIZE
    y = world.polynomial[group, 0, body - group * GROUP_SIZE]
    for c in range(3):
        y[3 + c] = result[c]
    settle(world, body, t, y)


@compiled
def restart(world, pairs, tape, a, b, t, horizon):
    """Start new pieces for the bodies of a contact; both move on before either looks for contacts."""
    group_a, group_b = a // GROUP_SIZE, b // GROUP_SIZE
    both = not world.kind[b, FIXED] and group_b != group_a
    outcome = OK
    if not world.kind[a, FIXED]:
        outcome = begin_piece(world, tape, group_a, t, horizon)
    if both:
        outcome = max(outcome, begin_piece(world, tape, group_b, t, horizon))
    if not world.kind[a, FIXED]:
        search_group(world, pairs, group_a, t, horizon)
    if both:
        search_group(world, pairs, group_b, t, horizon)
    return outcome


@compiled
def collide(world, pairs, tape, i, j, horizon):
    """Resolve the contact of a pair; returns an outcome."""
    t, kind = pairs.table[i, j, CONTACT_TIME], int(pairs.table[i, j, PAIR_KIND])
    a = int(pairs.table[i, j, OWNER])
    b = i + j - a
    feature = pairs.table[i, j, PAIR_FEATURE:]
    result, ya, yb = tape.local[RESULT], tape.local[STATE_A], tape.local[STATE_B]
    evaluate_at(world, a, t, ya)
    evaluate_at(world, b, t, yb)
    contact_law(kind, ya, yb, world.body[a], world.body[b], feature, world.shared, result)
    if not result[6] > 0.0:
        search_pair(world, pairs, i, j, t + CRAWL, horizon)
        return OK
    pairs.table[i, j, LAST_CONTACT] = t
    row = add_row(tape, CONTACT, a, b, t)
    tape.counts[EVENTS] += 1
    tape.integers[row, CONTACT_KIND] = kind
    for c in range(7):
        tape.numbers[row, FEATURE + c] = feature[c]
    for c in range(7):
        tape.numbers[row, CLOSING_SPEED + c] = result[6 + c]
    if not world.kind[a, FIXED]:
        leave_piece(world, tape, a // GROUP_SIZE, t)
    if not world.kind[b, FIXED] and b // GROUP_SIZE != a // GROUP_SIZE:
        leave_piece(world, tape, b // GROUP_SIZE, t)
    if not world.kind[a, FIXED]:
        resume(world, tape, a, t, result[0:3])
    if not world.kind[b, FIXED]:
        resume(world, tape, b, t, result[3:6])
    return restart(world, pairs, tape, a, b, t, horizon)


@compiled
def next_event(world, pairs):
    """Time, kind (0 release, 1 piece end, 2 contact) and participants of the earliest event."""
    count = world.kind.shape[0]
    time, kind, first, second = math.inf, -1, -1, -1
    for body in range(count):
        release_time = world.start[body, RELEASE_TIME]
        if world.kind[body, PRESENT] and world.phase[body, ALIVE] == 0.0 and release_time < time:
            time, kind, first = release_time, 0, body
    for group in range(world.clock.shape[0]):
        if world.clock[group, UNTIL] < time:
            time, kind, first = world.clock[group, UNTIL], 1, group
    for i in range(count):
        for j in range(i + 1, count):
            if pairs.table[i, j, CONTACT_TIME] < time:
                time, kind, first, second = pairs.table[i, j, CONTACT_TIME], 2, i, j
    return time, kind, first, second


@compiled
def clear_pairs(pairs):
    """No contact known."""
    for i in range(pairs.table.shape[0]):
        for j in range(pairs.table.shape[0]):
            pairs.table[i, j, CONTACT_TIME], pairs.table[i, j, OVERLAPPING] = math.inf, 0.0
            pairs.table[i, j, LAST_CONTACT] = -math.inf


@compiled
def rollout_world(world, pairs, tape, event_limit):
    """Simulate one world; returns an outcome."""
    clear_world(world)
    clear_pairs(pairs)
    clear_tape(tape, world.start)
    horizon = tape.times[-1]
    outcome = OK
    while True:
        time, kind, first, second = next_event(world, pairs)
        if not time <= horizon or (kind == 1 and time >= horizon):
            finish(tape, world, horizon, False)
            return outcome
        rows = tape.counts[ROWS]
        if rows + 8 > tape.integers.shape[0]:
            return TAPE_FULL
        result = EVENT_LIMIT
        if tape.counts[EVENTS] < event_limit and rows < ROWS_PER_EVENT * (event_limit + 1):
            if kind == 0:
                result = release(world, pairs, tape, first, horizon)
            elif kind == 1:
                result = end_piece(world, pairs, tape, first, horizon)
            else:
                result = collide(world, pairs, tape, first, second, horizon)
        outcome = max(outcome, result)
        if result in (EVENT_LIMIT, NOT_SOLVED):
            finish(tape, world, time, True)
            return outcome

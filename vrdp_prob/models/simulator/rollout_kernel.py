"""Compiled event loop: the earliest of releases, piece ends and contacts, one after the other."""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"

import math

from vrdp_prob.models.simulator.apart_kernel import collide_apart, end_pieces_apart
from vrdp_prob.models.simulator.detection_kernel import CONTACT_TIME, LAST_CONTACT, OVERLAPPING
from vrdp_prob.models.simulator.event_kernel import kick_bodies, release
from vrdp_prob.models.simulator.laws_kernel import KICKS, compiled
from vrdp_prob.models.simulator.tape_kernel import EVENTS, ROWS, clear_tape, finish
from vrdp_prob.models.simulator.world_kernel import (
    ALIVE,
    EVENT_LIMIT,
    NOT_SOLVED,
    OK,
    PRESENT,
    RELEASE_TIME,
    TAPE_FULL,
    TOUCHES_PER_BODY,
    UNTIL,
    clear_world,
)

ROWS_PER_BODY = 1 + TOUCHES_PER_BODY
"""Rows that an event may add for each body of the world: its next piece and its lasting contacts."""
ROWS_PER_EVENT = 16
"""Rows of the tape after which a world counts as having too many events, per event that is allowed."""


@compiled
def next_event(world, pairs):
    """Time, kind (0 release, 1 piece end, 2 contact, 3 kick) and participants of the earliest event."""
    count = world.kind.shape[0]
    time, kind, first, second = math.inf, -1, -1, -1
    for body in range(count):
        release_time = world.start[body, RELEASE_TIME]
        if world.kind[body, PRESENT] and world.phase[body, ALIVE] == 0.0 and release_time < time:
            time, kind, first = release_time, 0, body
    for cluster in range(count):
        if world.clock[cluster, UNTIL] < time:
            time, kind, first = world.clock[cluster, UNTIL], 1, cluster
    for which in range(world.model[KICKS]):
        if world.kicks[which] < time:
            time, kind, first = world.kicks[which], 3, which
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
def rollout_world(world, pairs, tape, begin, event_limit):
    """Simulate one world, recorded from a row on; returns an outcome."""
    clear_world(world)
    clear_pairs(pairs)
    clear_tape(tape, world.start, begin)
    horizon = tape.times[-1]
    outcome = OK
    while True:
        time, kind, first, second = next_event(world, pairs)
        if not time <= horizon or (kind == 1 and time >= horizon):
            finish(tape, world, horizon, 0.0)
            return outcome
        row = tape.counts[ROWS]
        if row + 8 + ROWS_PER_BODY * world.kind.shape[0] > tape.integers.shape[0]:
            return TAPE_FULL
        result = EVENT_LIMIT
        if tape.counts[EVENTS] < event_limit and row - begin < ROWS_PER_EVENT * (event_limit + 1):
            if kind == 0:
                result = release(world, pairs, tape, first, horizon)
            elif kind == 1:
                result = end_pieces_apart(world, pairs, tape, first, horizon)
            elif kind == 3:
                result = kick_bodies(world, pairs, tape, first, horizon)
            else:
                result = collide_apart(world, pairs, tape, first, second, horizon)
        outcome = max(outcome, result)
        if result in (EVENT_LIMIT, NOT_SOLVED):
            finish(tape, world, time, 1.0)
            return outcome

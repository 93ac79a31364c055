"""Compiled: what each event does to the motion."""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: PLR0917

import math

from vrdp_prob.models.simulator.apart_kernel import (
    begin_clusters_apart,
    depth_apart,
    restart_apart,
    search_pair_apart,
)
from vrdp_prob.models.simulator.cluster_kernel import (
    HOLD,
    PARTED,
    PRESSES,
    TOUCH_A,
    TOUCH_B,
    TOUCH_FEATURE,
    TOUCH_KIND,
    cluster_of,
    cluster_of_touch,
    join,
    set_touch_count,
    touch_count,
)
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
from vrdp_prob.models.simulator.ending_kernel import LINGERING, rest_at_once, set_sides, settle
from vrdp_prob.models.simulator.laws_kernel import (
    AFTER_CONTACT,
    BOUNDARIES,
    COUPLED,
    RUBS,
    STATE_SIZE,
    compiled,
    contact_law,
    kick,
)
from vrdp_prob.models.simulator.motion import ROLLING_SHARE
from vrdp_prob.models.simulator.motion_kernel import cluster_derivatives, take_states
from vrdp_prob.models.simulator.piece_kernel import forget, leave_piece, leave_pieces
from vrdp_prob.models.simulator.pressing_kernel import ROOM_COUNTS, gentle_speed, set_push, start, start_spin
from vrdp_prob.models.simulator.tape_kernel import (
    BEFORE_SECOND,
    CLOSING_SPEED,
    CONTACT,
    CONTACT_KIND,
    CONTINUE,
    CROSS,
    EVENTS,
    FEATURE,
    HOLDS,
    KICK,
    PART,
    RELEASE,
    RESULT,
    ROW,
    SECOND,
    SPIN_STOP,
    STATE_A,
    STATE_B,
    STOP,
    add_pair,
    add_row,
    skip_frames,
)
from vrdp_prob.models.simulator.world_kernel import (
    ALIVE,
    CONTINUES,
    CROSSES,
    ENDING,
    ENDING_BODY,
    FIXED,
    MOVING,
    OK,
    OVERLAP,
    PARTS,
    RELEASE_TIME,
    SIDES,
    SLIDES_OFF,
    SLIDING,
    SLIPPING,
    SPARE,
    SPIN_STOPS,
    STEP,
    STOPS,
    UNTIL,
    YIELDS,
    evaluate_at,
    hold,
    roll_along,
)

CLOSING = 2 * AFTER_CONTACT
"""Place of the closing speed in the result of a contact's law, behind what both bodies do."""


@compiled
def overlaps(world, pairs, body, t):
    """Note the bodies that overlap with one that appears; returns an outcome."""
    outcome = OK
    for other in range(world.kind.shape[0]):
        if other == body or world.phase[other, ALIVE] == 0.0 or (world.kind[body, FIXED] and world.kind[other, FIXED]):
            continue
        i, j = min(body, other), max(body, other)
        if depth_apart(world, pairs, i, j, t) < -SLACK:
            pairs.table[i, j, OVERLAPPING] = 1.0
            outcome = OVERLAP
    return outcome


@compiled
def release(world, pairs, tape, body, horizon):
    """Let a body into the world; returns an outcome."""
    t = world.start[body, RELEASE_TIME]
    row = add_row(tape, RELEASE, body, t)
    y = world.polynomial[body, 0]
    for c in range(STATE_SIZE):
        y[c] = world.start[body, c]
    world.phase[body, ALIVE] = 1.0
    skip_frames(tape, body, t)
    hold(world, body, t)
    world.clock[body, STEP] = math.inf
    set_sides(world, body, y)
    cluster = body
    if world.model[COUPLED] and not world.kind[body, FIXED]:
        cluster = join_others(world, tape, row, body, t)
    settle(world, body, t, y)
    outcome = overlaps(world, pairs, body, t)
    return max(outcome, begin_clusters_apart(world, pairs, tape, cluster, t, horizon))


@compiled
def join_others(world, tape, row, body, t):
    """Let a body that appears move with all others; returns their cluster."""
    cluster = body
    for other in range(world.clock.shape[0]):
        if other != body and world.phase[other, ALIVE] != 0.0 and not world.kind[other, FIXED]:
            tape.integers[row, SECOND], tape.integers[row, BEFORE_SECOND] = other, tape.place[other, ROW]
            leave_piece(world, tape, other, t)
            cluster = join(world, body, other)
    return cluster


@compiled
def end_pieces(world, pairs, tape, cluster, horizon):
    """Go on where the pieces of a cluster end: with the next, with rolling, with rest, or with other contacts."""
    t, ending = world.clock[cluster, UNTIL], world.clock[cluster, ENDING]
    what = int(world.clock[cluster, ENDING_BODY])
    if ending == CONTINUES:
        add_row(tape, CONTINUE, cluster, t)
        leave_pieces(world, tape, cluster, t)
        return begin_clusters_apart(world, pairs, tape, cluster, t, horizon)
    if ending in (STOPS, SPIN_STOPS):
        add_row(tape, STOP if ending == STOPS else SPIN_STOP, what, t)
        tape.counts[EVENTS] += 1
        leave_pieces(world, tape, cluster, t)
        stop(world, cluster, what, t, ending == STOPS)
    elif ending == CROSSES:
        cross(world, tape, cluster, what, t)
    else:
        change_contacts(world, pairs, tape, cluster, t, ending, what)
    return restart_apart(world, pairs, tape, cluster, t, horizon)


@compiled
def stop(world, cluster, body, t, moves):
    """Let a body stop to move, or only to spin; what moves with it as slowly stops too."""
    y = world.polynomial[body, 0]
    if moves:  # how short steps had to be before says nothing of those behind
        world.clock[body, STEP] = math.inf
    if not moves:
        y[5] = 0.0
    elif world.phase[body, MOVING] == SLIPPING:
        begin_rolling(y)
    else:
        rest_at_once(y)
        for place in range(world.members[cluster, 0] if world.members[cluster, 0] > 1 else 0):
            member = world.members[cluster, 1 + place]
            other = world.polynomial[member, 0]
            if world.phase[member, MOVING] == SLIDING and math.hypot(other[3], other[4]) <= 2.0 * LINGERING:
                rest_at_once(other)
    settle(world, body, t, y)


@compiled
def begin_rolling(y):
    """Take what is left of a slip from velocity and rolling velocity as friction does."""
    for c in range(2):
        rolling = ROLLING_SHARE * y[3 + c] + (1.0 - ROLLING_SHARE) * y[6 + c]
        y[3 + c], y[6 + c] = rolling, rolling


@compiled
def cross(world, tape, cluster, what, t):
    """Let a body pass to the other side of a boundary."""
    body = what // world.model[BOUNDARIES]
    which = what - body * world.model[BOUNDARIES]
    row = add_row(tape, CROSS, body, t)
    tape.integers[row, SECOND] = which
    leave_pieces(world, tape, cluster, t)
    world.phase[body, SIDES + which] = -world.phase[body, SIDES + which]
    settle(world, body, t, world.polynomial[body, 0])


@compiled
def kick_bodies(world, pairs, tape, which, horizon):
    """Change the velocities of all bodies at the time of a kick; returns an outcome."""
    t, change, outcome = world.kicks[which], tape.local[RESULT], OK
    world.kicks[which] = math.inf
    for body in range(world.kind.shape[0]):
        if world.kind[body, FIXED] or world.phase[body, ALIVE] == 0.0:
            continue
        row = add_row(tape, KICK, body, t)
        tape.integers[row, SECOND] = which
        cluster = cluster_of(world, body)
        leave_pieces(world, tape, cluster, t)
        y = world.polynomial[body, 0]
        kick(world.model, which, t, y, world.body[body], world.shared, change)
        for c in range(3):
            y[3 + c] += change[c]
        settle(world, body, t, y)
        outcome = max(outcome, restart_apart(world, pairs, tape, cluster, t, horizon))
    return outcome


@compiled
def pressing_place(world, cluster, touch):
    """Place of a lasting contact among those of its cluster, in the order of the tape."""
    place = 0
    for other in range(touch):
        if world.touching[other, HOLD] == PRESSES and cluster_of_touch(world, other) == cluster:
            place += 1
    return place


@compiled
def change_contacts(world, pairs, tape, cluster, t, ending, what):
    """A contact parts or slides off its feature, or a body at rest is pushed to move or to spin."""
    row = add_row(tape, PART, cluster, t)
    tape.integers[row, HOLDS] = -1
    if ending == SLIDES_OFF:
        tape.integers[row, HOLDS] = pressing_place(world, cluster, what)
    leave_pieces(world, tape, cluster, t)
    if ending in (PARTS, SLIDES_OFF):
        world.touching[what, HOLD] = PARTED
        forget(world, pairs, cluster, PARTED, t)
        return
    take_states(world, cluster, 0.0)
    cluster_derivatives(world, cluster, t, SPARE)
    set_push(world, what, t)
    if ending == YIELDS:
        start(world, what)
    else:
        start_spin(world, what)


@compiled
def resume(world, body, t, result):
    """Give a body the velocities after a contact."""
    y = world.polynomial[body, 0]
    for c in range(AFTER_CONTACT):
        y[3 + c] = result[c]
    settle(world, body, t, y)


@compiled
def hold_contact(world, a, b, kind, feature):
    """Add a lasting contact to the list; whether to stay, the next pieces decide."""
    touch = touch_count(world)
    if touch == world.touching.shape[0]:
        return
    row = world.touching[touch]
    row[TOUCH_A], row[TOUCH_B], row[TOUCH_KIND] = a, b, kind
    for c in range(6):
        row[TOUCH_FEATURE + c] = feature[c]
    row[ROOM_COUNTS] = 1.0
    set_touch_count(world, touch + 1)


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
    roll_along(world, a, ya)
    roll_along(world, b, yb)
    contact_law(world.model, kind, ya, yb, world.body[a], world.body[b], feature, world.shared, result)
    if not result[CLOSING] > 0.0:
        search_pair_apart(world, pairs, i, j, t + CRAWL, horizon)
        return OK
    if feature[6] != 0.0 and world.model[RUBS] == 0 and result[CLOSING] > gentle_speed(world, a, b):
        feature[6] = 0.0
        contact_law(world.model, kind, ya, yb, world.body[a], world.body[b], feature, world.shared, result)
    pairs.table[i, j, LAST_CONTACT] = t
    row = add_pair(tape, CONTACT, a, b, t)
    tape.counts[EVENTS] += 1
    tape.integers[row, CONTACT_KIND] = kind
    for c in range(7):
        tape.numbers[row, FEATURE + c] = feature[c]
    for c in range(7):
        tape.numbers[row, CLOSING_SPEED + c] = result[CLOSING + c]
    cluster = cluster_of(world, a if world.kind[b, FIXED] else b)
    if not world.kind[a, FIXED] and cluster_of(world, a) != cluster:
        leave_pieces(world, tape, cluster_of(world, a), t)
    leave_pieces(world, tape, cluster, t)
    if not world.kind[a, FIXED] and not world.kind[b, FIXED]:
        cluster = join(world, a, b)
    if feature[6] != 0.0 and world.model[RUBS] == 0:
        hold_contact(world, a, b, kind, feature)
    if not world.kind[a, FIXED]:
        resume(world, a, t, result[0:AFTER_CONTACT])
    if not world.kind[b, FIXED]:
        resume(world, b, t, result[AFTER_CONTACT:CLOSING])
    return restart_apart(world, pairs, tape, cluster, t, horizon)

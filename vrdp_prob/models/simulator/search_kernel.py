"""Compiled search for the next contact of a pair of bodies."""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: PLR0917

import math

from vrdp_prob.models.simulator.apart_kernel import search_pair_apart
from vrdp_prob.models.simulator.cluster_kernel import TOUCH_A, TOUCH_B, TOUCH_FEATURE, touch_count
from vrdp_prob.models.simulator.detection_kernel import (
    ACCELERATION,
    ANGLE_FIRST,
    BOUNDS,
    CONTACT_TIME,
    CRAWL,
    CURVATURE,
    GAP,
    KNOWN,
    LAST_CONTACT,
    LOOK,
    LOOK_FEATURE,
    OVERLAPPING,
    OWNER,
    PAIR_FEATURE,
    PAIR_KIND,
    POWERS,
    PRESSING,
    RATE,
    SLACK,
    SPIN,
    TOUCHING,
    TURNING,
    add_path,
    bound,
    box_box,
    box_disc,
    closes,
    disc_disc,
    plane_bound,
    touching_walk,
    walk,
)
from vrdp_prob.models.simulator.laws_kernel import compiled
from vrdp_prob.models.simulator.pressing_kernel import touches
from vrdp_prob.models.simulator.world_kernel import (
    ALIVE,
    DISC,
    MOVING,
    RADIUS,
    RESTING,
    SHAPE,
    SPIN_SENSE,
    SQUARE,
    TRAVEL,
    UNTIL,
    WALL,
)

PRESSING_TIME = 0.02
"""Time in s after a contact within which two bodies press on each other when they meet again and close slowly."""
CLEARING = 1e-3
"""Shortest time in s between two looks at bodies that overlap."""


@compiled
def outer_radius(world, body):
    """Radius of a circle around the body's centre that holds it."""
    radius = world.body[body, RADIUS]
    return radius * math.sqrt(2.0) if world.kind[body, SHAPE] == SQUARE else radius


@compiled
def distance_of_pieces(world, i, j):
    """Lower bound on the distance of two centres over their whole pieces."""
    first, second = world.polynomial[i, 0], world.polynomial[j, 0]
    return (
        math.sqrt((first[0] - second[0]) ** 2 + (first[1] - second[1]) ** 2)
        - world.phase[i, TRAVEL]
        - world.phase[j, TRAVEL]
    )


@compiled
def passing_distance(path):
    """Lower bound on the distance of two centres on the overlap: straight motion, less what acceleration can change."""
    x, y, vx, vy = path[0, 0], path[1, 0], path[0, 1], path[1, 1]
    square = vx * vx + vy * vy
    s = min(1.0, max(0.0, -(x * vx + y * vy) / square)) if square > 0.0 else 0.0
    return math.sqrt((x + s * vx) ** 2 + (y + s * vy) ** 2) - 0.5 * plane_bound(path, 2)


@compiled
def set_path(world, pairs, i, j, t, duration):
    """Relative motion of two bodies as polynomials of the share of `duration`."""
    for row in range(4):
        for power in range(8):
            pairs.local[row, power] = 0.0
    work = pairs.local[POWERS]
    for c in range(3):
        if c < 2:
            add_path(world, j, t, duration, 1.0, c, work, pairs.local[c])
            add_path(world, i, t, duration, -1.0, c, work, pairs.local[c])
        else:
            if world.kind[i, SHAPE] != DISC:
                add_path(world, i, t, duration, 1.0, c, work, pairs.local[ANGLE_FIRST])
            if world.kind[j, SHAPE] != DISC:
                add_path(world, j, t, duration, 1.0, c, work, pairs.local[ANGLE_FIRST + 1])


@compiled
def set_bounds(world, pairs, i, j):
    """Bounds on what lets the rate of a gap fall, in the frames of both bodies."""
    path, bounds = pairs.local, pairs.local[BOUNDS]
    acceleration, velocity, distance = plane_bound(path, 2), plane_bound(path, 1), plane_bound(path, 0)
    bounds[ACCELERATION] = acceleration
    for own in range(2):
        spin, other = bound(path[ANGLE_FIRST + own], 1), bound(path[ANGLE_FIRST + 1 - own], 1)
        change, other_change = bound(path[ANGLE_FIRST + own], 2), bound(path[ANGLE_FIRST + 1 - own], 2)
        reach = outer_radius(world, j if own == 0 else i)
        bounds[TURNING + own] = 2.0 * spin * velocity + (spin * spin + change) * distance
        bounds[TURNING + own] += reach * ((spin + other) ** 2 + change + other_change)
        bounds[SPIN + own] = spin


@compiled
def look(world, pairs, i, j, s):
    """Look at a pair at one place; returns 0 for point and point, 1 for line and point, plus 2 if j owns the line."""
    half_i, half_j = world.body[i, RADIUS], world.body[j, RADIUS]
    shape_i, shape_j = world.kind[i, SHAPE], world.kind[j, SHAPE]
    if shape_i == DISC and shape_j == DISC:
        return disc_disc(pairs, s, half_i + half_j)
    if shape_i == DISC:
        return 2 + box_disc(pairs, s, half_j, shape_j == WALL, half_i, 1.0)
    if shape_j == DISC:
        return box_disc(pairs, s, half_i, shape_i == WALL, half_j, 0.0)
    return box_box(pairs, s, half_i, half_j, shape_i == WALL, shape_j == WALL)


@compiled
def certain_step(world, pairs, i, j, duration):
    """Step along the overlap that passes no contact."""
    gap, rate = pairs.local[LOOK, GAP], pairs.local[LOOK, RATE]
    touching = gap <= TOUCHING
    if world.kind[i, SHAPE] != DISC and world.kind[j, SHAPE] != DISC:
        step = pairs.local[LOOK, CURVATURE]
    elif touching:
        step = touching_walk(gap, rate, pairs.local[LOOK, CURVATURE])
    else:
        step = walk(gap, rate, pairs.local[LOOK, CURVATURE])
    return max(step, CRAWL / duration) if touching else step


@compiled
def closing(world, pairs, i, j, low, high, duration):
    """First place behind one where touching bodies do not collide, and before one where they do, at which they do."""
    while True:
        middle = 0.5 * (low + high)
        if middle <= low or middle >= high:
            return high, look(world, pairs, i, j, high)
        look(world, pairs, i, j, middle)
        gap, rate = pairs.local[LOOK, GAP], pairs.local[LOOK, RATE] / duration
        if gap <= TOUCHING and closes(gap, rate):
            high = middle
        else:
            low = middle


@compiled
def search(world, pairs, i, j, t, end):
    """Find the next contact of bodies i < j in [t, end] and store it; infinity where there is none."""
    pairs.table[i, j, CONTACT_TIME] = math.inf
    duration = end - t
    if not duration > 0.0:
        return
    # Too far apart to meet, whatever the way: by the whole pieces, then by the overlap of both.
    reach = outer_radius(world, i) + outer_radius(world, j)
    if distance_of_pieces(world, i, j) > reach:
        pairs.table[i, j, OVERLAPPING] = 0.0
        return
    set_path(world, pairs, i, j, t, duration)
    if passing_distance(pairs.local) > reach:
        pairs.table[i, j, OVERLAPPING] = 0.0
        return
    set_bounds(world, pairs, i, j)
    turning = outer_radius(world, i) * bound(pairs.local[ANGLE_FIRST], 1)
    turning += outer_radius(world, j) * bound(pairs.local[ANGLE_FIRST + 1], 1)
    fastest = plane_bound(pairs.local, 1) + turning
    s, free = 0.0, 0.0
    while s <= 1.0:
        code = look(world, pairs, i, j, s)
        gap, rate = pairs.local[LOOK, GAP], pairs.local[LOOK, RATE] / duration
        if pairs.table[i, j, OVERLAPPING]:
            if gap >= 0.0:
                pairs.table[i, j, OVERLAPPING] = 0
            else:
                s += max(-gap / fastest, CLEARING / duration)
            continue
        if gap <= TOUCHING and closes(gap, rate):
            if gap <= -SLACK:
                s, code = closing(world, pairs, i, j, free, s, duration)
            pairs.table[i, j, CONTACT_TIME] = t + s * duration
            pairs.table[i, j, PAIR_KIND] = code % 2
            pairs.table[i, j, OWNER] = j if code >= 2 else i
            pressing = pairs.table[i, j, CONTACT_TIME] - pairs.table[i, j, LAST_CONTACT] < PRESSING_TIME
            pairs.table[i, j, PRESSING] = 1.0 if pressing else 0.0
            for c in range(6):
                pairs.table[i, j, PAIR_FEATURE + c] = pairs.local[LOOK_FEATURE, c]
            return
        free = s
        s += certain_step(world, pairs, i, j, duration)


@compiled
def depth(world, pairs, i, j, t):
    """Gap of two bodies at one time."""
    set_path(world, pairs, i, j, t, 1.0)
    look(world, pairs, i, j, 0.0)
    return pairs.local[LOOK, GAP]


@compiled
def note_touches(world, pairs, i, j):
    """Note the corners of two squares that press already, so that no look sees them."""
    known = 0
    for touch in range(touch_count(world)):
        row = world.touching[touch]
        a, b = int(row[TOUCH_A]), int(row[TOUCH_B])
        if known < 2 and ((a == i and b == j) or (a == j and b == i)):
            out = pairs.local[KNOWN + known]
            out[0], out[1] = 1.0, 1.0 if a == j else 0.0
            out[2], out[3] = row[TOUCH_FEATURE], row[TOUCH_FEATURE + 1]
            out[4], out[5] = row[TOUCH_FEATURE + 3], row[TOUCH_FEATURE + 4]
            known += 1
    for place in range(known, 2):
        pairs.local[KNOWN + place, 0] = 0.0


@compiled
def search_pair(world, pairs, body, other, t, horizon):
    """Search the next contact of two bodies while both current pieces hold."""
    i, j = min(body, other), max(body, other)
    pairs.table[i, j, CONTACT_TIME] = math.inf
    first, second = world.phase[i], world.phase[j]
    if first[ALIVE] == 0.0 or second[ALIVE] == 0.0:
        return
    if first[MOVING] == RESTING and second[MOVING] == RESTING and first[SPIN_SENSE] == 0.0 == second[SPIN_SENSE]:
        return
    # A disc has no second place that could touch; of a square the other corners are looked at.
    if touches(world, i, j) and (world.kind[i, SHAPE] == DISC or world.kind[j, SHAPE] == DISC):
        return
    note_touches(world, pairs, i, j)
    end = min(world.clock[i, UNTIL], world.clock[j, UNTIL], horizon)
    search(world, pairs, i, j, t, end)


@compiled
def search_body(world, pairs, body, t, horizon):
    """Search the contacts of a body with all others from a time on."""
    for other in range(world.kind.shape[0]):
        if other != body:
            search_pair_apart(world, pairs, body, other, t, horizon)

"""Compiled detection of contacts: pure geometry of polynomial pieces, without physics.

A search walks along the overlap of two pieces. At each place it knows the gap `g` along a direction that separates the
bodies, its rate `r`, and a bound `m` on how fast that rate can fall in the rest of the overlap, so that the gap stays
above `g + r s - m s^2 / 2`: the walk goes to the root of that parabola and can pass no contact. Near a contact this is
Newton's method. The bound for discs uses that the distance of two points is convex in their difference, for squares the
same in the frame that turns with the side. Source of the idea: B. Mirtich, Impulse-based dynamic simulation of rigid
body systems, PhD thesis, Berkeley 1996, section 2.3 (conservative advancement), here of second order.
"""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: PLR0917

import math

from vrdp_prob.models.simulator.bundle import Bundle, room
from vrdp_prob.models.simulator.laws_kernel import compiled
from vrdp_prob.models.simulator.world_kernel import LENGTH, share_of

TOUCHING = 1e-12
"""Gap in m below which two bodies touch."""
SLOW = 1e-4
"""Closing speed in m/s below which touching bodies may press into each other by SLACK before they collide."""
SLACK = 1e-7
"""Depth in m of that, and of an overlap that is not yet an error."""
STILL = 1e-9
"""Closing speed in m/s below which bodies do not collide, however deep: rounding errors of the velocities are less."""
UNNOTICED = 1e-9
"""Depth in m by which bodies that are SLACK deep, and do not close, may come closer between two looks."""
CRAWL = 1e-6
"""Shortest walk in s while two bodies touch."""
# Columns of `table`; a contact has 6 numbers of features (x, y, extent of the owner, the same of the other).
CONTACT_TIME, PAIR_KIND, OWNER, OVERLAPPING, LAST_CONTACT, PAIR_FEATURE, PRESSING = 0, 1, 2, 3, 4, 5, 11
# Rows of `local`: the difference of the positions and both angles as polynomials; a look; its features; two corners
# that press already (whether there is one, whether the second body owns the side, the side's normal, the corner);
# bounds on what lets a rate fall; the corner nearest to a side; room for one polynomial.
ANGLE_FIRST, LOOK, LOOK_FEATURE, KNOWN, BOUNDS, CORNER, POWERS = 2, 4, 5, 6, 8, 9, 10
GAP, RATE, CURVATURE = 0, 1, 2
# Columns of the bounds: the relative acceleration; what turning adds to it in the frame of each; the spin of each.
ACCELERATION, TURNING, SPIN = 0, 1, 3


Pairs = Bundle(
    "Pairs",
    # [first, second, (time, kind, owner, overlapping, last contact, features, pressing)] with first < second
    table=room("body", "body", 12),
    local=room(11, 8),
)
"""Next contact of each pair, and room for a search."""


@compiled
def set_feature(pairs, at, x, y, extent):
    """Note one of the two features of a look."""
    pairs.local[LOOK_FEATURE, at] = x
    pairs.local[LOOK_FEATURE, at + 1] = y
    pairs.local[LOOK_FEATURE, at + 2] = extent


@compiled
def set_look(pairs, gap, rate, curvature):
    """Note a look."""
    pairs.local[LOOK, GAP], pairs.local[LOOK, RATE], pairs.local[LOOK, CURVATURE] = gap, rate, curvature


@compiled
def restrict(polynomial, c, offset, scale, sign, work, out):
    """Add `sign` times a coordinate, as a polynomial of `s` with share = offset + scale * s, to `out`."""
    degree = polynomial.shape[0] - 1
    for power in range(degree + 1):
        work[power] = polynomial[power, c]
    if offset != 0.0:
        for low in range(degree):
            for power in range(degree - 1, low - 1, -1):
                work[power] += offset * work[power + 1]
    factor = sign
    for power in range(degree + 1):
        out[power] += factor * work[power]
        factor *= scale


@compiled
def add_path(world, body, t, duration, sign, c, work, out):
    """Add a coordinate of a body on [t, t + duration], as a polynomial of the share of `duration`, to `out`."""
    scale = duration / world.clock[body, LENGTH]
    restrict(world.polynomial[body], c, share_of(world, body, t), scale, sign, work, out)


@compiled
def value(coefficients, s):
    """Value of a polynomial."""
    total = 0.0
    for power in range(7, -1, -1):
        total = total * s + coefficients[power]
    return total


@compiled
def slope(coefficients, s):
    """Derivative of a polynomial."""
    total = 0.0
    for power in range(7, 0, -1):
        total = total * s + power * coefficients[power]
    return total


@compiled
def bound(coefficients, order):
    """Bound on the absolute value of a polynomial (order 0), its first or its second derivative, on [0, 1]."""
    total = 0.0
    for power in range(order, 8):
        factor = 1.0 if order == 0 else (power if order == 1 else power * (power - 1))
        total += factor * abs(coefficients[power])
    return total


@compiled
def plane_bound(path, order):
    """Bound on the length of the difference vector or of a derivative of it, on [0, 1]."""
    return math.sqrt(bound(path[0], order) ** 2 + bound(path[1], order) ** 2)


@compiled
def fall_along(pairs, own, x, y):
    """Bound on the fall of the rate of a gap along a direction that turns with one of the bodies.

    Of the relative acceleration only what is along the direction counts, and of the rest what the direction turns to:
    by less than the bound on the spin, since the overlap is [0, 1] long. The distance of two points is never less than
    that along a direction, so the bound holds for it, too.
    """
    path, bounds, place = pairs.local, pairs.local[BOUNDS], int(own)
    along = bounds[SPIN + place] * bounds[ACCELERATION]
    for power in range(2, 8):
        along += power * (power - 1) * abs(x * path[0, power] + y * path[1, power])
    return bounds[TURNING + place] + min(along, bounds[ACCELERATION])


@compiled
def walk(gap, rate, curvature):
    """Largest step that certainly keeps the gap positive."""
    if rate < 0.0:
        return 2.0 * gap / (math.sqrt(rate * rate + 2.0 * curvature * gap) - rate)
    if curvature <= 0.0:
        return math.inf
    return (rate + math.sqrt(rate * rate + 2.0 * curvature * gap)) / curvature


@compiled
def touching_walk(gap, rate, curvature):
    """Largest step of touching bodies: until they may be SLACK deep, or, where they are, noticeably deeper."""
    return walk(max(gap + SLACK, UNNOTICED), rate, curvature)


@compiled
def closes(gap, rate):
    """Whether touching bodies collide."""
    return rate < -SLOW or (gap <= -SLACK and rate < -STILL)


@compiled
def disc_disc(pairs, s, reach):
    """Gap of two discs."""
    dx, dy = value(pairs.local[0], s), value(pairs.local[1], s)
    distance = math.sqrt(dx * dx + dy * dy)
    nx, ny = dx / max(distance, 1e-300), dy / max(distance, 1e-300)
    rate = nx * slope(pairs.local[0], s) + ny * slope(pairs.local[1], s)
    set_look(pairs, distance - reach, rate, fall_along(pairs, 0.0, nx, ny))
    set_feature(pairs, 0, 0.0, 0.0, 1.0)
    set_feature(pairs, 3, 0.0, 0.0, 1.0)
    return 0


@compiled
def box_disc(pairs, s, half, flat, radius, own):
    """Gap of a square (or a straight wall, `flat`) and a disc; `own` is 1.0 where the square is the second body."""
    sign, angle_row = 1.0 - 2.0 * own, ANGLE_FIRST + int(own)
    dx, dy = sign * value(pairs.local[0], s), sign * value(pairs.local[1], s)
    vx, vy = sign * slope(pairs.local[0], s), sign * slope(pairs.local[1], s)
    angle, spin = value(pairs.local[angle_row], s), slope(pairs.local[angle_row], s)
    cosine, sine = math.cos(angle), math.sin(angle)
    x, y = cosine * dx + sine * dy, -sine * dx + cosine * dy
    half_y = 0.0 if flat else half
    outside_x, outside_y = abs(x) - half, abs(y) - half_y
    kind = 1
    if outside_x > 0.0 and outside_y > 0.0:
        kind = 0
        px, py = math.copysign(half, x), math.copysign(half_y, y)
        distance = math.sqrt((x - px) ** 2 + (y - py) ** 2)
        nx, ny = (x - px) / distance, (y - py) / distance
        set_feature(pairs, 0, math.copysign(1.0, x), 0.0 if flat else math.copysign(1.0, y), 0.0)
    elif flat and outside_x > 0.0:
        kind = 0
        distance = outside_x
        nx, ny = math.copysign(1.0, x), 0.0
        set_feature(pairs, 0, nx, 0.0, 0.0)
    elif outside_x > outside_y and not flat:
        distance = outside_x
        nx, ny = math.copysign(1.0, x), 0.0
        set_feature(pairs, 0, nx, 0.0, 1.0)
    else:
        distance = outside_y
        nx, ny = 0.0, math.copysign(1.0, y)
        set_feature(pairs, 0, 0.0, ny, 0.0 if flat else 1.0)
    set_feature(pairs, 3, 0.0, 0.0, 1.0)
    wx, wy = cosine * nx - sine * ny, sine * nx + cosine * ny
    rate = wx * (vx + spin * dy) + wy * (vy - spin * dx)
    set_look(pairs, distance - radius, rate, fall_along(pairs, own, wx, wy))
    return kind


@compiled
def is_known(pairs, swapped, face_x, face_y, x, y):
    """Whether a corner presses on a side already."""
    for place in range(KNOWN, KNOWN + 2):
        row = pairs.local[place]
        same_side = (row[1] != 0.0) == swapped and row[2] == face_x and row[3] == face_y
        if row[0] != 0.0 and same_side and row[4] == x and row[5] == y:
            return True
    return False


@compiled
def box_side(pairs, s, swapped, half_a, half_b, flat_b, face_x, face_y, corner):
    """Gap between a side of one box and its nearest corner of the other.

    Writes gap, rate and the chosen corner; returns the certain step over all corners. Corners that press already are
    left out.
    """
    sign = -1.0 if swapped else 1.0
    row_a = ANGLE_FIRST + 1 if swapped else ANGLE_FIRST
    row_b = ANGLE_FIRST if swapped else ANGLE_FIRST + 1
    dx, dy = sign * value(pairs.local[0], s), sign * value(pairs.local[1], s)
    vx, vy = sign * slope(pairs.local[0], s), sign * slope(pairs.local[1], s)
    angle_a, spin_a = value(pairs.local[row_a], s), slope(pairs.local[row_a], s)
    angle_b, spin_b = value(pairs.local[row_b], s), slope(pairs.local[row_b], s)
    nx = math.cos(angle_a) * face_x - math.sin(angle_a) * face_y
    ny = math.sin(angle_a) * face_x + math.cos(angle_a) * face_y
    fall = fall_along(pairs, 1.0 if swapped else 0.0, nx, ny)
    cosine, sine = math.cos(angle_b), math.sin(angle_b)
    least, step = math.inf, math.inf
    for index in range(4):
        sx = 1.0 if index < 2 else -1.0
        sy = 0.0 if flat_b else (1.0 if index % 2 == 0 else -1.0)
        if is_known(pairs, swapped, face_x, face_y, sx, sy):
            continue
        ox, oy = half_b * (cosine * sx - sine * sy), half_b * (sine * sx + cosine * sy)
        px, py = dx + ox, dy + oy
        gap = nx * px + ny * py - half_a
        rate = nx * (vx - spin_b * oy + spin_a * py) + ny * (vy + spin_b * ox - spin_a * px)
        if gap <= TOUCHING:
            # Corners that touch: the one that closes fastest counts.
            if least > TOUCHING or rate < corner[1]:
                corner[0], corner[1], corner[2], corner[3] = gap, rate, sx, sy
            step = min(step, touching_walk(gap, rate, fall))
        else:
            if gap < least:
                corner[0], corner[1], corner[2], corner[3] = gap, rate, sx, sy
            step = min(step, walk(gap, rate, fall))
        least = min(least, gap)
    corner[4] = least
    return step


@compiled
def box_box(pairs, s, half_i, half_j, flat_i, flat_j):
    """Gap of two boxes: the largest over the sides of both (separating axes).

    The look holds the certain step in place of the curvature. Returns 1, plus 2 where the second box owns the side.
    """
    corner = pairs.local[CORNER]
    best = -math.inf
    result = 1
    for swapped in range(2):
        half_a, half_b = (half_j, half_i) if swapped else (half_i, half_j)
        flat_a, flat_b = (flat_j, flat_i) if swapped else (flat_i, flat_j)
        height = 0.0 if flat_a else half_a
        for index in range(4):
            if flat_a and index % 2 == 0:
                continue
            x = 1.0 if index == 0 else (-1.0 if index == 2 else 0.0)
            y = 1.0 if index == 1 else (-1.0 if index == 3 else 0.0)
            step = box_side(pairs, s, swapped == 1, height, half_b, flat_b, x, y, corner)
            if corner[4] > best:
                best = corner[4]
                result = 1 + 2 * swapped
                set_look(pairs, corner[0], corner[1], step)
                set_feature(pairs, 0, x, y, 0.0 if flat_a else 1.0)
                set_feature(pairs, 3, corner[2], corner[3], 0.0)
    return result

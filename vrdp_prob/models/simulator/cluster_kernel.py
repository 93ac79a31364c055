"""Compiled clusters: bodies that press on each other (or attract each other), and the forces that keep them in touch.

A lasting contact keeps its gap: the gap's second time derivative `J a + d` is 0, where `J` is the gradient of the gap
by the positions of its two bodies, `a` their accelerations and `d` what the velocities alone contribute. The forces are
along `J`, so `a = a0 + W J^T f` with the accelerations `a0` without contacts and the inverse masses `W`, and `f` solves
`J W J^T f = -(J a0 + d)`. The same equations without `d`, for velocities in place of accelerations, give the impulses
that take away the velocities at which the gaps change.
Source: D. Baraff, Fast contact force computation for nonpenetrating rigid bodies, SIGGRAPH 1994.
"""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: PLR0917

import math

from vrdp_prob.models.simulator.laws_kernel import (
    CONSTRAINT_LAW_VJP,
    COUPLED,
    SLIPS,
    compiled,
    constraint_law,
    contact_vjp,
)
from vrdp_prob.models.simulator.motion import ROLLING_SHARE
from vrdp_prob.models.simulator.world_kernel import (
    FIXED,
    INVERSE_INERTIA,
    INVERSE_MASS,
    IS_SPHERE,
    MOVING,
    RESTING,
    SLIPPING,
    SPIN_SENSE,
    WORK,
)

# Columns of `touching`. A contact has 7 numbers of features, as in a contact's law.
TOUCH_A, TOUCH_B, TOUCH_KIND, TOUCH_FEATURE, HOLD, FORCE, GRADIENT, QUADRATIC, ROOM = 0, 1, 2, 3, 10, 11, 12, 18, 19
ROOM_RATE = 20
# How a contact holds: not any more; between bodies at rest; its velocities were matched only; it presses.
PARTED, LEANS, MATCHES, PRESSES = 0.0, 1.0, 2.0, 3.0
RIDGE = 1e-10
"""Share by which the diagonal of the equations is raised, so that contacts which hold the same can share a force."""


@compiled
def touch_count(world):
    """Number of lasting contacts."""
    return world.members[world.clock.shape[0], 0]


@compiled
def set_touch_count(world, count):
    """Keep the first `count` lasting contacts."""
    world.members[world.clock.shape[0], 0] = count


@compiled
def cluster_of(world, body):
    """Cluster of a body, named by its first body."""
    return world.members[body, 1]


@compiled
def cluster_of_touch(world, touch):
    """Cluster of a lasting contact; what cannot move belongs to none."""
    a, b = int(world.touching[touch, TOUCH_A]), int(world.touching[touch, TOUCH_B])
    return cluster_of(world, b if world.kind[a, FIXED] else a)


@compiled
def presses(world, cluster):
    """Whether a lasting contact belongs to a cluster."""
    found = False
    for touch in range(touch_count(world)):
        found = found or cluster_of_touch(world, touch) == cluster
    return found


@compiled
def is_alone(world, cluster):
    """Whether a cluster is one body that nothing touches."""
    return world.members[cluster, 0] == 1 and not (touch_count(world) > 0 and presses(world, cluster))


@compiled
def join(world, body, other):
    """Make one cluster of the clusters of two bodies; returns its name."""
    first, second = cluster_of(world, body), cluster_of(world, other)
    count = world.clock.shape[0]
    world.members[count + 1, 0] = 0
    for member in range(count):
        if cluster_of(world, member) in (first, second):
            note_member(world, member)
    spread(world)
    return world.members[count, 1]


@compiled
def note_member(world, body):
    """Append a body to the list in the row behind all bodies, whose length stands in the row after it."""
    count = world.clock.shape[0]
    size = world.members[count + 1, 0] + 1
    world.members[count, size] = body
    world.members[count + 1, 0] = size


@compiled
def spread(world):
    """Give the noted list of bodies to all of them."""
    count = world.clock.shape[0]
    size = world.members[count + 1, 0]
    for place in range(size):
        row = world.members[world.members[count, 1 + place]]
        row[0] = size
        for other in range(size):
            row[1 + other] = world.members[count, 1 + other]


@compiled
def split(world, cluster):
    """Split a cluster into what its lasting contacts connect.

    The last row gets the new cluster of each body, or -1 for a body that was not in the old one.
    """
    count, coupled = world.clock.shape[0], world.model[COUPLED] != 0
    labels = world.members[count + 1]
    for body in range(count):
        inside = cluster_of(world, body) == cluster
        labels[1 + body] = (cluster if coupled else body) if inside else -1
    changed = not coupled
    while changed:
        changed = False
        for touch in range(touch_count(world)):
            a, b = int(world.touching[touch, TOUCH_A]), int(world.touching[touch, TOUCH_B])
            if world.kind[a, FIXED] or world.kind[b, FIXED] or cluster_of_touch(world, touch) != cluster:
                continue
            if labels[1 + a] != labels[1 + b]:
                labels[1 + a] = labels[1 + b] = min(labels[1 + a], labels[1 + b])
                changed = True
    for body in range(count):
        if labels[1 + body] == body:
            labels[0] = 0
            for member in range(count):
                if labels[1 + member] == body:
                    note_member(world, member)
            spread(world)


@compiled
def push_mobility(world, body):
    """Acceleration of a body per force; a sphere that may slip rolls along, which takes part of the force."""
    slips = world.model[SLIPS] != 0
    rolls = slips and world.body[body, IS_SPHERE] != 0.0 and world.phase[body, MOVING] != SLIPPING
    return world.body[body, INVERSE_MASS] * (ROLLING_SHARE if rolls else 1.0)


@compiled
def mobility(world, body, c, curved):
    """Change of a velocity (vx, vy, spin) per impulse, or (`curved` is 1.0) of an acceleration per force.

    It is 0 for what is fixed or held by friction at rest. The table's friction has no time to act during an impulse.
    """
    phase = world.phase[body]
    if c == 2:
        return 0.0 if phase[SPIN_SENSE] == 0.0 else world.body[body, INVERSE_INERTIA]
    if phase[MOVING] == RESTING:
        return 0.0
    return push_mobility(world, body) if curved != 0.0 else world.body[body, INVERSE_MASS]


@compiled
def set_constraints(world, cluster):
    """Gradients and curvatures of the gaps of a cluster, at the states at hand."""
    for touch in range(touch_count(world)):
        row = world.touching[touch]
        if row[HOLD] == PARTED or cluster_of_touch(world, touch) != cluster:
            continue
        a, b = int(row[TOUCH_A]), int(row[TOUCH_B])
        constraint_law(
            world.model,
            int(row[TOUCH_KIND]),
            world.stages[WORK, a],
            world.stages[WORK, b],
            world.body[a],
            world.body[b],
            row[TOUCH_FEATURE:],
            world.shared,
            row[GRADIENT:],
        )


@compiled
def takes_part(world, touch, cluster, curved):
    """Whether a contact is one of the equations, for velocities or (`curved` is 1.0) for accelerations."""
    return world.touching[touch, HOLD] >= MATCHES + curved and cluster_of_touch(world, touch) == cluster


@compiled
def product_with(world, touch, values):
    """Product of a gap's gradient with the velocities (or accelerations) of both bodies."""
    row = world.touching[touch]
    a, b = int(row[TOUCH_A]), int(row[TOUCH_B])
    total = 0.0
    for c in range(3):
        total += row[GRADIENT + c] * values[a, 3 + c] + row[GRADIENT + 3 + c] * values[b, 3 + c]
    return total


@compiled
def coupling(world, touch, other, curved):
    """Change of the rate of one gap per impulse in another contact (or the same)."""
    row, column = world.touching[touch], world.touching[other]
    total = 0.0
    for side in range(2):
        body = int(row[TOUCH_A + side])
        for other_side in range(2):
            if int(column[TOUCH_A + other_side]) == body:
                for c in range(3):
                    of_row, of_column = row[GRADIENT + 3 * side + c], column[GRADIENT + 3 * other_side + c]
                    total += of_row * of_column * mobility(world, body, c, curved)
    return total


@compiled
def factor(world, cluster, curved):
    """Cholesky factor of the equations of a cluster; a contact that takes no part has an equation of its own."""
    matrix, count = world.matrix, touch_count(world)
    for k in range(count):
        used = takes_part(world, k, cluster, curved)
        for m in range(k + 1):
            total = coupling(world, k, m, curved) if used and takes_part(world, m, cluster, curved) else 0.0
            if k == m:
                total = total * (1.0 + RIDGE) if total > 0.0 else 1.0
            for n in range(m):
                total -= matrix[k, n] * matrix[m, n]
            matrix[k, m] = math.sqrt(max(total, 1e-300)) if k == m else total / matrix[m, m]


@compiled
def substitute(matrix, count):
    """Solve the factored equations for the last column, in place."""
    last = matrix.shape[1] - 1
    for k in range(count):
        for n in range(k):
            matrix[k, last] -= matrix[k, n] * matrix[n, last]
        matrix[k, last] /= matrix[k, k]
    for k in range(count - 1, -1, -1):
        for n in range(k + 1, count):
            matrix[k, last] -= matrix[n, k] * matrix[n, last]
        matrix[k, last] /= matrix[k, k]


@compiled
def constrain(world, cluster, values, curved):
    """Add the effect of the contacts to velocities or accelerations (`curved` is 1.0) of the bodies, columns 3 to 5.

    The gradients of the gaps are those of the last `set_constraints`; the impulses or forces are left in `touching`.
    """
    matrix, count = world.matrix, touch_count(world)
    last = matrix.shape[1] - 1
    factor(world, cluster, curved)
    for touch in range(count):
        matrix[touch, last] = 0.0
        if takes_part(world, touch, cluster, curved):
            matrix[touch, last] = -product_with(world, touch, values) - curved * world.touching[touch, QUADRATIC]
    substitute(matrix, count)
    for touch in range(count):
        if takes_part(world, touch, cluster, curved):
            row = world.touching[touch]
            row[FORCE] = matrix[touch, last]
            for side in range(2):
                body = int(row[TOUCH_A + side])
                for c in range(3):
                    values[body, 3 + c] += mobility(world, body, c, curved) * row[GRADIENT + 3 * side + c] * row[FORCE]


@compiled
def constrain_vjp(world, adjoint, cluster, values, bars, before, curved):
    """Derivative of `constrain`, called right after it.

    `values` are its results, `bars` their adjoints, which become those of what it was given; the adjoints of the states
    that the gradients of the gaps depend on are added to `before`.
    """
    matrix, count = world.matrix, touch_count(world)
    last = matrix.shape[1] - 1
    for touch in range(count):
        matrix[touch, last] = 0.0
        if takes_part(world, touch, cluster, curved):
            row = world.touching[touch]
            for side in range(2):
                body = int(row[TOUCH_A + side])
                for c in range(3):
                    gradient = row[GRADIENT + 3 * side + c]
                    matrix[touch, last] += gradient * mobility(world, body, c, curved) * bars[body, 3 + c]
    substitute(matrix, count)
    for touch in range(count):
        if takes_part(world, touch, cluster, curved):
            row = world.touching[touch]
            for side in range(2):
                for c in range(3):
                    bars[int(row[TOUCH_A + side]), 3 + c] -= row[GRADIENT + 3 * side + c] * matrix[touch, last]
    for touch in range(count):
        if takes_part(world, touch, cluster, curved):
            constraint_bars(world, adjoint, touch, values, bars, before, -matrix[touch, last], curved)


@compiled
def constraint_bars(world, adjoint, touch, values, bars, before, of_right, curved):
    """Pass the adjoints of the constraint of one contact on to the states and constants of its bodies."""
    row, bar = world.touching[touch], adjoint.constraint
    a, b = int(row[TOUCH_A]), int(row[TOUCH_B])
    for side in range(2):
        body = a if side == 0 else b
        for c in range(3):
            pull = mobility(world, body, c, curved) * bars[body, 3 + c]
            bar[3 * side + c] = row[FORCE] * pull + of_right * values[body, 3 + c]
            if pull != 0.0:
                which = INVERSE_INERTIA if c == 2 else INVERSE_MASS
                adjoint.body[body, which] += pull / world.body[body, which] * row[GRADIENT + 3 * side + c] * row[FORCE]
    bar[6] = of_right * curved
    bar[7] = 0.0
    constraint_bar_states(world, adjoint, touch, before)


@compiled
def constraint_bar_states(world, adjoint, touch, before):
    """Add the derivative of a constraint, times its adjoint at hand, to states `before` and to constants."""
    row = world.touching[touch]
    a, b = int(row[TOUCH_A]), int(row[TOUCH_B])
    contact_vjp(
        world.model[CONSTRAINT_LAW_VJP + int(row[TOUCH_KIND])],
        world.stages[WORK, a],
        world.stages[WORK, b],
        world.body[a],
        world.body[b],
        row[TOUCH_FEATURE:],
        world.shared,
        adjoint.constraint,
        before[a],
        before[b],
        adjoint.body[a],
        adjoint.body[b],
        adjoint.shared,
    )
    for body in (a, b):
        if world.kind[body, FIXED]:
            for c in range(before.shape[1]):
                adjoint.start[body, c] += before[body, c]
                before[body, c] = 0.0

"""Compiled: leave the pieces of motion of a cluster, and start the next."""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: PLR0917

import math

from vrdp_prob.models.simulator.apart_kernel import advance_apart, begin_clusters_apart, choose_contacts_apart
from vrdp_prob.models.simulator.cluster_kernel import (
    HOLD,
    LEANS,
    MATCHES,
    PARTED,
    TOUCH_A,
    TOUCH_B,
    cluster_of_touch,
    presses,
    split,
    touch_count,
)
from vrdp_prob.models.simulator.detection_kernel import LAST_CONTACT
from vrdp_prob.models.simulator.laws_kernel import STATE_SIZE, compiled
from vrdp_prob.models.simulator.pressing_kernel import forget_touch
from vrdp_prob.models.simulator.search_kernel import search_body
from vrdp_prob.models.simulator.tape_kernel import STATE_A, add_pieces, complete_pieces, write_frames
from vrdp_prob.models.simulator.world_kernel import (
    MOVING,
    NOT_SOLVED,
    OK,
    RESTING,
    SPIN_SENSE,
    STEP,
    evaluate,
    hold,
    roll_along,
    share_of,
)


@compiled
def leave_piece(world, tape, body, t):
    """Finish the current piece of a body at a time and put its state there into the constant term."""
    write_frames(tape, world, body, t)
    phase, y = world.phase[body], tape.local[STATE_A]
    evaluate(world.polynomial[body], share_of(world, body, t), y)
    if phase[MOVING] == RESTING:
        y[3], y[4] = 0.0, 0.0
    if phase[SPIN_SENSE] == 0.0:
        y[5] = 0.0
    roll_along(world, body, y)
    for c in range(STATE_SIZE):
        world.polynomial[body, 0, c] = y[c]
    hold(world, body, t)


@compiled
def leave_pieces(world, tape, cluster, t):
    """Finish the current pieces of a cluster."""
    for place in range(world.members[cluster, 0]):
        leave_piece(world, tape, world.members[cluster, 1 + place], t)


@compiled
def begin_pieces(world, tape, cluster, t, horizon):
    """Start pieces of a cluster from their constant terms; returns an outcome."""
    add_pieces(tape, world, cluster)
    solved = advance_apart(world, cluster, t, horizon)
    complete_pieces(tape, world, cluster)
    return OK if solved != 0.0 else NOT_SOLVED


@compiled
def forget(world, pairs, cluster, hold, t):
    """Remove the lasting contacts of a cluster that hold as little as `hold`, with the time until which they lasted."""
    for touch in range(touch_count(world) - 1, -1, -1):
        holds = world.touching[touch, HOLD]
        if holds <= hold and holds != LEANS and cluster_of_touch(world, touch) == cluster:
            a, b = int(world.touching[touch, TOUCH_A]), int(world.touching[touch, TOUCH_B])
            pairs.table[min(a, b), max(a, b), LAST_CONTACT] = t
            forget_touch(world, touch)


@compiled
def begin_clusters(world, pairs, tape, cluster, t, horizon):
    """Start the pieces of all clusters that a former one falls into; all move on before any looks for contacts."""
    if world.members[cluster, 0] == 1 and touch_count(world) == 0:
        outcome = begin_pieces(world, tape, cluster, t, horizon)
        search_body(world, pairs, cluster, t, horizon)
        return outcome
    split(world, cluster)
    labels = world.members[world.clock.shape[0] + 1]
    outcome = OK
    for body in range(world.clock.shape[0]):
        if labels[1 + body] == body:
            outcome = max(outcome, begin_pieces(world, tape, body, t, horizon))
            forget(world, pairs, body, MATCHES, t)
    for body in range(world.clock.shape[0]):
        if labels[1 + body] >= 0:
            search_body(world, pairs, body, t, horizon)
    return outcome


@compiled
def restart(world, pairs, tape, cluster, t, horizon):
    """Start new pieces for the bodies of a cluster, with the contacts that last."""
    if presses(world, cluster):
        choose_contacts_apart(world, cluster, t)
        for touch in range(touch_count(world)):
            if world.touching[touch, HOLD] == MATCHES and cluster_of_touch(world, touch) == cluster:
                a, b = int(world.touching[touch, TOUCH_A]), int(world.touching[touch, TOUCH_B])
                pairs.table[min(a, b), max(a, b), LAST_CONTACT] = t
        forget(world, pairs, cluster, PARTED, t)
    if world.members[cluster, 0] > 1:
        # Other forces act now: how long the last step was says nothing.
        for place in range(world.members[cluster, 0]):
            world.clock[world.members[cluster, 1 + place], STEP] = math.inf
    return begin_clusters_apart(world, pairs, tape, cluster, t, horizon)

"""Compiled steps: the next piece of motion of a cluster of bodies."""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"

from vrdp_prob.models.simulator.cluster_kernel import is_alone, presses
from vrdp_prob.models.simulator.ending_kernel import (
    find_crossing,
    find_ending,
    first_step,
    hardly_moves,
    lingering,
    lingers,
    really_stops,
    set_references,
)
from vrdp_prob.models.simulator.laws_kernel import BOUNDARIES, COUPLED, TIMED, compiled
from vrdp_prob.models.simulator.motion_kernel import (
    PARTS_OF_STEP,
    compute_stages,
    inner_error,
    is_still,
    match_velocities,
    set_polynomial,
    step_error,
)
from vrdp_prob.models.simulator.pressing_kernel import find_parting, find_yielding
from vrdp_prob.models.simulator.world_kernel import (
    CONTINUES,
    ENDING,
    ENDING_BODY,
    FIXED,
    LENGTH,
    MOVING,
    ORIGIN,
    REFERENCE_X,
    REFERENCE_Y,
    SLIPPING,
    STEP,
    STOPS,
    UNTIL,
    hold,
)

SMALLEST_STEP = 1e-12
"""Step in s below which the motion counts as not solvable."""
APPROACH = 0.5
"""Longest step of bodies on bent paths, in units of the time in which friction alone would stop one of them."""
APPROACH_TO_ROLLING = 0.8
"""The same of spheres that slip, in units of the time until they roll.

Which way they slip at last hardly matters: what friction takes from the velocity then, it gives to the spin.
"""


@compiled
def rests(world, cluster):
    """Whether no body of a cluster moves or spins."""
    moving = False
    for place in range(world.members[cluster, 0]):
        moving = moving or not is_still(world, world.members[cluster, 1 + place])
    return not moving


@compiled
def hold_cluster(world, cluster, t):
    """Let a cluster stay in the states of the constant terms."""
    for place in range(world.members[cluster, 0]):
        hold(world, world.members[cluster, 1 + place], t)


@compiled
def rest(world, cluster, t, horizon):
    """Let a cluster rest, where forces change with time until they move a body."""
    hold_cluster(world, cluster, t)
    if world.model[TIMED] and not world.kind[cluster, FIXED]:
        world.clock[cluster, ENDING] = CONTINUES
        until = find_yielding(world, cluster, t, horizon)
        for place in range(world.members[cluster, 0]):
            clock = world.clock[world.members[cluster, 1 + place]]
            clock[UNTIL], clock[ENDING] = until, world.clock[cluster, ENDING]


@compiled
def begin_step(world, cluster, t, horizon):
    """First stage of a step; returns a length to try."""
    h = max(horizon - t, SMALLEST_STEP)
    match_velocities(world, cluster)
    for place in range(world.members[cluster, 0]):
        set_references(world, world.members[cluster, 1 + place])
    compute_stages(world, cluster, t, 0.0, PARTS_OF_STEP[0], PARTS_OF_STEP[1])
    for place in range(world.members[cluster, 0]):
        body = world.members[cluster, 1 + place]
        h = first_step(world, body, min(h, world.clock[body, STEP]), reach_of_step(world, cluster, body))
    return h


@compiled
def reach_of_step(world, cluster, body):
    """Length of a step in units of the time in which friction stops a body.

    A little more than 1, so that a body on a straight path stops within it. Elsewhere, how directions change becomes
    singular at the stop; the error of the motion hardly shows that, but its derivative needs shorter steps.
    """
    phase = world.phase[body]
    slow = phase[REFERENCE_X] ** 2 + phase[REFERENCE_Y] ** 2 < (4.0 * lingering(world, body)) ** 2
    if slow or not lingers(world, cluster, body):
        return 1.25
    return APPROACH_TO_ROLLING if phase[MOVING] == SLIPPING else APPROACH


@compiled
def try_step(world, cluster, t, h):
    """Error of a step; where it is small enough, its polynomials and the share of it that is valid are set."""
    error = 0.0
    compute_stages(world, cluster, t, h, PARTS_OF_STEP[1], PARTS_OF_STEP[2])
    for place in range(world.members[cluster, 0]):
        error = max(error, step_error(world, world.members[cluster, 1 + place], h))
    if error > 1.0:
        return error, 1.0
    compute_stages(world, cluster, t, h, PARTS_OF_STEP[2], PARTS_OF_STEP[3])
    for place in range(world.members[cluster, 0]):
        set_polynomial(world, world.members[cluster, 1 + place], h)
    within = inner_error(world, cluster, t, h)
    if within > 1.0:
        return within, 1.0
    share = 1.0
    world.clock[cluster, ENDING] = CONTINUES
    for place in range(world.members[cluster, 0]):
        share = find_ending(world, cluster, world.members[cluster, 1 + place], share)
    if world.model[BOUNDARIES] > 0:
        for place in range(world.members[cluster, 0]):
            share = find_crossing(world, cluster, world.members[cluster, 1 + place], share)
    return error, share


@compiled
def advance(world, cluster, t, horizon):
    """Compute the next piece of motion of a cluster from its constant terms; 0.0 where that fails, else 1.0."""
    if rests(world, cluster):
        rest(world, cluster, t, horizon)
        return 1.0
    h = begin_step(world, cluster, t, horizon)
    if is_alone(world, cluster) and hardly_moves(world, cluster):
        hold(world, cluster, t)
        clock = world.clock[cluster]
        clock[UNTIL], clock[ENDING], clock[ENDING_BODY] = t, STOPS, cluster
        return 1.0
    while h >= SMALLEST_STEP:
        error, share = try_step(world, cluster, t, h)
        if error > 1.0:
            h *= max(0.1, 0.9 * error ** (-0.125))
        elif not really_stops(world, cluster, share):
            h *= 0.5 * max(share, 0.1)
        else:
            if world.model[COUPLED] != 0 or world.model[TIMED] != 0 or presses(world, cluster):
                share = find_parting(world, cluster, t, h, share)
            for place in range(world.members[cluster, 0]):
                clock = world.clock[world.members[cluster, 1 + place]]
                clock[ORIGIN], clock[LENGTH], clock[UNTIL] = t, h, t + share * h
                clock[STEP] = h * min(5.0, 0.9 * max(error, 1e-9) ** (-0.125))
                clock[ENDING] = world.clock[cluster, ENDING]
            return 1.0
    hold_cluster(world, cluster, t)
    return 0.0

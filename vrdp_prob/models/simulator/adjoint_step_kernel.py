"""Compiled reverse sweep over one piece of motion: the adjoint of a Runge-Kutta step."""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: PLR0917

import math

from vrdp_prob.models.simulator.adjoint_kernel import clear, fold_state, load_state
from vrdp_prob.models.simulator.apart_kernel import load_block_apart
from vrdp_prob.models.simulator.cluster_kernel import constrain_vjp, is_alone, mobility, presses
from vrdp_prob.models.simulator.ending_kernel import LAUNCH, rest_at_once, set_push_at
from vrdp_prob.models.simulator.laws_kernel import (
    COUPLED,
    STATE_SIZE,
    body_stages_vjp,
    compiled,
    dense_output_vjp,
    pair_force_vjp,
    stage_state,
)
from vrdp_prob.models.simulator.motion_kernel import (
    cluster_derivatives,
    is_still,
    match_velocities,
    pair_force_of,
    take_states,
)
from vrdp_prob.models.simulator.tableau import NODES
from vrdp_prob.models.simulator.tape_kernel import BLOCK_PIECES, BLOCK_TOUCHES, FIRST
from vrdp_prob.models.simulator.world_kernel import (
    INVERSE_MASS,
    LENGTH,
    MOVING,
    ORIGIN,
    PUSH,
    RESTING,
    SLIDING,
    SPARE,
    SPIN_SENSE,
    STAGES,
    WORK,
)

ROUNDING = 1e-12
"""Relative error with which a body has the speed of a launch."""


@compiled
def reverse_step(world, adjoint, cluster, t, h):
    """Adjoints of the states with which the loaded pieces of a cluster begin, from those of their polynomials."""
    for place in range(world.members[cluster, 0]):
        body = world.members[cluster, 1 + place]
        dense_output_vjp(world.model, adjoint.polynomial[body], body, h, adjoint.stages)
        for c in range(STATE_SIZE):
            adjoint.state[body, c] = adjoint.polynomial[body, 0, c]
    if is_alone(world, cluster):
        reverse_stages(world, adjoint, cluster, t, h, STAGES - 1, -1)
        return
    pressing = presses(world, cluster)
    for stage in range(STAGES - 1, -1, -1):
        time = t + NODES[stage] * h
        for place in range(world.members[cluster, 0]):
            body = world.members[cluster, 1 + place]
            stage_state(world.model, world.polynomial[body, 0], world.stages, body, stage, h, world.stages[WORK, body])
        if pressing:
            # Computes the forces of this stage again.
            cluster_derivatives(world, cluster, time, stage)
            bars = adjoint.stages[stage]
            constrain_vjp(world, adjoint, cluster, world.stages[stage], bars, adjoint.before, 1.0)
        if world.model[COUPLED]:
            pair_forces_vjp(world, adjoint, cluster, time, adjoint.stages[stage])
        for place in range(world.members[cluster, 0]):
            reverse_stages(world, adjoint, world.members[cluster, 1 + place], t, h, stage, stage - 1)


@compiled
def reverse_stages(world, adjoint, body, t, h, begin, end):
    """Pass the adjoints of a body's stages, from `begin` down to before `end`, on to its beginning."""
    body_stages_vjp(
        world.model,
        world.polynomial[body, 0],
        world.stages,
        world.phase[body],
        world.body[body],
        world.shared,
        adjoint.stages,
        adjoint.before[body],
        adjoint.state[body],
        adjoint.body[body],
        adjoint.shared,
        adjoint.leg[body : body + 1],
        body,
        world.stages[WORK, body],
        t,
        h,
        begin,
        end,
        is_still(world, body),
    )


@compiled
def pair_forces_vjp(world, adjoint, cluster, t, bars):
    """Pass the adjoints of the accelerations by forces between bodies on to their states and constants."""
    force, bar, work = world.force[0], world.force[1], world.stages[WORK]
    for place in range(world.members[cluster, 0]):
        a = world.members[cluster, 1 + place]
        for later in range(place + 1, world.members[cluster, 0]):
            b = world.members[cluster, 1 + later]
            pair_force_of(world, a, b, t, force)
            for c in range(2):
                of_a, of_b = mobility(world, a, c, 1.0) * bars[a, 3 + c], mobility(world, b, c, 1.0) * bars[b, 3 + c]
                bar[c] = of_a - of_b
                adjoint.body[a, INVERSE_MASS] += force[c] * of_a / world.body[a, INVERSE_MASS]
                adjoint.body[b, INVERSE_MASS] -= force[c] * of_b / world.body[b, INVERSE_MASS]
            pair_force_vjp(
                world.model,
                t,
                work[a],
                work[b],
                world.body[a],
                world.body[b],
                world.shared,
                bar,
                adjoint.before[a],
                adjoint.before[b],
                adjoint.body[a],
                adjoint.body[b],
                adjoint.shared,
                adjoint.leg[a : a + 1],
            )


@compiled
def reverse_pieces(world, adjoint, tape, block):
    """Pass the adjoints of the pieces of a cluster on to the states with which they begin."""
    cluster = tape.integers[block, FIRST]
    if tape.integers[block, BLOCK_PIECES] > 1 or tape.integers[block, BLOCK_TOUCHES] > 0:
        load_block_apart(world, adjoint, tape, block)
    moving = False
    for place in range(world.members[cluster, 0]):
        moving = moving or not is_still(world, world.members[cluster, 1 + place])
    if moving:
        reverse_step(world, adjoint, cluster, world.clock[cluster, ORIGIN], world.clock[cluster, LENGTH])
        reverse_match(world, adjoint, tape, block, cluster)
        if not presses(world, cluster):
            reverse_launches(world, adjoint, cluster, world.clock[cluster, ORIGIN])
    for place in range(world.members[cluster, 0]):
        reverse_beginning(world, adjoint, world.members[cluster, 1 + place], moving)


@compiled
def reverse_match(world, adjoint, tape, block, cluster):
    """Velocities were matched in the recorded states before the pieces of a cluster began."""
    if not presses(world, cluster):
        return
    for place in range(world.members[cluster, 0]):
        load_state(world, world.members[cluster, 1 + place], tape.numbers[block + place])
        adjoint.loaded[world.members[cluster, 1 + place]] = -1
    match_velocities(world, cluster)
    clear(adjoint.before)
    constrain_vjp(world, adjoint, cluster, world.stages[WORK], adjoint.state, adjoint.before, 0.0)
    for body in range(adjoint.before.shape[0]):
        for c in range(STATE_SIZE):
            adjoint.state[body, c] += adjoint.before[body, c]
    clear(adjoint.before)


@compiled
def reverse_launches(world, adjoint, cluster, t):
    """Bodies at rest were launched the way they were pushed, which changes with all that pushes them.

    A body keeps that direction as it gathers speed. With a launch that counted as given, friction would turn it towards
    another push within a time as short as the launch is slow, and a step over that many times would blow it up.
    """
    launches = False
    for place in range(world.members[cluster, 0]):
        launches = launches or is_launched(world, world.members[cluster, 1 + place])
    if not launches:
        return
    take_states(world, cluster, 0.0)
    for place in range(world.members[cluster, 0]):
        body = world.members[cluster, 1 + place]
        for c in range(STATE_SIZE):
            adjoint.stages[0, body, c] = 0.0
        if is_launched(world, body):
            fold_state(world, body, adjoint.state[body])
            set_of_push(world, body, t, adjoint.state[body], adjoint.stages[0, body])
    if world.model[COUPLED]:
        pair_forces_vjp(world, adjoint, cluster, t, adjoint.stages[0])
    for place in range(world.members[cluster, 0]):
        body = world.members[cluster, 1 + place]
        reverse_stages(world, adjoint, body, t, 0.0, 0, -1)
        if is_launched(world, body):
            rest_at_once(adjoint.state[body])


@compiled
def is_launched(world, body):
    """Whether a piece begins with a body that was at rest."""
    y = world.polynomial[body, 0]
    speed = math.hypot(y[3], y[4])
    return world.phase[body, MOVING] == SLIDING and abs(speed - LAUNCH) < ROUNDING * LAUNCH


@compiled
def set_of_push(world, body, t, bar, of_push):
    """Adjoint of the acceleration of a body that was launched along its push, from that of its velocity.

    The states of other bodies are those in the work row.
    """
    y, at_rest = world.polynomial[body, 0], world.stages[SPARE, body]
    for c in range(STATE_SIZE):
        at_rest[c] = y[c]
    rest_at_once(at_rest)
    set_push_at(world, body, t, at_rest)
    x, y = world.stages[PUSH, body, 0], world.stages[PUSH, body, 1]
    square = x * x + y * y
    across = LAUNCH * (y * bar[3] - x * bar[4]) / (square * math.sqrt(square))
    of_push[3], of_push[4] = y * across, -x * across


@compiled
def reverse_beginning(world, adjoint, body, moving):
    """The adjoint of a piece is read; a resting body was set to rest, whatever small velocity it came with."""
    phase, bar = world.phase[body], adjoint.state[body]
    for c in range(STATE_SIZE):
        if not moving:
            bar[c] = adjoint.polynomial[body, 0, c]
    clear(adjoint.polynomial[body])
    if phase[MOVING] == RESTING:
        bar[3], bar[4] = 0.0, 0.0
    if phase[SPIN_SENSE] == 0.0:
        bar[5] = 0.0

"""Compiled motion between events: a Runge-Kutta step of a cluster of bodies, and its polynomial."""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: PLR0917

import math

import numpy as np

from vrdp_prob.models.simulator.apart_kernel import add_forces_apart
from vrdp_prob.models.simulator.cluster_kernel import constrain, is_alone, mobility, presses, set_constraints
from vrdp_prob.models.simulator.laws_kernel import (
    COUPLED,
    SLIPS,
    STATE_SIZE,
    body_stages,
    compiled,
    dense_output,
    motion,
    pair_force,
    step_errors,
)
from vrdp_prob.models.simulator.tableau import NODES
from vrdp_prob.models.simulator.world_kernel import (
    MOVING,
    PUSH,
    RESTING,
    SPARE,
    SPIN_SENSE,
    STAGES,
    TERMS,
    TRAVEL,
    WORK,
    evaluate,
    evaluate_rate,
)

TOLERANCE, COUPLED_TOLERANCE = 1e-11, 1e-9
"""Error of one step, in m, m/s, rad and rad/s; and where bodies act on each other at a distance and none slips.

There every step is one of all bodies that are about, and a rollout takes ten times as long; paths of discs are
exact to some 1e-8 m still. A slip that ends needs exact steps.
"""
INNER_TOLERANCE = 1e-9
"""Change of the velocity in m/s within a step by which its polynomial may miss the law in the middle."""
PARTS_OF_STEP = np.array([0, 1, 12, STAGES])
"""First stages of the parts of a step: its beginning, what its error needs, and its polynomial; and the last and one.

An array, because numba compiles a variant of a function for every integer that is written down in a call.
"""


@compiled
def is_still(world, body):
    """Whether a body neither moves nor spins."""
    return world.phase[body, MOVING] == RESTING and world.phase[body, SPIN_SENSE] == 0.0


@compiled
def derivatives(world, body, t, rates):
    """Time derivative of a body apart from forces of other bodies, at the state at hand, into `rates`."""
    out = rates[body]
    if is_still(world, body):
        for c in range(STATE_SIZE):
            out[c] = 0.0
    else:
        motion(world.model, t, world.stages[WORK, body], world.phase[body], world.body[body], world.shared, out)


@compiled
def cluster_derivatives(world, cluster, t, stage):
    """Time derivative of all bodies of a cluster at the states in the work row, into the row of a stage."""
    for place in range(world.members[cluster, 0]):
        derivatives(world, world.members[cluster, 1 + place], t, world.stages[stage])
    add_forces_apart(world, cluster, t, stage)


@compiled
def add_forces(world, cluster, t, stage):
    """Add the accelerations by forces between the bodies of a cluster, at the states in the work row, to a stage."""
    rates = world.stages[stage]
    if world.model[COUPLED]:
        add_pair_forces(world, cluster, t, rates)
    if presses(world, cluster):
        set_constraints(world, cluster)
        constrain(world, cluster, rates, 1.0)


@compiled
def add_pair_forces(world, cluster, t, rates):
    """Add the accelerations by forces between the bodies of a cluster."""
    force = world.force[0]
    for place in range(world.members[cluster, 0]):
        a = world.members[cluster, 1 + place]
        for later in range(place + 1, world.members[cluster, 0]):
            b = world.members[cluster, 1 + later]
            pair_force_of(world, a, b, t, force)
            for c in range(2):
                rates[a, 3 + c] += mobility(world, a, c, 1.0) * force[c]
                rates[b, 3 + c] -= mobility(world, b, c, 1.0) * force[c]


@compiled
def pair_force_of(world, a, b, t, force):
    """Force of the second body on the first, at the states in the work row."""
    work = world.stages[WORK]
    pair_force(world.model, t, work[a], work[b], world.body[a], world.body[b], world.shared, force)


@compiled
def stages_of(world, body, t, h, begin, end):
    """Stages `begin` to `end` of a step of one body, apart from forces of other bodies."""
    y, stages, state = world.polynomial[body, 0], world.stages, world.stages[WORK, body]
    if not is_still(world, body):
        phase, constants = world.phase[body], world.body[body]
        body_stages(world.model, y, stages, phase, constants, world.shared, body, state, t, h, begin, end)
        return
    for c in range(STATE_SIZE):
        state[c] = y[c]
        for stage in range(begin, end):
            stages[stage, body, c] = 0.0


@compiled
def compute_stages(world, cluster, t, h, begin, end):
    """Stages `begin` to `end` of a step from the states in the polynomials' constant terms."""
    if is_alone(world, cluster):
        stages_of(world, cluster, t, h, begin, end)
        return
    for stage in range(begin, end):
        for place in range(world.members[cluster, 0]):
            stages_of(world, world.members[cluster, 1 + place], t, h, stage, stage + 1)
        add_forces_apart(world, cluster, t + NODES[stage] * h, stage)


@compiled
def take_states(world, cluster, share):
    """States of the bodies of a cluster at a share of their pieces, into the work row."""
    for place in range(world.members[cluster, 0]):
        body = world.members[cluster, 1 + place]
        evaluate(world.polynomial[body], share, world.stages[WORK, body])


@compiled
def match_velocities(world, cluster):
    """Take the velocities at which gaps change from the states with which a piece begins."""
    if presses(world, cluster):
        take_states(world, cluster, 0.0)
        set_constraints(world, cluster)
        constrain(world, cluster, world.stages[WORK], 0.0)
        for place in range(world.members[cluster, 0]):
            body = world.members[cluster, 1 + place]
            for c in range(3, 6):
                world.polynomial[body, 0, c] = world.stages[WORK, body, c]


@compiled
def step_error(world, body, h):
    """Error of a step relative to the tolerance (Hairer's combination of two estimates)."""
    rough = world.model[COUPLED] != 0 and world.model[SLIPS] == 0
    worst, allowed = 0.0, COUPLED_TOLERANCE if rough else TOLERANCE
    step_errors(world.model, world.stages, body, world.errors)
    for c in range(STATE_SIZE):
        third, fifth = world.errors[0, c], world.errors[1, c]
        scale = math.sqrt(fifth * fifth + 0.01 * third * third)
        if not math.isfinite(scale):
            return math.inf
        if scale > 0.0:
            worst = max(worst, abs(h) * fifth * fifth / (scale * allowed))
    return worst


@compiled
def inner_error(world, cluster, t, h):
    """Error of a step in its middle relative to what is allowed there.

    The error at the end may vanish by chance where a step is too long, and says nothing of the polynomial. This is how
    far the polynomial's derivative is from the law, times the length. Source: W. H. Enright, A new error-control for
    initial value solvers, Appl. Math. Comput. 31 (1989).
    """
    worst, rate = 0.0, world.stages[PUSH + 1, 0]
    take_states(world, cluster, 0.5)
    cluster_derivatives(world, cluster, t + 0.5 * h, SPARE)
    for place in range(world.members[cluster, 0]):
        body = world.members[cluster, 1 + place]
        evaluate_rate(world.polynomial[body], 0.5, h, rate)
        for c in range(3, 5):
            worst = max(worst, h * abs(rate[c] - world.stages[SPARE, body, c]))
    return worst / INNER_TOLERANCE


@compiled
def set_polynomial(world, body, h):
    """Turn the stages of a step into the polynomial of a body's motion, and bound how far it comes."""
    polynomial = world.polynomial[body]
    dense_output(world.model, world.stages, body, h, polynomial)
    x, y = 0.0, 0.0
    for power in range(1, TERMS):
        x += abs(polynomial[power, 0])
        y += abs(polynomial[power, 1])
    world.phase[body, TRAVEL] = math.hypot(x, y)

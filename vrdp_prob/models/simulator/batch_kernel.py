"""Compiled entries: a batch of worlds, one after the other, forward and backward."""

# numba infers types, also of bundles, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def, call-arg, var-annotated, unreachable"
# ruff: noqa: PLR0917

from numba import njit
from numba.core.types import float64, int64, void

from vrdp_prob.models.simulator.adjoint_events_kernel import reverse_event, reverse_world
from vrdp_prob.models.simulator.adjoint_kernel import Adjoint, load_block
from vrdp_prob.models.simulator.adjoint_step_kernel import reverse_pieces
from vrdp_prob.models.simulator.bundle import new_bundle
from vrdp_prob.models.simulator.detection_kernel import Pairs
from vrdp_prob.models.simulator.event_kernel import collide, end_pieces
from vrdp_prob.models.simulator.laws_kernel import compiled
from vrdp_prob.models.simulator.motion_kernel import add_forces
from vrdp_prob.models.simulator.piece_kernel import begin_clusters, restart
from vrdp_prob.models.simulator.pressing_kernel import choose_contacts
from vrdp_prob.models.simulator.rollout_kernel import rollout_world
from vrdp_prob.models.simulator.search_kernel import depth, search_pair
from vrdp_prob.models.simulator.step_kernel import advance
from vrdp_prob.models.simulator.tape_kernel import ROWS, Tape
from vrdp_prob.models.simulator.world_kernel import NOT_FINITE, TAPE_FULL, World

APART = {
    add_forces: void(World, int64, float64, int64),
    advance: float64(World, int64, float64, float64),
    choose_contacts: void(World, int64, float64),
    search_pair: void(World, Pairs, int64, int64, float64, float64),
    begin_clusters: int64(World, Pairs, Tape, int64, float64, float64),
    restart: int64(World, Pairs, Tape, int64, float64, float64),
    end_pieces: int64(World, Pairs, Tape, int64, float64),
    collide: int64(World, Pairs, Tape, int64, int64, float64),
    depth: float64(World, Pairs, int64, int64, float64),
    load_block: void(World, Adjoint, Tape, int64),
    reverse_pieces: void(World, Adjoint, Tape, int64),
    reverse_event: void(World, Adjoint, Tape, int64),
}
"""Signatures of the functions that are compiled apart (see `apart_kernel.py`); both halves take about as long."""


@compiled
def is_finite(world):
    """Whether all numbers that a world is given are finite."""
    total = 0.0
    for body in range(world.kind.shape[0]):
        for c in range(world.body.shape[1]):
            total += 0.0 * world.body[body, c]
        for c in range(world.start.shape[1]):
            total += 0.0 * world.start[body, c]
    for parameter in range(world.shared.shape[0]):
        total += 0.0 * world.shared[parameter]
    return total == 0.0


@compiled
def break_off(tape, begin):
    """Show nothing of a world whose numbers are not finite; returns that outcome."""
    tape.counts[ROWS] = begin
    for frame in range(tape.times.shape[0]):
        for body in range(tape.trajectory.shape[1]):
            for c in range(3):
                tape.trajectory[frame, body, c], tape.velocity[frame, body, c] = 0.0, 0.0
    return NOT_FINITE


@compiled
def row_of(values, index):
    """Row of an array with one row for each world, or with one for all (or none)."""
    return min(index, max(values.shape[0] - 1, 0))


@njit(nogil=True, error_model="numpy", cache=True)
def rollout_batch(
    model,
    kinds,
    bodies,
    shared,
    start,
    times,
    event_limit,
    trajectory,
    velocity,
    outcomes,
    integers,
    numbers,
    first_row,
    done,
    world_sizes,
    world_room,
    pair_sizes,
    pair_room,
    tape_sizes,
    tape_room,
):
    """Simulate worlds from the first that is not `done`; returns how many are, not all where the tape is full.

    Arrays: `kinds` [world, body, (shape, fixed, present)], `bodies` [world, body, constant], `shared` [world,
    parameter], `start` [world, body, (state, release time)], `times` [world or 1, time] in s. Written are `trajectory`
    and `velocity` [world, time, shown body, 3], `outcomes` [world], the tape (`integers`, `numbers`) and the rows of it
    at which worlds begin, `first_row` [world and one]. Sizes and room are the workspaces of the bundles.
    """
    pairs = new_bundle(Pairs, pair_sizes, pair_room)
    for index in range(done, outcomes.shape[0]):
        world = new_bundle(
            World, world_sizes, world_room, kinds[index], bodies[index], shared[index], start[index], model
        )
        own_times = times[row_of(times, index)]
        tape = new_bundle(Tape, tape_sizes, tape_room, integers, numbers, own_times, trajectory[index], velocity[index])
        begin = first_row[index]
        if is_finite(world):
            outcomes[index] = rollout_world(world, pairs, tape, begin, event_limit)
        else:
            outcomes[index] = break_off(tape, begin)
        if outcomes[index] == TAPE_FULL:
            return index
        first_row[index + 1] = tape.counts[ROWS]
    return outcomes.shape[0]


@njit(nogil=True, error_model="numpy", cache=True)
def reverse_batch(
    model,
    kinds,
    bodies,
    shared,
    start,
    times,
    outcomes,
    integers,
    numbers,
    first_row,
    trajectory_bar,
    velocity_bar,
    bodies_bar,
    shared_bar,
    start_bar,
    times_bar,
    world_sizes,
    world_room,
    tape_sizes,
    tape_room,
    adjoint_sizes,
    adjoint_room,
):
    """Add the derivative to the last four arrays before the workspaces, from the adjoints of trajectory and velocity.

    Axes are as in `rollout_batch`; `velocity_bar` and `times_bar` may have no frames where nobody needs them.
    """
    for index in range(outcomes.shape[0]):
        if outcomes[index] == NOT_FINITE:
            continue
        world = new_bundle(
            World, world_sizes, world_room, kinds[index], bodies[index], shared[index], start[index], model
        )
        own_times, of_velocity = times[row_of(times, index)], velocity_bar[row_of(velocity_bar, index)]
        tape = new_bundle(Tape, tape_sizes, tape_room, integers, numbers, own_times, trajectory_bar[index], of_velocity)
        adjoint = new_bundle(
            Adjoint,
            adjoint_sizes,
            adjoint_room,
            bodies_bar[index],
            shared_bar[index],
            start_bar[index],
            times_bar[row_of(times_bar, index)],
        )
        reverse_world(world, adjoint, tape, first_row[index], first_row[index + 1])

"""Compiled: calls of kernels that are compiled apart.

numba links and optimises what a function calls again in every function above it, up to the entries of the kernel. What
holds most of the code is compiled by itself therefore (see `batch_kernel.py`) and called by its address, which stands
among the entries of a model. A call costs some nanoseconds, the work behind it microseconds.
"""

# numba infers types, and compiled functions take their arrays one by one and by position.
# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: PLR0917

from vrdp_prob.models.simulator.calls import call, call_for_integer, call_for_number
from vrdp_prob.models.simulator.laws_kernel import (
    ADD_FORCES,
    ADVANCE,
    BEGIN_CLUSTERS,
    CHOOSE_CONTACTS,
    COLLIDE,
    DEPTH,
    END_PIECES,
    LOAD_BLOCK,
    RESTART,
    REVERSE_EVENT,
    REVERSE_PIECES,
    SEARCH_PAIR,
    compiled,
)


@compiled
def advance_apart(world, cluster, t, horizon):
    """Call `advance` of `step_kernel.py`."""
    return call_for_number(world.model[ADVANCE], world, cluster, t, horizon)


@compiled
def add_forces_apart(world, cluster, t, stage):
    """Call `add_forces` of `motion_kernel.py`."""
    call(world.model[ADD_FORCES], world, cluster, t, stage)


@compiled
def choose_contacts_apart(world, cluster, t):
    """Call `choose_contacts` of `pressing_kernel.py`."""
    call(world.model[CHOOSE_CONTACTS], world, cluster, t)


@compiled
def search_pair_apart(world, pairs, body, other, t, horizon):
    """Call `search_pair` of `search_kernel.py`."""
    call(world.model[SEARCH_PAIR], world, pairs, body, other, t, horizon)


@compiled
def depth_apart(world, pairs, i, j, t):
    """Call `depth` of `search_kernel.py`."""
    return call_for_number(world.model[DEPTH], world, pairs, i, j, t)


@compiled
def begin_clusters_apart(world, pairs, tape, cluster, t, horizon):
    """Call `begin_clusters` of `piece_kernel.py`."""
    return call_for_integer(world.model[BEGIN_CLUSTERS], world, pairs, tape, cluster, t, horizon)


@compiled
def restart_apart(world, pairs, tape, cluster, t, horizon):
    """Call `restart` of `piece_kernel.py`."""
    return call_for_integer(world.model[RESTART], world, pairs, tape, cluster, t, horizon)


@compiled
def end_pieces_apart(world, pairs, tape, cluster, horizon):
    """Call `end_pieces` of `event_kernel.py`."""
    return call_for_integer(world.model[END_PIECES], world, pairs, tape, cluster, horizon)


@compiled
def collide_apart(world, pairs, tape, i, j, horizon):
    """Call `collide` of `event_kernel.py`."""
    return call_for_integer(world.model[COLLIDE], world, pairs, tape, i, j, horizon)


@compiled
def load_block_apart(world, adjoint, tape, block):
    """Call `load_block` of `adjoint_kernel.py`."""
    call(world.model[LOAD_BLOCK], world, adjoint, tape, block)


@compiled
def reverse_pieces_apart(world, adjoint, tape, block):
    """Call `reverse_pieces` of `adjoint_step_kernel.py`."""
    call(world.model[REVERSE_PIECES], world, adjoint, tape, block)


@compiled
def reverse_event_apart(world, adjoint, tape, row):
    """Call `reverse_event` of `adjoint_events_kernel.py`."""
    call(world.model[REVERSE_EVENT], world, adjoint, tape, row)

"""What the player shows of simulated worlds."""

import numpy as np
import torch

from vrdp_prob.models.simulator.events import EventTable, RolloutEventKind
from vrdp_prob.models.simulator.outcome import Outcome
from vrdp_prob.models.simulator.rollout import Rollout
from vrdp_prob.report.content import WorldKind
from vrdp_prob.report.rollouts import world_content

CONTACTS = (
    # world, time, kind, first, second
    (0, 0.5, RolloutEventKind.COLLISION, 0, 1),
    (0, 0.7, RolloutEventKind.COLLISION, 0, 1),
    (0, 0.9, RolloutEventKind.WALL, 0, 0),
    (1, 0.2, RolloutEventKind.COLLISION, 0, 1),
    (2, 0.8, RolloutEventKind.COLLISION, 1, 2),
    (2, 0.6, RolloutEventKind.COLLISION, 0, 2),
    (2, 0.95, RolloutEventKind.STOP, 0, -1),
)


def make_rollout(outcomes):
    rows = np.array(CONTACTS, dtype=float)
    whole = rows.astype(int)
    events = EventTable(
        world=whole[:, 0],
        time=rows[:, 1],
        kind=whole[:, 2],
        first=whole[:, 3],
        second=whole[:, 4],
        point=np.column_stack([rows[:, 1], rows[:, 0]]),
        normal=np.zeros((len(rows), 2)),
        impulse=np.ones(len(rows)),
        closing_speed=np.ones(len(rows)),
    )
    states = torch.arange(3 * 4 * 3 * 3, dtype=torch.float64).reshape(3, 4, 3, 3)
    exists = torch.ones(3, 4, 3, dtype=torch.bool)
    return Rollout(torch.linspace(0, 1, 4, dtype=torch.float64), states, states, exists, events, tuple(outcomes))


def contacts(world):
    table = world.collisions
    rows = zip(table.draw, table.bodies[:, 0], table.bodies[:, 1], table.time, strict=True)
    return sorted((int(draw), int(a), int(b), float(time)) for draw, a, b, time in rows)


def test_only_first_contacts_of_bodies_are_shown():
    world = world_content(make_rollout([Outcome.OK] * 3), WorldKind.HEAVIER, "1")
    assert world.key == "heavier:1"
    assert contacts(world) == [(0, 0, 1, 0.5), (1, 0, 1, 0.2), (2, 0, 2, 0.6), (2, 1, 2, 0.8)]
    assert (world.collisions.point[:, 0] == world.collisions.time).all()


def test_draws_that_broke_off_are_left_out():
    rollout = make_rollout([Outcome.OK, Outcome.EVENT_LIMIT, Outcome.OK])
    world = world_content(rollout, WorldKind.FACTUAL)
    assert world.draws == 2
    assert np.array_equal(world.trajectory[1], rollout.trajectory[2].numpy())
    assert contacts(world) == [(0, 0, 1, 0.5), (1, 0, 2, 0.6), (1, 1, 2, 0.8)]


def test_world_of_which_nothing_is_left_is_not_shown():
    assert world_content(make_rollout([Outcome.NOT_FINITE] * 3), WorldKind.FACTUAL) is None

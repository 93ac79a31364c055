"""What the player shows of the worlds that answers come from."""

import numpy as np
import pytest
from example_content import make_tracks

from vrdp_prob.reasoning.answer import monte_carlo_error
from vrdp_prob.reasoning.events import EventTable
from vrdp_prob.report.rollouts import collisions, measured_course, pair_shares
from vrdp_prob.scene import Camera, Event, EventKind


def test_collisions_stand_midway_between_their_bodies():
    hit = EventKind.COLLISION
    draws = [
        [Event(0.0, EventKind.IN, ("a",)), Event(1.1, hit, ("a", "b"))],
        [],
        [Event(2.0, hit, ("b", "c")), Event(0.9, hit, ("a", "b"))],
    ]
    events = EventTable.from_events("abc", draws, start=0.0, end=2.0)
    times = np.array([0.0, 1.0, 2.0])
    positions = np.arange(3 * 3 * 3 * 2, dtype=float).reshape(3, 3, 3, 2)
    table = collisions(events, times, positions)
    rows = sorted(
        zip(table.draw.tolist(), table.time.tolist(), table.bodies.tolist(), table.point.tolist(), strict=True)
    )
    assert rows == [
        (0, 1.1, [0, 1], positions[0, 1, :2].mean(axis=0).tolist()),
        (2, 0.9, [0, 1], positions[2, 1, :2].mean(axis=0).tolist()),
        (2, 2.0, [1, 2], positions[2, 2, 1:].mean(axis=0).tolist()),
    ]


def test_shares_count_draws():
    hit = EventKind.COLLISION
    draws = [[Event(1.0, hit, ("b", "c")), Event(2.0, hit, ("a", "b"))], [Event(1.5, hit, ("b", "c"))], [], []]
    shares = pair_shares(EventTable.from_events("abc", draws), effective_draws=2.0)
    assert [(met.bodies, met.share, met.time) for met in shares] == [((1, 2), 0.5, 1.25), ((0, 1), 0.25, 2.0)]
    assert [met.error for met in shares] == pytest.approx([0.25, monte_carlo_error(0.25, 2.0)])


def test_world_without_collisions():
    table = collisions(EventTable.from_events("ab", [[], []]), np.array([0.0, 1.0]), np.zeros((1, 2, 2, 2)))
    assert len(table.time) == len(table.draw) == len(table.bodies) == len(table.point) == 0


def test_measured_course_has_no_gaps():
    tracks = make_tracks(Camera.clevrer())
    course = measured_course(tracks)
    assert np.isfinite(course).all()
    assert np.array_equal(course[tracks.seen], tracks.positions[tracks.seen])

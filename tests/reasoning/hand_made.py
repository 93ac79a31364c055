"""Videos whose events are written by hand."""

from collections.abc import Sequence

import numpy as np

from vrdp_prob.reasoning.changes import Change
from vrdp_prob.reasoning.events import EventTable
from vrdp_prob.reasoning.facts import Motion, TableFacts
from vrdp_prob.scene import Body, Event, EventKind, Shape

FRAME_RATE = 25.0

BODIES = (
    Body("0", Shape.CUBE, radius=0.2, material="metal", color="red"),
    Body("1", Shape.SPHERE, radius=0.2, material="rubber", color="blue"),
    Body("2", Shape.CYLINDER, radius=0.2, material="metal", color="green"),
    Body("3", Shape.CUBE, radius=0.2, material="rubber", color="blue"),
)


def collision(frame: float, first: str, second: str) -> Event:
    return Event(frame / FRAME_RATE, EventKind.COLLISION, tuple(sorted((first, second))))


def entrance(frame: float, body: str) -> Event:
    return Event(frame / FRAME_RATE, EventKind.IN, (body,))


def exit_of(frame: float, body: str) -> Event:
    return Event(frame / FRAME_RATE, EventKind.OUT, (body,))


def motion_of(moving: Sequence[Sequence[int]], in_view: Sequence[Sequence[int]] | None = None) -> Motion:
    """Motion at frames 0, 50 and 127 in one draw: rows are frames, columns bodies."""
    moves = np.array(moving, dtype=bool)[None]
    visible = np.ones_like(moves) if in_view is None else np.array(in_view, dtype=bool)[None]
    return Motion(np.array([0.0, 50.0, 127.0]) / FRAME_RATE, visible, moves)


STILL = motion_of([[0, 0, 0, 0], [1, 0, 0, 1], [0, 1, 0, 0]], [[1, 0, 1, 1], [1, 1, 1, 1], [1, 1, 1, 0]])
"""The cubes move at frame 50, the sphere at the end; the sphere comes late, the blue cube has gone at the end."""


def video(
    *worlds: Sequence[Event],
    motion: Motion = STILL,
    future: Sequence[Sequence[Event]] | None = None,
    changed: dict[tuple[Change, int], Sequence[Sequence[Event]]] | None = None,
    bodies: tuple[Body, ...] = BODIES,
    effective_draws: float = np.inf,
) -> TableFacts:
    """A video with one list of events for each draw."""
    ids = [body.id for body in bodies]
    repeated = Motion(
        motion.times,
        np.repeat(motion.in_view, len(worlds), axis=0),
        np.repeat(motion.moving, len(worlds), axis=0),
    )
    return TableFacts(
        bodies,
        EventTable.from_events(ids, worlds, start=0.0, end=127 / FRAME_RATE),
        repeated,
        None if future is None else EventTable.from_events(ids, future),
        {key: EventTable.from_events(ids, lists) for key, lists in (changed or {}).items()},
        effective_draws,
    )


STORY = (
    entrance(10, "1"),
    collision(30, "0", "1"),
    entrance(50, "2"),
    collision(60, "0", "3"),
    collision(80, "2", "3"),
    exit_of(100, "3"),
)
"""Sphere 1 enters, hits cube 0, which hits cube 3; cylinder 2 enters and hits cube 3, which leaves."""

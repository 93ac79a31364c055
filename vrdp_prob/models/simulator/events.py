"""The events of simulated worlds as a table."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int


class RolloutEventKind(IntEnum):
    """What happened."""

    COLLISION = 0
    WALL = 1
    STOP = 2
    """A body comes to rest, or a sphere begins to roll."""
    SPIN_STOP = 3
    OBSTACLE = 4
    """A contact with an obstacle that an effect adds."""
    KICK = 5
    CROSSING = 6
    """A body crosses the boundary of an effect."""


CONTACTS = (RolloutEventKind.COLLISION, RolloutEventKind.WALL, RolloutEventKind.OBSTACLE)
"""Events at which a body meets something."""


class Tapes(NamedTuple):
    """Joined records of a batch, as the kernel writes them (see `tape_kernel.py`)."""

    integers: Int[np.ndarray, "row integer"]
    numbers: Float[np.ndarray, "row number"]
    first_row: Int[np.ndarray, "world_and_one"]


_STOP, _SPIN_STOP, _CONTACT, _KICK, _CROSS = 3, 4, 5, 8, 9


@dataclass(frozen=True)
class EventTable:
    """Events in the order of worlds and, within a world, of time.

    Parameters
    ----------
    world
        World of each event.
    time
        Time in s.
    kind
        A `RolloutEventKind`.
    first, second
        Bodies that take part (`first` < `second`); for a wall or an obstacle `second` is its number, for a kick or a
        crossing that of the effect among those that have one, for a stop it is -1.
    point
        Touching point in m (0 without contact).
    normal
        Unit vector from the first to the second (0 without contact).
    impulse
        Impulse along the normal in kg m/s (0 without contact).
    closing_speed
        Speed in m/s at which the touching points approached each other (0 without contact).
    """

    world: Int[np.ndarray, "event"]
    time: Float[np.ndarray, "event"]
    kind: Int[np.ndarray, "event"]
    first: Int[np.ndarray, "event"]
    second: Int[np.ndarray, "event"]
    point: Float[np.ndarray, "event 2"]
    normal: Float[np.ndarray, "event 2"]
    impulse: Float[np.ndarray, "event"]
    closing_speed: Float[np.ndarray, "event"]

    def __len__(self) -> int:
        return len(self.time)

    def of_world(self, world: int) -> "EventTable":
        """The events of one world."""
        return self.where(self.world == world)

    def of_kind(self, kind: RolloutEventKind) -> "EventTable":
        """The events of one kind."""
        return self.where(self.kind == kind)

    def concerns(self, bodies: Sequence[int] | Int[np.ndarray, "body"]) -> Bool[np.ndarray, "event"]:
        """Whether one of some bodies takes part in each event."""
        is_pair = self.kind == RolloutEventKind.COLLISION
        return np.asarray(np.isin(self.first, bodies) | (is_pair & np.isin(self.second, bodies)))

    def where(self, keep: np.ndarray) -> "EventTable":
        """Some of the events, by a boolean or index array with the axis `event`."""
        return EventTable(*(getattr(self, name)[keep] for name in self.__dataclass_fields__))

    @classmethod
    def of(cls, tapes: Tapes, body_count: int, wall_count: int) -> "EventTable":
        """The events that the kernel recorded; bodies from `body_count` on are walls, then obstacles."""
        kinds = tapes.integers[:, 0]
        rows = np.flatnonzero(np.isin(kinds, (_STOP, _SPIN_STOP, _CONTACT, _KICK, _CROSS)))
        kinds, numbers = kinds[rows], tapes.numbers[rows]
        contact = kinds == _CONTACT
        first, second = tapes.integers[rows, 1], tapes.integers[rows, 2]
        swap = contact & (first > second)
        first, second = np.where(swap, second, first), np.where(swap, first, second)
        obstacle = contact & (second >= body_count + wall_count)
        wall = contact & (second >= body_count) & ~obstacle
        kind = np.select(
            [obstacle, wall, contact, kinds == _STOP, kinds == _KICK, kinds == _CROSS],
            [
                RolloutEventKind.OBSTACLE,
                RolloutEventKind.WALL,
                RolloutEventKind.COLLISION,
                RolloutEventKind.STOP,
                RolloutEventKind.KICK,
                RolloutEventKind.CROSSING,
            ],
            RolloutEventKind.SPIN_STOP,
        )
        numbers = np.where(contact[:, None], numbers, np.eye(1, numbers.shape[1]) * numbers)
        return cls(
            world=np.searchsorted(tapes.first_row, rows, side="right") - 1,
            time=numbers[:, 0],
            kind=kind.astype(np.int64),
            first=first,
            second=second - np.select([obstacle, wall], [body_count + wall_count, body_count], 0),
            point=numbers[:, 10:12],
            normal=np.where(swap[:, None], -1.0, 1.0) * numbers[:, 12:14],
            impulse=numbers[:, 9],
            closing_speed=numbers[:, 8],
        )

"""Which events a video can have, and in which draws they happen and when.

All draws share one list of possible events, the *universe* of a video: one collision for each pair of bodies, one
entrance and one exit for each body, the start and the end. A set of events is then a mask over draws and events, and an
operation is a few array expressions for all draws at once.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float

from vrdp_prob.scene import Event, EventKind


@dataclass(frozen=True)
class EventUniverse:
    """The possible events of a video.

    The `event` axis holds the collisions of all pairs, then the entrances, then the exits of all bodies, then the start
    and the end of the video.

    Parameters
    ----------
    bodies
        Ids of the bodies.
    """

    bodies: tuple[str, ...]

    @cached_property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """Places of the two bodies of each collision."""
        return tuple(combinations(range(len(self.bodies)), 2))

    @property
    def size(self) -> int:
        """Number of possible events."""
        return len(self.pairs) + 2 * len(self.bodies) + 2

    @property
    def collisions(self) -> slice:
        """Part of the event axis that holds collisions."""
        return slice(0, len(self.pairs))

    @property
    def entrances(self) -> slice:
        """Part of the event axis that holds entrances."""
        return slice(len(self.pairs), len(self.pairs) + len(self.bodies))

    @property
    def exits(self) -> slice:
        """Part of the event axis that holds exits."""
        return slice(len(self.pairs) + len(self.bodies), len(self.pairs) + 2 * len(self.bodies))

    @property
    def start(self) -> int:
        """Place of the start of the video."""
        return self.size - 2

    @property
    def end(self) -> int:
        """Place of the end of the video."""
        return self.size - 1

    def collision(self, first: int, second: int) -> int:
        """Place of the collision of two bodies, in either order."""
        return self._pair_index[min(first, second), max(first, second)]

    def index(self, event: Event) -> int:
        """Place of an event."""
        places = [self.bodies.index(body) for body in event.objects]
        if event.kind is EventKind.COLLISION:
            return self.collision(places[0], places[1])
        part = self.entrances if event.kind is EventKind.IN else self.exits
        return int(part.start) + places[0]

    @cached_property
    def takes_part(self) -> Bool[np.ndarray, "event body"]:
        """Whether a body takes part in an event."""
        mask = np.zeros((self.size, len(self.bodies)), dtype=bool)
        for place, (first, second) in enumerate(self.pairs):
            mask[place, [first, second]] = True
        identity = np.eye(len(self.bodies), dtype=bool)
        mask[self.entrances] = identity
        mask[self.exits] = identity
        return mask

    def mask(self, part: slice) -> Bool[np.ndarray, "event"]:
        """The events of one part of the axis."""
        mask = np.zeros(self.size, dtype=bool)
        mask[part] = True
        return mask

    @cached_property
    def _pair_index(self) -> dict[tuple[int, int], int]:
        return {pair: place for place, pair in enumerate(self.pairs)}


@dataclass(frozen=True)
class EventTable:
    """What happens in one world, draw by draw.

    Parameters
    ----------
    universe
        The possible events.
    happens
        Whether an event happens.
    time
        Time in s of an event, NaN where it does not happen.
    """

    universe: EventUniverse
    happens: Bool[np.ndarray, "draw event"]
    time: Float[np.ndarray, "draw event"]

    @classmethod
    def empty(cls, universe: EventUniverse, draws: int) -> "EventTable":
        """A table in which nothing happens."""
        shape = (draws, universe.size)
        return cls(universe, np.zeros(shape, dtype=bool), np.full(shape, np.nan))

    @classmethod
    def from_events(
        cls,
        bodies: Sequence[str],
        worlds: Sequence[Iterable[Event]],
        *,
        start: float | None = None,
        end: float | None = None,
    ) -> "EventTable":
        """A table from one list of events for each draw; of a pair's collisions the first counts.

        Parameters
        ----------
        bodies
            Ids of all bodies.
        worlds
            The events of each draw.
        start, end
            Times in s of the start and the end of the video; None leaves these two events out.
        """
        table = cls.empty(EventUniverse(tuple(bodies)), len(worlds))
        universe = table.universe
        for draw, events in enumerate(worlds):
            for event in sorted(events):
                place = universe.index(event)
                if not table.happens[draw, place]:
                    table.happens[draw, place] = True
                    table.time[draw, place] = event.time
        for place, time in ((universe.start, start), (universe.end, end)):
            if time is not None:
                table.happens[:, place] = True
                table.time[:, place] = time
        return table

    @classmethod
    def joined(cls, parts: "Sequence[EventTable]") -> "EventTable":
        """The draws of several tables of the same video, one after the other."""
        if len(parts) == 1:
            return parts[0]
        happens, time = (np.concatenate([getattr(part, name) for part in parts]) for name in ("happens", "time"))
        return cls(parts[0].universe, happens, time)

    @property
    def draws(self) -> int:
        """Number of draws."""
        return len(self.happens)

    def select(self, draws: np.ndarray) -> "EventTable":
        """The table of the draws with the given indices."""
        return EventTable(self.universe, self.happens[draws], self.time[draws])

    def ancestors(self) -> Bool[np.ndarray, "draw event event_other"]:
        """Whether `event_other` is reached from `event` by going back, object by object, to the previous event.

        CLEVRER's convention: the direct causes of an event are, for each object that takes part in it, the event before
        it in which that object took part; causes of causes count.
        """
        universe = self.universe
        reached = np.zeros((self.draws, universe.size, universe.size), dtype=bool)
        draws = np.arange(self.draws)
        for body in range(len(universe.bodies)):
            own = np.flatnonzero(universe.takes_part[:, body])
            times = np.where(self.happens[:, own], self.time[:, own], np.inf)
            order = np.argsort(times, axis=1, kind="stable")
            for earlier, later in zip(order.T[:-1], order.T[1:], strict=True):
                reached[draws, own[later], own[earlier]] |= self.happens[draws, own[later]]
        for _ in range(max(universe.size - 1, 1).bit_length()):
            # counts of paths: float32 matrix products are fast, and only zero or not matters
            steps = reached.astype(np.float32)
            reached |= (steps @ steps) > 0
        return reached

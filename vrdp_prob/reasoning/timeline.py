"""What happens in a simulated world, noted while it is simulated."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float, Int

from vrdp_prob.reasoning.events import EventTable, EventUniverse
from vrdp_prob.reasoning.stretch import Meeting, Stretch
from vrdp_prob.scene import Camera


@dataclass
class Timeline:
    """Events of one world under simulation.

    Parameters
    ----------
    universe
        The possible events.
    draws
        Number of draws.
    camera
        Contacts outside its picture are no events; None where all are.
    """

    universe: EventUniverse
    draws: int
    camera: Camera | None
    table: EventTable = field(init=False)
    met: Bool[np.ndarray, "draw event"] = field(init=False)
    """Pairs that have met, in view or not: their later contacts are no events."""
    collided: Bool[np.ndarray, "draw body"] = field(init=False)
    """Bodies whose course was decided by a simulated contact."""

    def __post_init__(self) -> None:
        self.table = EventTable.empty(self.universe, self.draws)
        self.met = np.zeros((self.draws, self.universe.size), dtype=bool)
        self.collided = np.zeros((self.draws, len(self.universe.bodies)), dtype=bool)
        self._places = np.zeros((len(self.universe.bodies),) * 2, dtype=int)
        for place, (first, second) in enumerate(self.universe.pairs):
            self._places[first, second] = self._places[second, first] = place

    def note(
        self,
        draws: Int[np.ndarray, "contact"],
        places: Int[np.ndarray, "contact"] | int,
        times: Float[np.ndarray, "contact"],
        *,
        in_view: Bool[np.ndarray, "contact"] | bool = True,
    ) -> None:
        """Note that events happen in some draws, where they have not before."""
        shown = np.broadcast_to(in_view, draws.shape) & ~self.met[draws, places]
        self.table.happens[draws, places] |= shown
        self.table.time[draws, places] = np.where(shown, times, self.table.time[draws, places])
        self.met[draws, places] = True

    def note_meeting(self, meeting: Meeting, keep: Bool[np.ndarray, "contact"]) -> None:
        """Note those of some simulated contacts that are to be kept."""
        draws, first, second = meeting.draws[keep], meeting.first[keep], meeting.second[keep]
        point = meeting.point[keep]
        in_view = np.ones(len(draws), dtype=bool) if self.camera is None else np.asarray(self.camera.in_view(point))
        self.collided[draws, first] = True
        self.collided[draws, second] = True
        self.note(draws, self._places[first, second], meeting.time[keep], in_view=in_view)

    def note_crossings(
        self,
        times: Float[np.ndarray, "time"],
        position: Float[np.ndarray, "draw time body 2"],
        exists: Bool[np.ndarray, "draw time body"],
        followed: Bool[np.ndarray, "draw body"],
    ) -> None:
        """Note entrances and exits of the followed bodies between neighbouring times."""
        if self.camera is None:
            return
        inside = np.asarray(self.camera.in_view(position)) & exists
        for part, crossing in (
            (self.universe.entrances, ~inside[:, :-1] & inside[:, 1:]),
            (self.universe.exits, inside[:, :-1] & ~inside[:, 1:] & exists[:, 1:]),
        ):
            crossed = crossing & followed[:, None, :]
            for body in range(crossed.shape[2]):
                draws = np.flatnonzero(crossed[:, :, body].any(axis=1))
                first = crossed[draws, :, body].argmax(axis=1)
                self.note(draws, part.start + body, times[first + 1])

    def note_as_seen(
        self, seen: EventTable, *, entering: Bool[np.ndarray, "draw body"], leaving: Bool[np.ndarray, "draw body"]
    ) -> None:
        """Note the entrances and exits of the video, of the bodies that enter and leave as they did."""
        for part, followed in ((self.universe.entrances, entering), (self.universe.exits, leaving)):
            for body, place in enumerate(range(part.start, part.stop)):
                draws = np.flatnonzero(seen.happens[:, place] & followed[:, body])
                self.note(draws, place, seen.time[draws, place])

    def of(self, stretch: Stretch) -> "WorldDraws":
        """The world of one stretch whose events these are."""
        trajectory = np.concatenate([stretch.position, stretch.angle[..., None]], axis=-1)
        return WorldDraws(stretch.times, trajectory, stretch.exists, self.table, self.collided, stretch.broke_off)


@dataclass(frozen=True)
class WorldDraws:
    """A world as all draws see it.

    Parameters
    ----------
    times
        Times in s of the frames.
    trajectory
        x, y in m and angle in rad.
    exists
        Whether a body is there.
    events
        What happens.
    collided
        Bodies whose course was decided by a simulated contact.
    broke_off
        Whether its simulation broke off.
    """

    times: Float[np.ndarray, "frame"]
    trajectory: Float[np.ndarray, "draw frame body 3"]
    exists: Bool[np.ndarray, "draw frame body"]
    events: EventTable
    collided: Bool[np.ndarray, "draw body"]
    broke_off: Bool[np.ndarray, "draw"]

    @classmethod
    def joined(cls, parts: "Sequence[WorldDraws]") -> "WorldDraws":
        """The draws of several batches, one after the other."""
        if len(parts) == 1:
            return parts[0]
        return cls(
            parts[0].times,
            np.concatenate([part.trajectory for part in parts]),
            np.concatenate([part.exists for part in parts]),
            EventTable.joined([part.events for part in parts]),
            np.concatenate([part.collided for part in parts]),
            np.concatenate([part.broke_off for part in parts]),
        )

    def with_draws(self, chosen: Bool[np.ndarray, "draw"], others: "WorldDraws") -> "WorldDraws":
        """The same with some draws taken from elsewhere."""
        parts = {}
        for name in ("trajectory", "exists", "collided", "broke_off"):
            values = getattr(self, name).copy()
            values[chosen] = getattr(others, name)
            parts[name] = values
        happens, time = self.events.happens.copy(), self.events.time.copy()
        happens[chosen], time[chosen] = others.events.happens, others.events.time
        return WorldDraws(self.times, events=EventTable(self.events.universe, happens, time), **parts)

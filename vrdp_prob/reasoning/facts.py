"""What operations may know about a video: who is in it, what happens in each world, and who moves when."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float

from vrdp_prob.reasoning.chance import Purpose, Random, Seeded
from vrdp_prob.reasoning.changes import Change
from vrdp_prob.reasoning.events import EventTable
from vrdp_prob.reasoning.values import Label
from vrdp_prob.scene import Body
from vrdp_prob.scene.body import ATTRIBUTES, COLORS, MATERIALS, Shape

MOVING_SPEED = 0.1
"""An object in view moves when it is faster than this, in m/s (CLEVRER's threshold)."""

NOT_STATED = ""
"""Value of an attribute that nobody stated."""


@dataclass(frozen=True)
class Motion:
    """Who is in view and who moves, in each frame.

    Parameters
    ----------
    times
        Times of the frames in s.
    in_view
        Whether an object is in the picture.
    moving
        Whether it is in the picture and faster than `MOVING_SPEED`.
    """

    times: Float[np.ndarray, "frame"]
    in_view: Bool[np.ndarray, "draw frame body"]
    moving: Bool[np.ndarray, "draw frame body"]

    @classmethod
    def joined(cls, parts: "Sequence[Motion]") -> "Motion":
        """The draws of several batches of the same video, one after the other."""
        if len(parts) == 1:
            return parts[0]
        in_view, moving = (np.concatenate([getattr(part, name) for part in parts]) for name in ("in_view", "moving"))
        return cls(parts[0].times, in_view, moving)

    def frame(self, time: Float[np.ndarray, "draw"]) -> np.ndarray:
        """Index of the frame that is nearest to each draw's time; integer array with axis `draw`."""
        places = np.clip(np.searchsorted(self.times, time), 1, len(self.times) - 1) if len(self.times) > 1 else None
        if places is None:
            return np.zeros(len(time), dtype=int)
        nearer_before = time - self.times[places - 1] < self.times[places] - time
        return np.asarray(places - nearer_before, dtype=int)


@runtime_checkable
class Facts(Protocol):
    """A video as the operations see it; every table has the same draws."""

    @property
    def bodies(self) -> tuple[Body, ...]:
        """The objects, in the order of every body axis."""
        ...

    @property
    def draws(self) -> int:
        """Number of draws."""
        ...

    @property
    def effective_draws(self) -> float:
        """Number of independent draws that would be worth as much; infinite where nothing is random."""
        ...

    def attribute(self, name: str) -> tuple[Label, ...]:
        """Value of `color`, `material` or `shape` in each draw, one entry for each object."""
        ...

    def motion(self) -> Motion:
        """Who moves when, in the video."""
        ...

    def events(self) -> EventTable:
        """What happens in the video."""
        ...

    def unseen_events(self) -> EventTable:
        """What happens after the video, without collisions of pairs that met before."""
        ...

    def counterfactual_events(self, change: Change, body: int) -> EventTable:
        """What happens in the time of the video when one object is changed from the beginning."""
        ...

    def relies_on_default(self, world: "str | tuple[Change, int]") -> tuple[str, ...]:
        """Objects of default mass or restitution that decide what happens after the video (`future`) or in a change."""
        ...

    def limits(self, world: "str | tuple[Change, int]") -> tuple[str, ...]:
        """What limits the simulation of that world, in sentences."""
        ...


def attribute_values(name: str, bodies: tuple[Body, ...]) -> tuple[str, ...]:
    """The values that an attribute can have in a video, the data set's own first."""
    known: tuple[str, ...] = {"color": COLORS, "material": MATERIALS, "shape": tuple(s.value for s in Shape)}[name]
    others = {value for body in bodies for value in body.probabilities(name)} - set(known)
    return (NOT_STATED, *known, *sorted(others))


def draw_attributes(bodies: tuple[Body, ...], draws: int, numbers: Random) -> dict[str, tuple[Label, ...]]:
    """Attributes of all bodies, drawn from what perception made of them; certain ones are the same in all draws."""
    attributes = {}
    for name in ATTRIBUTES:
        names = attribute_values(name, bodies)
        labels = []
        for body in bodies:
            probabilities = body.probabilities(name) or {NOT_STATED: 1.0}
            values = np.array([names.index(value) for value in probabilities])
            weights = np.array(list(probabilities.values()))
            if len(values) == 1:
                index = np.full(draws, values[0])
            else:
                index = numbers.choice(values, size=draws, p=weights / weights.sum())
            labels.append(Label(index, names))
        attributes[name] = tuple(labels)
    return attributes


@dataclass(frozen=True)
class TableFacts:
    """Facts filled by hand: event tables and who moves.

    Parameters
    ----------
    bodies
        The objects.
    video
        What happens in the video.
    movement
        Who moves when.
    future
        What happens after the video; None where predictive questions are not asked.
    changed
        What happens for each change of an object (by its place).
    effective_draws
        See `Facts`.
    seed
        Seed of the draws of uncertain attributes.
    """

    bodies: tuple[Body, ...]
    video: EventTable
    movement: Motion
    future: EventTable | None = None
    changed: Mapping[tuple[Change, int], EventTable] = field(default_factory=dict)
    effective_draws: float = np.inf
    seed: int = 0

    @property
    def draws(self) -> int:
        """Number of draws."""
        return self.video.draws

    def attribute(self, name: str) -> tuple[Label, ...]:
        """Value of an attribute in each draw, one entry for each object."""
        return draw_attributes(self.bodies, self.draws, Seeded(self.seed).numbers(Purpose.ATTRIBUTES))[name]

    def motion(self) -> Motion:
        """Who moves when."""
        return self.movement

    def events(self) -> EventTable:
        """What happens in the video."""
        return self.video

    def unseen_events(self) -> EventTable:
        """What happens after the video; nothing where it was not stated."""
        return self.future or EventTable.empty(self.video.universe, self.draws)

    def counterfactual_events(self, change: Change, body: int) -> EventTable:
        """What happens with a change; nothing where it was not stated."""
        return self.changed.get((change, body)) or EventTable.empty(self.video.universe, self.draws)

    def relies_on_default(self, world: str | tuple[Change, int]) -> tuple[str, ...]:
        """Nothing: the tables are given."""
        del world
        return ()

    def limits(self, world: str | tuple[Change, int]) -> tuple[str, ...]:
        """Nothing: the tables are given."""
        del world
        return ()

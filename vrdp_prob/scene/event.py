"""What happens in a video: collisions, and objects that come into the picture or leave it."""

from dataclasses import dataclass
from enum import StrEnum


class EventKind(StrEnum):
    """Kind of an event, in CLEVRER's words."""

    COLLISION = "collision"
    IN = "in"
    OUT = "out"


@dataclass(frozen=True, order=True)
class Event:
    """One event at one time.

    Parameters
    ----------
    time
        Time in s.
    kind
        What happens. A collision is the first contact of a pair; later contacts of the pair are no events.
    objects
        Ids of the objects that take part: two for a collision (sorted), one otherwise.
    """

    time: float
    kind: EventKind
    objects: tuple[str, ...]

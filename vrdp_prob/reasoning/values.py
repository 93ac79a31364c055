"""What operations take and give: values that hold one entry for each posterior draw."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from vrdp_prob.reasoning.changes import Change


@dataclass(frozen=True)
class Word:
    """A concept word of the program: `red`, `metal`, `cube`, `first`, `null`."""

    text: str


@dataclass(frozen=True)
class ObjectSet:
    """A set of objects in each draw; `words` say how it was picked, for messages."""

    mask: Bool[np.ndarray, "draw body"]
    words: tuple[str, ...] = ()


@dataclass(frozen=True)
class ObjectRef:
    """One object in each draw, by its place on the body axis; `change` is an intervention asked for by `apply_*`."""

    index: Int[np.ndarray, "draw"]
    words: tuple[str, ...] = ()
    change: Change | None = None

    @property
    def phrase(self) -> str:
        """The object as a question would name it."""
        return f"the {noun_phrase(self.words)}"


@dataclass(frozen=True)
class EventSet:
    """A set of events in each draw.

    Parameters
    ----------
    mask
        The events.
    time
        Their times in s, NaN where an event has no time (as in `all_events`).
    phrase
        What they are, for messages.
    parties
        Whom the collisions are of: what `filter_collision` took, one entry for each time that it was used.
    follows_video
        Whether they are of the time after the video.
    """

    mask: Bool[np.ndarray, "draw event"]
    time: Float[np.ndarray, "draw event"]
    phrase: str = "event"
    parties: tuple[ObjectSet | ObjectRef, ...] = ()
    follows_video: bool = False


@dataclass(frozen=True)
class EventRef:
    """One event in each draw, by its place on the event axis; `present` is False where no event fits."""

    index: Int[np.ndarray, "draw"]
    present: Bool[np.ndarray, "draw"]
    time: Float[np.ndarray, "draw"]
    phrase: str = "event"


@dataclass(frozen=True)
class Moment:
    """A time in s in each draw."""

    time: Float[np.ndarray, "draw"]


@dataclass(frozen=True)
class Truth:
    """Yes or no in each draw."""

    value: Bool[np.ndarray, "draw"]


@dataclass(frozen=True)
class Count:
    """A number in each draw."""

    value: Int[np.ndarray, "draw"]


@dataclass(frozen=True)
class Label:
    """The value of an attribute in each draw, as a place in `names`."""

    index: Int[np.ndarray, "draw"]
    names: tuple[str, ...]

    @classmethod
    def joined(cls, parts: "Sequence[Label]") -> "Label":
        """The draws of several batches, one after the other."""
        return cls(np.concatenate([part.index for part in parts]), parts[0].names)


Value = Word | ObjectSet | ObjectRef | EventSet | EventRef | Moment | Truth | Count | Label

TYPE_NAMES: dict[type, str] = {
    Word: "a word",
    ObjectSet: "objects",
    ObjectRef: "one object",
    EventSet: "events",
    EventRef: "one event",
    Moment: "a frame",
    Truth: "yes or no",
    Count: "a number",
    Label: "an attribute",
}


def noun_phrase(words: tuple[str, ...]) -> str:
    """The words that pick an object, as English: `('red', 'cube')` is 'red cube', `('red',)` is 'red object'."""
    has_noun = bool(words) and words[-1] in ("cube", "sphere", "cylinder")
    return " ".join(words if has_noun else (*words, "object"))

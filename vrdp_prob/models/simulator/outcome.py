"""How the simulation of a world ended: failure is a value, so that one bad world does not spoil its batch."""

from enum import IntEnum


class Outcome(IntEnum):
    """End of the simulation of one world."""

    OK = 0
    OVERLAP = 1
    EVENT_LIMIT = 2
    NOT_SOLVED = 3
    NOT_FINITE = 4

    @property
    def sentence(self) -> str:
        """What the outcome means, for people."""
        return _SENTENCES[self]


OUTCOMES = tuple(Outcome)
"""The outcomes by their codes, which is faster than asking the enumeration for each of many worlds."""

_SENTENCES = {
    Outcome.OK: "The world was simulated to the last time.",
    Outcome.OVERLAP: (
        "Two bodies overlapped when one of them appeared; they pass through each other until they are apart: check "
        "positions and radii."
    ),
    Outcome.EVENT_LIMIT: (
        "More events happened than the limit allows; bodies are shown where they were then: raise event_limit or look "
        "for bodies that are pressed together."
    ),
    Outcome.NOT_SOLVED: (
        "The motion changes too fast to be followed; bodies are shown where they were then: check the parameters."
    ),
    Outcome.NOT_FINITE: "A number of the world is not finite, so it was not simulated: check states and parameters.",
}

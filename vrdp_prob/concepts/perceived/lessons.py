"""What is taught: videos with answers about them, and what a network learns from them in which order."""

from dataclasses import dataclass

from torch import nn

from vrdp_prob.concepts.perceived.examples import Example
from vrdp_prob.concepts.perceived.network import ConceptNetwork
from vrdp_prob.concepts.perceived.observation import Observation

_FIRST_LENGTH, _LENGTH_PER_EPOCH = 12, 1.5
"""Longest program of the first epoch in tokens, and by how much that grows."""


@dataclass(frozen=True)
class Taught:
    """A video with what is asked about it."""

    observation: Observation
    examples: tuple[Example, ...]


@dataclass(frozen=True)
class Lesson:
    """What a network learns at a time.

    Parameters
    ----------
    name
        Name of the lesson.
    learned_events
        Whether events and motion are those of the concepts; else those of the tracks.
    parts
        Modules of the network that learn.
    epochs
        At most so many.
    """

    name: str
    learned_events: bool
    parts: tuple[str, ...]
    epochs: int

    def parameters(self, network: ConceptNetwork) -> list[nn.Parameter]:
        """What learns."""
        return [parameter for part in self.parts for parameter in network.get_submodule(part).parameters()]

    @staticmethod
    def longest_program(epoch: int) -> float:
        """Longest program in tokens that an epoch asks: first what is simple, as children and NS-CL learn."""
        return _FIRST_LENGTH + _LENGTH_PER_EPOCH * epoch


LESSONS = (
    Lesson("attributes", learned_events=False, parts=("appearance", "attributes"), epochs=48),
    Lesson(
        "events",
        learned_events=True,
        parts=("motion_encoder", "crossing_encoder", "pair_encoder", "motions", "crossings", "meetings"),
        epochs=36,
    ),
)
"""Attributes with the events of the tracks, then events with these attributes."""

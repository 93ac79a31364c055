"""The concept words of the question language: which there are, and which are values of one attribute."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from vrdp_prob.reasoning.operations import REGISTRY
from vrdp_prob.reasoning.program import OPERATION_MODULES
from vrdp_prob.scene.body import ATTRIBUTES

MOTIONS = ("moving", "stationary")
EVENTS = ("collision", "in", "out")


def attribute_words() -> dict[str, tuple[str, ...]]:
    """Every word of each attribute: what its filter takes."""
    assert OPERATION_MODULES  # their import fills the registry
    return {name: REGISTRY[f"filter_{name}"][0].words for name in ATTRIBUTES}


@dataclass(frozen=True)
class Vocabulary:
    """The words that were learned, by attribute, in the order of the question language."""

    values: Mapping[str, tuple[str, ...]]

    @classmethod
    def of(cls, words: Iterable[str]) -> "Vocabulary":
        """The attribute words among some words."""
        known = set(words)
        return cls({name: tuple(word for word in every if word in known) for name, every in attribute_words().items()})

    @property
    def missing(self) -> tuple[str, ...]:
        """Words of the question language that were not learned."""
        return tuple(
            word for name, every in attribute_words().items() for word in every if word not in self.values[name]
        )

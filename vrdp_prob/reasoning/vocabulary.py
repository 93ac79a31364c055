"""The words that questions may use beyond the built-in ones: each stands for a change that was learned."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol, runtime_checkable

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.change_operations import COUNTERFACT, change_operations
from vrdp_prob.reasoning.changes import Change
from vrdp_prob.reasoning.language.words import COMPARATIVES
from vrdp_prob.reasoning.operations import REGISTRY, Operation, by_token


@runtime_checkable
class ChangeWord(Protocol):
    """A word for a change, as it was learned."""

    @property
    def change(self) -> Change:
        """What it does to an object."""
        ...


@dataclass(frozen=True)
class Vocabulary:
    """What questions are understood with.

    Parameters
    ----------
    changes
        Learned changes by their word; a built-in word among them has its learned meaning.
    """

    changes: Mapping[str, Change] = field(default_factory=dict)

    @classmethod
    def of(cls, words: Sequence[ChangeWord]) -> "Vocabulary":
        """The vocabulary of some learned words.

        Raises
        ------
        InputError
            If they are no list of learned words, or two of them are the same word.
        """
        if isinstance(words, ChangeWord | str) or not isinstance(words, Sequence):
            raise InputError(f"words is {_named(words)}; give a list of learned words, even of one.")
        for word in words:
            if not isinstance(word, ChangeWord):
                raise InputError(f"among the words is {_named(word)}; open the file of a word with LearnedWord.read.")
        changes = {word.change.word: word.change for word in words}
        if len(changes) < len(words):
            names = [word.change.word for word in words]
            twice = next(name for name in names if names.count(name) > 1)
            raise InputError(f"the word '{twice}' is given twice; give each word once.")
        return cls(changes)

    @cached_property
    def operations(self) -> Mapping[str, Sequence[Operation]]:
        """The signatures of every token, from the longest to the shortest."""
        learned = [operation for change in self.changes.values() for operation in change_operations(change)]
        return {**REGISTRY, **by_token(learned)}

    @property
    def comparatives(self) -> Mapping[str, str]:
        """The token of every word that can follow 'if the cube were'."""
        return {**COMPARATIVES, **{word: f"{COUNTERFACT}{word}" for word in self.changes}}


def _named(value: object) -> str:
    """What was given in place of words, for messages."""
    return f"the word '{value.change.word}'" if isinstance(value, ChangeWord) else f"{value!r:.80}"


PLAIN = Vocabulary()
"""The built-in words alone."""

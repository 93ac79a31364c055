"""A reader of words that can go back, and remembers how far any reading got."""

from collections.abc import Callable, Mapping
from typing import TypeVar

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.language.words import COMPARATIVES, as_written, split

Result = TypeVar("Result")

KNOWN_HINT = "docs/questions.md lists the wordings that are understood"


class NoReadingError(Exception):
    """The words do not fit this rule; another may be tried."""


class NotUnderstoodError(InputError):
    """No reading reaches the end of the words; the message names the first one that nothing fits."""


def not_understood(text: str, place: int) -> NotUnderstoodError:
    """The refusal of a text at one of the words that `split` makes of it, counted from 0."""
    word, number = as_written(text, place)
    return NotUnderstoodError(f"'{text}' is not understood at '{word}' (word {number}); {KNOWN_HINT}.")


class Reader:
    """Words of one text, read from left to right.

    Parameters
    ----------
    text
        A question or a choice.
    kind
        What it is, for messages.
    comparatives
        Words that say how an object would be changed, and their tokens.
    """

    def __init__(self, text: str, kind: str = "question", comparatives: Mapping[str, str] = COMPARATIVES) -> None:
        self.text = text
        self.kind = kind
        self.comparatives = comparatives
        self.words = split(text)
        self.place = 0
        self._furthest = 0

    @property
    def next(self) -> str:
        """The next word, empty at the end."""
        return self.words[self.place] if self.place < len(self.words) else ""

    def accept(self, *phrases: str) -> bool:
        """Read one of the phrases if it comes next; the first that fits counts."""
        for phrase in phrases:
            wanted = tuple(phrase.split())
            given = self.words[self.place : self.place + len(wanted)]
            if given == wanted:
                self.place += len(wanted)
                return True
            agree = next((n for n, (a, b) in enumerate(zip(given, wanted, strict=False)) if a != b), len(given))
            self._furthest = max(self._furthest, self.place + agree)
        return False

    def expect(self, *phrases: str) -> None:
        """Read one of the phrases, or give up this reading."""
        if not self.accept(*phrases):
            raise NoReadingError

    def one_of(self, table: Mapping[str, Result]) -> Result:
        """Read a word of a table and give what it stands for, or give up this reading."""
        if self.next in table:
            self.place += 1
            return table[self.words[self.place - 1]]
        self._furthest = max(self._furthest, self.place)
        raise NoReadingError

    def first(self, *rules: Callable[[], Result]) -> Result:
        """What the first rule that fits gives; rules that do not fit leave no trace."""
        start = self.place
        for rule in rules:
            try:
                return rule()
            except NoReadingError:
                self.place = start
        raise NoReadingError

    def maybe(self, rule: Callable[[], Result]) -> Result | None:
        """What a rule gives, None where it does not fit."""
        start = self.place
        try:
            return rule()
        except NoReadingError:
            self.place = start
            return None

    def whole(self, *rules: Callable[[], Result]) -> Result:
        """What the first rule that reads all words gives.

        Raises
        ------
        InputError
            If there are no words.
        NotUnderstoodError
            If no rule reads all of them.
        """
        if not self.words:
            raise InputError(f"the {self.kind} is empty; {KNOWN_HINT}.")

        def to_the_end(rule: Callable[[], Result]) -> Callable[[], Result]:
            def read() -> Result:
                result = rule()
                if self.place < len(self.words):
                    self._furthest = max(self._furthest, self.place)
                    raise NoReadingError
                return result

            return read

        try:
            return self.first(*(to_the_end(rule) for rule in rules))
        except NoReadingError:
            raise self._refusal() from None

    def _refusal(self) -> NotUnderstoodError:
        if self._furthest >= len(self.words):
            last, _ = as_written(self.text, len(self.words) - 1)
            return NotUnderstoodError(f"'{self.text}' ends too early, after '{last}'; {KNOWN_HINT}.")
        return not_understood(self.text, self._furthest)

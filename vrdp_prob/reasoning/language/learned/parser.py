"""The learned parser: a text to a program that type-checks, with its probability, or nothing."""

import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import torch

from vrdp_prob.reasoning.language.learned.agreement import agrees, stray_negation
from vrdp_prob.reasoning.language.learned.decoding import PartialProgram
from vrdp_prob.reasoning.language.learned.examples import by_grammar
from vrdp_prob.reasoning.language.learned.network import (
    BEGIN,
    END,
    NOTHING,
    PADDING,
    ParserNetwork,
    Vocabulary,
    numbers_of_text,
)
from vrdp_prob.reasoning.language.learned.storage import WEIGHTS, read_parser
from vrdp_prob.reasoning.language.meaning import Tokens, meaning_of
from vrdp_prob.reasoning.language.rewording import reworded

THRESHOLD = 0.8
"""Least probability of a reading; docs/questions.md has what it lets through."""

LONGEST = 60
"""Tokens of the longest program that is written; the longest of the training has fewer."""


@dataclass(frozen=True)
class LearnedReading:
    """What a text was read as.

    Parameters
    ----------
    program
        Tokens in postfix order; a choice's as if it was sought among the events of the video.
    wording
        The same in the grammar's English.
    probability
        That the network gives to the whole program.
    """

    program: Tokens
    wording: str
    probability: float


@dataclass(frozen=True)
class LearnedParser:
    """A trained network and its vocabulary."""

    network: ParserNetwork
    vocabulary: Vocabulary

    def unknown(self, words: tuple[str, ...]) -> int | None:
        """Place of the first word that is not in the vocabulary."""
        return next((place for place, word in enumerate(words) if word not in self.vocabulary.word_numbers), None)

    def unreadable(self, words: tuple[str, ...]) -> int | None:
        """Place of the first word that is not in the vocabulary, or of a negation that nothing is said with."""
        unknown = self.unknown(words)
        return stray_negation(words) if unknown is None else unknown

    def read(self, kind: str, words: tuple[str, ...], *, threshold: float = THRESHOLD) -> LearnedReading | None:
        """Read a text whose words are all in the vocabulary.

        Parameters
        ----------
        kind
            `question` or `choice`.
        words
            The text as `split` cuts it.
        threshold
            Least probability of a reading.

        Returns
        -------
        The most probable program, found token by token among those that can still become well-typed. None where it
        is too improbable, asks what the grammar cannot say, or names other things than the text.
        """
        program, probability = self.most_probable(kind, words)
        if program is None or probability < threshold:
            return None
        wording = believable(kind, words, program)
        return None if wording is None else LearnedReading(program, wording, probability)

    @torch.inference_mode()
    def most_probable(self, kind: str, words: tuple[str, ...]) -> tuple[Tokens | None, float]:
        """The program found token by token among those that can still become well-typed, and its probability.

        None if the network takes the text for nonsense, or the program would be too long.
        """
        tokens = self.vocabulary.tokens
        read, there, state = self.network.read(torch.tensor([numbers_of_text(kind, words, self.vocabulary)]))
        partial, program, log_probability, last = PartialProgram(kind), list[str](), 0.0, BEGIN
        while len(program) < LONGEST:
            given = torch.tensor([[tokens.index(last)]])
            log_probabilities, state = self.network.write(given, read, there, state)
            ranked = log_probabilities[0, 0].tolist()
            allowed = [number for number, token in enumerate(tokens) if _may_follow(partial, program, token)]
            if not allowed:
                return None, 0.0
            best = max(allowed, key=ranked.__getitem__)
            log_probability += ranked[best]
            last = tokens[best]
            if last == NOTHING:
                return None, 0.0
            if last == END:
                return tuple(program), math.exp(log_probability)
            program.append(last)
            partial.push(last)
        return None, 0.0


def believable(kind: str, words: tuple[str, ...], program: Tokens) -> str | None:
    """A program in the grammar's English, None where the grammar cannot say it or it names other things than the text.

    Parameters
    ----------
    kind
        `question` or `choice`.
    words
        The text as `split` cuts it.
    program
        What it was read as; a choice's as if it was sought among the events of the video.
    """
    meaning, wording = meaning_of(program, kind), reworded(program, kind)
    if meaning is None or wording is None or by_grammar(kind, wording) != program:
        return None
    return wording if agrees(words, meaning) else None


def _may_follow(partial: PartialProgram, program: list[str], token: str) -> bool:
    if token in (PADDING, BEGIN):
        return False
    if token == NOTHING:
        return not program
    return partial.is_whole if token == END else partial.admits(token)


@cache
def learned_parser(path: Path = WEIGHTS) -> LearnedParser:
    """The parser whose weights ship with the package.

    Raises
    ------
    InputError
        If its weights cannot be read.
    """
    return LearnedParser(*read_parser(path))

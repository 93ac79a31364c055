"""Programs in postfix order: read, type-checked before anything runs, and run for all draws at once.

Errors point at the token: its place in the program (counting from 1), the token, and what was there instead.
"""

import difflib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning import change_operations, event_operations, object_operations, output_operations
from vrdp_prob.reasoning.change_operations import COUNTERFACT
from vrdp_prob.reasoning.operations import Operation
from vrdp_prob.reasoning.run import Run
from vrdp_prob.reasoning.tokens import ANY_FRAME, CONCEPTS, OTHER_SPELLINGS, meaningful
from vrdp_prob.reasoning.values import (
    TYPE_NAMES,
    Count,
    EventRef,
    Label,
    ObjectRef,
    Truth,
    Value,
    Word,
)
from vrdp_prob.reasoning.vocabulary import PLAIN, Vocabulary
from vrdp_prob.scene import QuestionType

Result = TypeVar("Result")

OPERATION_MODULES = (change_operations, event_operations, object_operations, output_operations)
"""Modules whose import fills the registry."""

ANSWERS = (Truth, Count, Label)
"""Types that a question may end in."""

ENTRIES = (ObjectRef, EventRef)
"""Types that a choice may end in: what the question's program then judges."""


@dataclass(frozen=True)
class Program:
    """A type-checked program.

    Parameters
    ----------
    tokens
        Its tokens, in the data set's spelling.
    steps
        What each token does: an operation, or a word that is pushed.
    gives
        Type of its result.
    """

    tokens: tuple[str, ...]
    steps: tuple[Operation | Word, ...]
    gives: type

    def run(self, run: Run) -> Value:
        """Run it for all draws; `run` learns in which draws it makes sense."""
        return self.evaluate(lambda step, arguments: step(run, *arguments))

    def evaluate(self, apply: Callable[[Operation, Sequence[Any]], Result]) -> Result:
        """Step through it with operations that mean what `apply` makes of them and their arguments.

        Parameters
        ----------
        apply
            Gives the result of an operation from the results (or words) that it takes, in the order in which they were
            pushed.
        """
        stack: list[Any] = []
        for step in self.steps:
            if isinstance(step, Word):
                stack.append(step)
            else:
                begin = len(stack) - len(step.takes)
                arguments = stack[begin:]
                del stack[begin:]
                stack.append(apply(step, arguments))
        return stack[-1]


def check(
    program: Sequence[str],
    *,
    ends_in: tuple[type, ...] = ANSWERS,
    given: type | None = None,
    vocabulary: Vocabulary = PLAIN,
) -> Program:
    """Type-check a program.

    Parameters
    ----------
    program
        Tokens in postfix order, in any of the known spellings.
    ends_in
        Types that its result may have.
    given
        Type of a value that lies on the stack before it begins, as a choice leaves one for its question.
    vocabulary
        The words it may use.

    Raises
    ------
    InputError
        If it is empty, a token is unknown, an operation does not find what it takes, something is left on the stack, or
        the result is not of a wanted type. The message names the token and its place.
    """
    tokens = meaningful(tuple(program))
    if not tokens:
        raise InputError("the program is empty; give at least one token.")
    stack: list[type] = [] if given is None else [given]
    words: list[str | None] = [None] * len(stack)
    steps: list[Operation | Word] = []
    for place, token in enumerate(tokens, start=1):
        if token in vocabulary.operations:
            chosen = _signature(place, token, stack, vocabulary)
            count = len(chosen.takes)
            _check_word(place, token, chosen, words[len(words) - count :])
            del stack[len(stack) - count :]
            del words[len(words) - count :]
            stack.append(chosen.gives)
            words.append(None)
            steps.append(chosen)
        elif token in CONCEPTS:
            stack.append(Word)
            words.append(token)
            steps.append(Word(token))
        else:
            raise InputError(f"program token {place} '{token}' is unknown{_suggestion(token, vocabulary)}.")
    if len(stack) > 1:
        left = ", ".join(TYPE_NAMES[kind] for kind in stack[:-1])
        raise InputError(
            f"the program ends at token {len(tokens)} '{tokens[-1]}' with {left} left over; "
            "every value must be taken by an operation."
        )
    if stack[-1] not in ends_in:
        wanted = " or ".join(TYPE_NAMES[kind] for kind in ends_in)
        raise InputError(
            f"the program ends at token {len(tokens)} '{tokens[-1]}' with {TYPE_NAMES[stack[-1]]}; "
            f"it must end with {wanted}."
        )
    return Program(tokens, tuple(steps), stack[-1])


def needs_choices(program: Sequence[str], vocabulary: Vocabulary = PLAIN) -> bool:
    """Whether a question's program judges choices: it does not run by itself, but does on an event or an object."""
    if _fits(program, None, vocabulary):
        return False
    return "belong_to" in meaningful(tuple(program)) or any(_fits(program, entry, vocabulary) for entry in ENTRIES)


def _fits(program: Sequence[str], given: type | None, vocabulary: Vocabulary) -> bool:
    try:
        check(program, given=given, vocabulary=vocabulary)
    except InputError:
        return False
    return True


def question_type(program: Sequence[str]) -> QuestionType:
    """Kind of a question, read off its program."""
    tokens = set(meaningful(tuple(program)))
    if any(token == "get_counterfact" or token.startswith(COUNTERFACT) for token in tokens):
        return QuestionType.COUNTERFACTUAL
    if "unseen_events" in tokens:
        return QuestionType.PREDICTIVE
    return QuestionType.EXPLANATORY if "filter_ancestor" in tokens else QuestionType.DESCRIPTIVE


def _signature(place: int, token: str, stack: list[type], vocabulary: Vocabulary) -> Operation:
    signatures = vocabulary.operations[token]
    for candidate in signatures:
        if candidate.fits(stack):
            return candidate
    wanted = " or ".join(dict.fromkeys(_takes(candidate) for candidate in signatures))
    most = max(len(candidate.takes) for candidate in signatures)
    found = ", then ".join(TYPE_NAMES[kind] for kind in stack[-most:]) or "nothing"
    raise InputError(f"program token {place} '{token}' takes {wanted}, but finds {found}.")


def _takes(candidate: Operation) -> str:
    return ", then ".join(" or ".join(TYPE_NAMES[kind] for kind in kinds) for kinds in candidate.takes)


def _check_word(place: int, token: str, chosen: Operation, given: list[str | None]) -> None:
    for word in given:
        if word is not None and word not in chosen.words:
            raise InputError(f"program token {place} '{token}' takes one of {', '.join(chosen.words)}, not '{word}'.")


def _suggestion(token: str, vocabulary: Vocabulary) -> str:
    known = [*vocabulary.operations, *OTHER_SPELLINGS, *(CONCEPTS - {ANY_FRAME})]
    close = difflib.get_close_matches(token, known, n=1)
    return f"; did you mean '{close[0]}'?" if close else "; see docs/questions.md for the tokens"

"""One question of a CLEVRER question file, every field of which is checked."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import count
from typing import Any

from vrdp_prob.errors import InputError
from vrdp_prob.scene import Choice, Question, QuestionType

Entry = Mapping[str, Any]

SUBTYPE = "question_subtype"
LONGEST = 40
"""Letters of a wrong value that a message shows."""


def question_of(place: str, entry: object) -> Question:
    """The question of an entry.

    Parameters
    ----------
    place
        The file and the video, for messages.
    entry
        The entry as JSON values.

    Raises
    ------
    InputError
        If the entry is no question; the message names the place, the question and the field.
    """
    name = entry.get("question_id", "?") if isinstance(entry, dict) else "?"
    try:
        return replace(_read(entry), source=place)
    except InputError as error:
        raise InputError(f"{place}, question {name}: {error}") from error


def check_ids(place: str, field: str, ids: Sequence[int | str | None]) -> None:
    """Refuse names that are there twice.

    Raises
    ------
    InputError
        If two are the same, as numbers or as texts.
    """
    texts = [str(one) for one in ids if one is not None]
    twice = next((text for text in texts if texts.count(text) > 1), None)
    if twice is not None:
        raise InputError(f"{place}: the {field} {twice} is there twice; name them apart.")


def in_short(value: object) -> str:
    """A value of a JSON document as it stands there, cut off where it is long."""
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."


def _read(entry: object) -> Question:
    if not isinstance(entry, dict):
        raise InputError(f"{in_short(entry)} is no question; a question needs at least 'question', its text.")
    choices = entry.get("choices")
    if choices is not None and not isinstance(choices, list):
        raise InputError(f"'choices' is {in_short(choices)}; give a list, in which each entry has a 'choice'.")
    options = _with_ids([_choice(number, choice) for number, choice in enumerate(choices or ())])
    return Question(
        text=_text(entry, "question"),
        program=_program(entry),
        choices=options,
        question_type=_question_type(entry),
        question_id=_identity(entry, "question_id"),
        answer=_answer(entry),
        labels=None if entry.get(SUBTYPE) is None else {SUBTYPE: _text(entry, SUBTYPE)},
    )


def _with_ids(choices: Sequence[tuple[str | int | None, Choice]]) -> tuple[Choice, ...]:
    """Choices with the ids that are given, each other one with its place, or a number that is free."""
    given = [identity for identity, _ in choices if identity is not None]
    check_ids("'choices'", "choice_id", given)
    taken = {str(identity) for identity in given}
    found = []
    for place, (identity, choice) in enumerate(choices):
        free = next(number for number in count(place) if str(number) not in taken)
        found.append(replace(choice, choice_id=free if identity is None else identity))
        taken.add(str(found[-1].choice_id))
    return tuple(found)


def _choice(number: int, entry: object) -> tuple[str | int | None, Choice]:
    """A choice and the id that its entry gives."""
    if not isinstance(entry, dict):
        raise InputError(
            f"entry {number + 1} of 'choices' is {in_short(entry)}; each needs at least 'choice', its text."
        )
    try:
        identity = _identity(entry, "choice_id")
        return identity, Choice(number, _text(entry, "choice"), _program(entry), _judged(entry))
    except InputError as error:
        raise InputError(f"entry {number + 1} of 'choices': {error}") from error


def _text(entry: Entry, field: str) -> str:
    if field not in entry:
        raise InputError(f"there is no '{field}'; give its text.")
    if not isinstance(entry[field], str):
        raise InputError(f"'{field}' is {in_short(entry[field])}; give a text.")
    return str(entry[field])


def _program(entry: Entry) -> tuple[str, ...] | None:
    tokens = entry.get("program")
    if tokens is None:
        return None
    if not isinstance(tokens, list) or not all(isinstance(token, str | int) for token in tokens):
        raise InputError(
            f'\'program\' is {in_short(tokens)}; a program is a list of tokens, for example ["events", "count"].'
        )
    return tuple(str(token) for token in tokens)


def _question_type(entry: Entry) -> QuestionType | None:
    kind = entry.get("question_type")
    if kind is None:
        return None
    if kind not in tuple(QuestionType):
        raise InputError(f"'question_type' is {in_short(kind)}; use one of {', '.join(QuestionType)}, or leave it out.")
    return QuestionType(kind)


def _identity(entry: Entry, field: str) -> int | str | None:
    identity = entry.get(field)
    if identity is not None and not isinstance(identity, int | str):
        raise InputError(f"'{field}' is {in_short(identity)}; give a whole number or a text.")
    return identity


def _answer(entry: Entry) -> str | None:
    answer = entry.get("answer")
    if answer is not None and not isinstance(answer, str | int | float):
        raise InputError(f"'answer' is {in_short(answer)}; give a text or a number.")
    return None if answer is None else str(answer)


def _judged(entry: Entry) -> str | None:
    judged = entry.get("answer")
    if judged is not None and not isinstance(judged, str):
        raise InputError(f"'answer' is {in_short(judged)}; judge it 'correct' or 'wrong'.")
    return judged

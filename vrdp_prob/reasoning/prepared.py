"""A question as it was stated, made ready to be answered: programs that are type-checked."""

from collections.abc import Sequence
from dataclasses import dataclass

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.language import Reading, read_choice, read_question
from vrdp_prob.reasoning.language.reader import NotUnderstoodError
from vrdp_prob.reasoning.program import ENTRIES, Program, check, needs_choices, question_type
from vrdp_prob.reasoning.values import Count, Truth
from vrdp_prob.reasoning.vocabulary import PLAIN, Vocabulary
from vrdp_prob.scene import Choice, Question, QuestionType

ChoiceInput = str | Sequence[str] | Choice


@dataclass(frozen=True)
class PreparedQuestion:
    """A question and its choices as checked programs; an open question has a program, a choice question options.

    Parameters
    ----------
    question, kind
        What is asked.
    program
        Program of an open question, else None.
    options
        Choices, each with the program that judges it.
    notes
        How wordings were read that the grammar does not know.
    """

    question: Question
    kind: QuestionType
    program: Program | None
    options: tuple[tuple[Choice, Program], ...]
    notes: tuple[str, ...] = ()


def prepare(
    question: str | Sequence[str] | Question, choices: Sequence[ChoiceInput], vocabulary: Vocabulary = PLAIN
) -> PreparedQuestion:
    """Understand a question and its choices; raises `InputError` as `answer_question` does."""
    stated = _as_question(question)
    if isinstance(choices, str) or not isinstance(choices, Sequence):
        raise InputError(f"choices is {choices!r:.80}; give a list, even of one choice.")
    reading = (
        Reading(stated.program) if stated.program is not None else read_question(stated.text, vocabulary.comparatives)
    )
    program = reading.program
    kind = stated.question_type or question_type(program)
    given = [_as_choice(number, choice) for number, choice in enumerate(choices)] or list(stated.choices)
    if not needs_choices(program, vocabulary):
        if given:
            raise InputError(f"'{stated.text}' is answered without choices; leave them out.")
        return PreparedQuestion(stated, kind, check(program, vocabulary=vocabulary), (), _how_read(reading))
    if not given:
        raise InputError(f"'{stated.text}' needs choices to judge; give at least one (--choice TEXT).")
    readings = [_read_choice(choice, kind) for choice in given]
    options = tuple(
        (choice, _judged(choice, option.program, program, vocabulary))
        for choice, option in zip(given, readings, strict=True)
    )
    return PreparedQuestion(stated, kind, None, options, _how_read(reading, *readings))


def check_answer(asked: PreparedQuestion) -> None:
    """Refuse an answer beside an open question that it cannot have, whatever the video shows.

    Raises
    ------
    InputError
        If it should be yes or no, or a number, and is not.
    """
    answer, program = asked.question.answer, asked.program
    if answer is None or program is None:
        return
    if program.gives is Truth and answer not in ("yes", "no"):
        raise InputError(f"the answer '{answer}' is none that this question can have; give 'yes' or 'no'.")
    if program.gives is Count and not (answer.isascii() and answer.isdigit()):
        raise InputError(f"the answer '{answer}' is none that this question can have; give a whole number from 0 on.")


def _how_read(*readings: Reading) -> tuple[str, ...]:
    return tuple(dict.fromkeys(reading.note for reading in readings if reading.note is not None))


def _read_choice(choice: Choice, kind: QuestionType) -> Reading:
    if choice.program is not None:
        return Reading(choice.program)
    try:
        return read_choice(choice.text, kind)
    except NotUnderstoodError as error:
        raise InputError(f"choice {error}") from error


def _judged(choice: Choice, program: Sequence[str], question_program: Sequence[str], vocabulary: Vocabulary) -> Program:
    """The program of a choice followed by that of its question."""
    try:
        check(program, ends_in=ENTRIES)
        return check((*program, *question_program), ends_in=(Truth,), vocabulary=vocabulary)
    except InputError as error:
        raise InputError(f"choice '{choice.text}': {error}") from error


def _as_question(question: str | Sequence[str] | Question) -> Question:
    if isinstance(question, Question):
        return question
    if isinstance(question, str):
        return Question(text=question)
    program = _tokens(question, "question")
    return Question(text=" ".join(program), program=program)


def _as_choice(number: int, choice: ChoiceInput) -> Choice:
    if isinstance(choice, Choice):
        return choice
    if isinstance(choice, str):
        return Choice(number, choice)
    program = _tokens(choice, "choice")
    return Choice(number, " ".join(program), program)


def _tokens(program: Sequence[str], kind: str) -> tuple[str, ...]:
    """The tokens of a program, which has to be a list of texts."""
    if not isinstance(program, Sequence) or not all(isinstance(token, str) for token in program):
        raise InputError(
            f"the {kind} is {program!r:.80}; give a text in English, or a program: a list of tokens, each a text."
        )
    return tuple(program)

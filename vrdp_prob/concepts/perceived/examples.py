"""Questions with answers as examples to learn from: descriptive and explanatory ones, as checked programs."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from vrdp_prob.concepts.perceived.vocabulary import attribute_words
from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.prepared import PreparedQuestion, check_answer, prepare
from vrdp_prob.reasoning.program import Program
from vrdp_prob.reasoning.values import Label, Word
from vrdp_prob.scene import Question, QuestionType

TAUGHT_BY = (QuestionType.DESCRIPTIVE, QuestionType.EXPLANATORY)
_JUDGEMENTS = {"correct": "yes", "wrong": "no"}
"""Answers of choices in CLEVRER's files, in the words of questions of yes or no."""


@dataclass(frozen=True)
class Example:
    """One open question, or one choice, with its right answer.

    Parameters
    ----------
    question_id
        Name of the question within its video.
    program
        What is asked.
    answer
        The right answer.
    """

    question_id: str
    program: Program
    answer: str

    @property
    def words(self) -> frozenset[str]:
        """Words of the program and of its answer."""
        return frozenset((self.answer, *(step.text for step in self.program.steps if isinstance(step, Word))))


def examples_of(questions: Mapping[str, Sequence[Question]], *, source: str) -> dict[str, tuple[Example, ...]]:
    """Examples by video, those of descriptive and explanatory questions that have an answer.

    Parameters
    ----------
    questions
        Questions by video.
    source
        Where they come from, for refusals.

    Raises
    ------
    InputError
        If a question is not understood, two answers contradict each other, or there is no example.
    """
    found = {}
    for video, several in questions.items():
        own: list[Example] = []
        for question in several:
            try:
                own += _examples(question)
            except InputError as error:
                raise InputError(f"{source}, {video}, question {question.question_id}: {error}") from error
        _check_agreement(own, f"{source}, {video}")
        found[video] = tuple(own)
    if not any(found.values()):
        raise InputError(f"{source}: no descriptive or explanatory question has its right answer beside it.")
    return {video: own for video, own in found.items() if own}


def words_of(examples: Iterable[Example]) -> frozenset[str]:
    """All words of some examples."""
    return frozenset().union(*(example.words for example in examples))


def _examples(question: Question) -> list[Example]:
    asked = prepare(question, ())
    if asked.kind not in TAUGHT_BY:
        return []
    check_answer(asked)
    _check_word(asked)
    name = str(question.question_id)
    return [Example(name, program, answer) for program, answer in _stated(asked) if answer is not None]


def _stated(asked: PreparedQuestion) -> list[tuple[Program, str | None]]:
    if asked.program is not None:
        return [(asked.program, asked.question.answer)]
    return [(program, _JUDGEMENTS.get(choice.answer or "")) for choice, program in asked.options]


def _check_word(asked: PreparedQuestion) -> None:
    """Refuse a value of an attribute that is no word of the question language."""
    answer, program = asked.question.answer, asked.program
    if program is not None and program.gives is Label and answer is not None:
        words = attribute_words()[program.tokens[-1].removeprefix("query_")]
        if answer not in words:
            raise InputError(f"the answer '{answer}' is no word that can be learned; the words are {', '.join(words)}.")


def _check_agreement(examples: Sequence[Example], place: str) -> None:
    first: dict[tuple[str, ...], Example] = {}
    for example in examples:
        before = first.setdefault(example.program.tokens, example)
        if before.answer != example.answer:
            raise InputError(
                f"{place}: questions {before.question_id} and {example.question_id} ask the same but are answered "
                f"'{before.answer}' and '{example.answer}'; correct one of them."
            )

"""A question about a video, as CLEVRER's question files state it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from vrdp_prob.errors import InputError

RIGHT, WRONG = "correct", "wrong"
"""Judgements of a choice in CLEVRER's files."""


class QuestionType(StrEnum):
    """The four kinds of questions of CLEVRER."""

    DESCRIPTIVE = "descriptive"
    EXPLANATORY = "explanatory"
    PREDICTIVE = "predictive"
    COUNTERFACTUAL = "counterfactual"


@dataclass(frozen=True)
class Choice:
    """One option of a multiple-choice question.

    Parameters
    ----------
    choice_id
        Name of the option within its question.
    text
        The option in English.
    program
        Its program in postfix order, None where only the text is known.
    answer
        The true judgement (`correct` or `wrong`) where it is known; for scoring alone.

    Raises
    ------
    InputError
        If the text is none, or the judgement is another word.
    """

    choice_id: int | str
    text: str
    program: tuple[str, ...] | None = None
    answer: str | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.text, str):
            raise InputError(f"the text of a choice is {self.text!r:.80}; give a text.")
        if self.answer not in (None, RIGHT, WRONG):
            raise InputError(f"choice '{self.text}' is judged '{self.answer}'; judge it '{RIGHT}' or '{WRONG}'.")


@dataclass(frozen=True)
class Question:
    """One question.

    Parameters
    ----------
    text
        The question in English.
    program
        Its program in postfix order, None where only the text is known.
    choices
        Options of a multiple-choice question, empty for an open question.
    question_type
        One of the four kinds, None where it has to be read off the program.
    question_id
        Name of the question within its video.
    answer
        The true answer where it is known; for scoring alone.
    labels
        Further fields of the question file, for example `question_subtype`.
    source
        The file and the video that it was read from, for messages; two questions may be equal that differ in it.

    Raises
    ------
    InputError
        If the text is none.
    """

    text: str
    program: tuple[str, ...] | None = None
    choices: tuple[Choice, ...] = ()
    question_type: QuestionType | None = None
    question_id: int | str | None = None
    answer: str | None = None
    labels: Mapping[str, str] | None = None
    source: str | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        if not isinstance(self.text, str):
            raise InputError(f"the text of a question is {self.text!r:.80}; give a text.")

    @property
    def is_answered(self) -> bool:
        """Whether its right answer is known: that of every choice where it has some."""
        if self.choices:
            return all(choice.answer is not None for choice in self.choices)
        return self.answer is not None

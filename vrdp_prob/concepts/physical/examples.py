"""Examples of a word: questions that use it, about videos with a posterior, with their right answers."""

from collections.abc import Mapping
from dataclasses import dataclass

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.change_operations import APPLY, COUNTERFACT
from vrdp_prob.reasoning.changes import Change
from vrdp_prob.reasoning.language.words import split
from vrdp_prob.reasoning.posterior_like import PosteriorLike
from vrdp_prob.reasoning.prepared import PreparedQuestion, check_answer, prepare
from vrdp_prob.reasoning.vocabulary import Vocabulary
from vrdp_prob.scene import Choice, Question
from vrdp_prob.scene.question import RIGHT, WRONG


@dataclass(frozen=True)
class Example:
    """A question that uses a word, with its answer.

    Parameters
    ----------
    posterior
        What is known of the video that it is about.
    question
        The question, with its answer or with the judgement of each of its choices.
    """

    posterior: PosteriorLike
    question: Question

    @classmethod
    def of(
        cls,
        posterior: PosteriorLike,
        question: str,
        *,
        answer: str | None = None,
        choices: Mapping[str, bool] | None = None,
    ) -> "Example":
        """An example in English.

        Parameters
        ----------
        posterior
            What is known of the video.
        question
            For example 'If the red cube were floppier, what would happen?'.
        answer
            The answer of a question without choices: `yes`, `no` or a number.
        choices
            Options and whether each of them is right.
        """
        options = tuple(
            Choice(number, text, answer=RIGHT if right else WRONG)
            for number, (text, right) in enumerate((choices or {}).items())
        )
        return cls(posterior, Question(question, choices=options, answer=answer))


def prepared(question: Question, change: Change) -> PreparedQuestion:
    """The question with a meaning for its word.

    Parameters
    ----------
    question
        A question that uses the word.
    change
        The word, with something that it may mean.

    Raises
    ------
    InputError
        If the question is not understood, does not use the word, has no right answer beside it, or one that it cannot
        have.
    """
    asked = prepare(question, (), Vocabulary({change.word: change}))
    if not uses(asked, change.word):
        raise InputError(f"'{question.text}' does not use the word '{change.word}'; give questions that do.")
    if not question.is_answered:
        raise InputError(f"'{question.text}' has no right answer beside it; give the answer, or judge every choice.")
    check_answer(asked)
    return asked


def mentions(question: Question, word: str) -> bool:
    """Whether a question, or one of its choices, has a word among its words or in its programs, understood or not."""
    parts: tuple[Question | Choice, ...] = (question, *question.choices)
    tokens = {token for part in parts for token in part.program or ()}
    spoken = {spoken for part in parts if part.program is None for spoken in split(part.text)}
    return word in spoken or bool(_tokens(word) & tokens)


def uses(asked: PreparedQuestion, word: str) -> bool:
    """Whether a question, or one of its choices, uses a word for a change."""
    programs = [program for _, program in asked.options] + ([] if asked.program is None else [asked.program])
    return any(_tokens(word) & set(program.tokens) for program in programs)


def _tokens(word: str) -> set[str]:
    """The tokens that a word makes."""
    return {f"{APPLY}{word}", f"{COUNTERFACT}{word}"}

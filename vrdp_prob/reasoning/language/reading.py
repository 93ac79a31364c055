"""English to programs: by the grammar, and by the learned parser where the grammar does not know the wording."""

from collections.abc import Mapping
from dataclasses import dataclass

from vrdp_prob.reasoning.language.choices import choice_by_grammar, choice_for
from vrdp_prob.reasoning.language.meaning import Tokens
from vrdp_prob.reasoning.language.questions import question_by_grammar
from vrdp_prob.reasoning.language.reader import NotUnderstoodError, not_understood
from vrdp_prob.reasoning.language.words import COMPARATIVES, split
from vrdp_prob.reasoning.notes import share_words
from vrdp_prob.scene import QuestionType


@dataclass(frozen=True)
class Reading:
    """What a text was read as.

    Parameters
    ----------
    program
        Tokens in postfix order.
    note
        How it was read, in a sentence, where the grammar does not know the wording.
    """

    program: Tokens
    note: str | None = None


def read_question(text: str, comparatives: Mapping[str, str] = COMPARATIVES) -> Reading:
    """Read a question in English; case and punctuation do not matter.

    Parameters
    ----------
    text
        The question.
    comparatives
        Words that say how an object would be changed, and their tokens.

    Raises
    ------
    InputError
        If it is empty or not understood; the message names the word.
    """
    try:
        return Reading(question_by_grammar(text, comparatives))
    except NotUnderstoodError as refusal:
        return _learned("question", text, refusal)


def read_choice(text: str, kind: QuestionType) -> Reading:
    """Read an option of a multiple-choice question.

    Parameters
    ----------
    text
        A statement ('The cube collides with the sphere'), an event ('the collision between ...') or, for explanatory
        questions, 'the presence of the cube'.
    kind
        Kind of its question: predictive and counterfactual options are sought among all possible collisions, others
        among the events of the video.

    Raises
    ------
    InputError
        If it is empty or not understood, or asks for an entrance or exit where only collisions are possible.
    """
    try:
        reading = Reading(choice_by_grammar(text))
    except NotUnderstoodError as refusal:
        reading = _learned("choice", text, refusal)
    return Reading(choice_for(kind, reading.program, text), reading.note)


def parse_question(text: str) -> Tokens:
    """Program of a question; see `read_question`."""
    return read_question(text).program


def parse_choice(text: str, kind: QuestionType) -> Tokens:
    """Program of an option; see `read_choice`."""
    return read_choice(text, kind).program


def _learned(kind: str, text: str, refusal: NotUnderstoodError) -> Reading:
    """What the learned parser reads.

    Where it does not, the grammar's refusal, or one that names the unknown word or the negation that nothing is said
    with.
    """
    from vrdp_prob.reasoning.language.learned.parser import learned_parser  # noqa: PLC0415 - loaded only when needed

    parser, words = learned_parser(), split(text)
    place = parser.unreadable(words)
    if place is not None:
        raise not_understood(text, place) from refusal
    reading = parser.read(kind, words)
    if reading is None:
        raise refusal
    return Reading(
        reading.program,
        f"“{text}” is a wording that the grammar does not know; the learned parser read it as “{reading.wording}” "
        f"(probability {share_words(reading.probability)}).",
    )

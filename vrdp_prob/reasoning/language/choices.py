"""Rules for the options of a multiple-choice question."""

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.language.phrases import Tokens, the_event, the_object
from vrdp_prob.reasoning.language.reader import Reader
from vrdp_prob.scene import QuestionType

_AMONG_ALL = (QuestionType.PREDICTIVE, QuestionType.COUNTERFACTUAL)
"""Kinds of questions whose options are sought among all possible collisions, not among the events of the video."""


def choice_by_grammar(text: str) -> Tokens:
    """Program of one option among the events of the video.

    Parameters
    ----------
    text
        A statement ('The cube collides with the sphere'), an event ('the collision between ...') or 'the presence of
        the cube'.

    Raises
    ------
    InputError
        If it is empty.
    NotUnderstoodError
        If it is not understood; the message names the word.
    """
    reader = Reader(text, "choice")
    return reader.whole(lambda: _presence(reader), lambda: the_event(reader))


def choice_for(kind: QuestionType, program: Tokens, text: str) -> Tokens:
    """The same option where a question of its kind seeks it.

    Parameters
    ----------
    kind
        Kind of the question.
    program
        Program of the option among the events of the video.
    text
        The option, for messages.

    Raises
    ------
    InputError
        If it is an object, an entrance or an exit where only collisions are possible.
    """
    if kind not in _AMONG_ALL:
        return program
    if "filter_collision" not in program:
        raise InputError(f"choice '{text}': {kind} questions are about collisions; name the two objects that collide.")
    return tuple("all_events" if token == "events" else token for token in program)


def _presence(reader: Reader) -> Tokens:
    reader.accept("the presence of", "the existence of")
    return the_object(reader)

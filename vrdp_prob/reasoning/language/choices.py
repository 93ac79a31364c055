"""Rules for the options of a multiple-choice question."""

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.language.phrases import Tokens, the_event, the_object
from vrdp_prob.reasoning.language.reader import Reader
from vrdp_prob.scene import QuestionType

_SOURCES = {QuestionType.PREDICTIVE: "all_events", QuestionType.COUNTERFACTUAL: "all_events"}


def parse_choice(text: str, kind: QuestionType) -> Tokens:
    """Program of one option.

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
    reader = Reader(text, "choice")
    source = _SOURCES.get(kind, "events")
    program = reader.whole(lambda: _presence(reader), lambda: the_event(reader, source))
    if source == "all_events" and "filter_collision" not in program:
        raise InputError(f"choice '{text}': {kind} questions are about collisions; name the two objects that collide.")
    return program


def _presence(reader: Reader) -> Tokens:
    reader.accept("the presence of", "the existence of")
    return the_object(reader)

"""Which of the player's worlds a question is about, so that the page can lead from the question to it."""

from collections.abc import Sequence

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.answer import Answer
from vrdp_prob.reasoning.change_operations import APPLY, COUNTERFACT
from vrdp_prob.reasoning.language import read_question
from vrdp_prob.reasoning.tokens import meaningful
from vrdp_prob.reasoning.vocabulary import PLAIN, Vocabulary
from vrdp_prob.report.content import FACTUAL, FUTURE, REMOVED
from vrdp_prob.scene import Body, QuestionType

_FILTERS = {"filter_color": "color", "filter_material": "material", "filter_shape": "shape"}


def world_of(answer: Answer, bodies: Sequence[Body], vocabulary: Vocabulary = PLAIN) -> str | None:
    """Key of the world that a question is about, None where it cannot be told from its words."""
    if answer.question_type in (QuestionType.DESCRIPTIVE, QuestionType.EXPLANATORY):
        return FACTUAL
    if answer.question_type is QuestionType.PREDICTIVE:
        return FUTURE
    try:
        program = meaningful(read_question(answer.question, vocabulary.comparatives).program)
    except InputError:
        program = meaningful(tuple(answer.question.split()))
    return _changed_world(program, bodies)


def _changed_world(program: Sequence[str], bodies: Sequence[Body]) -> str | None:
    changes = {place: kind for place, token in enumerate(program) if (kind := _change(token)) is not None}
    if not changes:
        return None
    place, kind = next(iter(changes.items()))
    start = max((index for index, token in enumerate(program[:place]) if token == "objects"), default=place)
    wanted = {
        _FILTERS[token]: word
        for word, token in zip(program[start:place], program[start + 1 : place], strict=False)
        if token in _FILTERS
    }
    fitting = [body for body in bodies if all(getattr(body, name) == word for name, word in wanted.items())]
    return f"{kind}:{fitting[0].id}" if len(fitting) == 1 else None


def _change(token: str) -> str | None:
    """The word for what a token does to an object; None for a token that changes none."""
    if token == "get_counterfact":
        return REMOVED
    return next((token.removeprefix(prefix) for prefix in (APPLY, COUNTERFACT) if token.startswith(prefix)), None)

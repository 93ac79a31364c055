"""Which of the player's worlds a question is about, so that the page can lead from the question to it."""

from collections.abc import Sequence

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.answer import Answer
from vrdp_prob.reasoning.language import parse_question
from vrdp_prob.reasoning.tokens import meaningful
from vrdp_prob.report.content import WorldKind
from vrdp_prob.scene import Body, QuestionType

_CHANGES = {
    "get_counterfact": WorldKind.REMOVED,
    "counterfact_heavier": WorldKind.HEAVIER,
    "counterfact_lighter": WorldKind.LIGHTER,
    "apply_heavier": WorldKind.HEAVIER,
    "apply_lighter": WorldKind.LIGHTER,
}

_FILTERS = {"filter_color": "color", "filter_material": "material", "filter_shape": "shape"}


def world_of(answer: Answer, bodies: Sequence[Body]) -> str | None:
    """Key of the world that a question is about, None where it cannot be told from its words."""
    if answer.question_type in (QuestionType.DESCRIPTIVE, QuestionType.EXPLANATORY):
        return str(WorldKind.FACTUAL)
    if answer.question_type is QuestionType.PREDICTIVE:
        return str(WorldKind.FUTURE)
    try:
        program = meaningful(parse_question(answer.question))
    except InputError:
        program = meaningful(tuple(answer.question.split()))
    return _changed_world(program, bodies)


def _changed_world(program: Sequence[str], bodies: Sequence[Body]) -> str | None:
    place = next((place for place, token in enumerate(program) if token in _CHANGES), None)
    if place is None:
        return None
    start = max((index for index, token in enumerate(program[:place]) if token == "objects"), default=place)
    wanted = {
        _FILTERS[token]: word
        for word, token in zip(program[start:place], program[start + 1 : place], strict=False)
        if token in _FILTERS
    }
    fitting = [body for body in bodies if all(getattr(body, name) == word for name, word in wanted.items())]
    return f"{_CHANGES[program[place]]}:{fitting[0].id}" if len(fitting) == 1 else None

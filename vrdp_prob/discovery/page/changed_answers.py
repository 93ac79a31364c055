"""How the answers of the extended model differ from those of the model that was given, in words and rows."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from vrdp_prob.discovery.finding import ComparedAnswer
from vrdp_prob.discovery.page.wording import chance
from vrdp_prob.plain_words import counted, number_word, sentence

TELLING = 0.1
"""Change of a probability from which an answer is told of, though it stays."""
LEADING = 8
"""Changed answers that the page shows at once."""


def changed(answers: Sequence[ComparedAnswer]) -> list[ComparedAnswer]:
    """Answers worth telling: those that differ first, then those with other probabilities, the largest change first."""
    told = [answer for answer in answers if answer.differs or answer.change >= TELLING]
    return sorted(told, key=lambda answer: (not answer.differs, -answer.change))


def answers_sentence(answers: Sequence[ComparedAnswer]) -> str:
    """How many answers differ, and how many are right with each model where that is known."""
    if not answers:
        return "no question about these videos could be answered with both models"
    differing = sum(answer.differs for answer in answers)
    many = f"{number_word(differing)} {'is' if differing == 1 else 'are'}" if differing else "none is"
    said = (
        f"of {counted(len(answers), 'question')} about these videos, {many} answered otherwise with the extended model"
    )
    judged = [answer.right for answer in answers if answer.right is not None]
    if not judged:
        return said
    before, after = (sum(right[place] for right in judged) for place in (0, 1))
    return f"{said}; {after} of {len(judged)} answers are right with it, {before} without"


def rows(answers: Sequence[ComparedAnswer]) -> dict[str, Any]:
    """The table of changed answers; what comes after the first few is folded away."""
    told = [_row(answer) for answer in changed(answers)]
    leading, others = told[:LEADING], told[LEADING:]
    return {
        "leading": leading,
        "others": others,
        "others_words": sentence(counted(len(others), "more question")),
        "sentence": f"{sentence(answers_sentence(answers))}.",
    }


def _row(answer: ComparedAnswer) -> dict[str, Any]:
    return {
        "video": answer.video,
        "question": answer.question,
        "options": [
            {**asdict(option), "before": chance(option.before), "after": chance(option.after)}
            for option in answer.options
        ],
    }

"""From a question to the world that it is about."""

import pytest
from example_content import BODIES

from tests.concepts.physical.words import UNSURE
from vrdp_prob.reasoning.answer import Answer
from vrdp_prob.reasoning.vocabulary import Vocabulary
from vrdp_prob.report.asked import world_of
from vrdp_prob.scene import QuestionType


@pytest.mark.parametrize(
    ("kind", "question", "world"),
    [
        ("descriptive", "How many collisions happen?", "factual"),
        ("explanatory", "What is responsible for the collision?", "factual"),
        ("predictive", "Which of the following will happen next?", "future"),
        ("counterfactual", "Which of the following will happen without the purple object?", "removed:1"),
        ("counterfactual", "What would not happen if the cyan rubber object were lighter?", "lighter:3"),
        ("counterfactual", "Which of the following would happen if the cylinder were much heavier?", "heavier:2"),
        (
            "counterfactual",
            "all_events objects cube filter_shape cyan filter_color unique get_counterfact",
            "removed:0",
        ),
        ("counterfactual", "all_events objects yellow filter_color unique apply_lighter get_counterfact", "lighter:4"),
        ("counterfactual", "Which of the following will happen without the cyan object?", None),
        ("counterfactual", "What if?", None),
    ],
)
def test_world_of_a_question(kind, question, world):
    answer = Answer(0, question, QuestionType(kind), "yes", 1.0, 0.0, 0.0, {"yes": 1.0})
    assert world_of(answer, BODIES) == world


def test_world_of_a_question_with_a_learned_word() -> None:
    vocabulary = Vocabulary.of([UNSURE])
    for question in (
        "If the cylinder were floppier, what would happen?",
        "all_events objects cylinder filter_shape unique apply_floppier counterfact_floppier",
    ):
        answer = Answer(0, question, QuestionType.COUNTERFACTUAL, "yes", 1.0, 0.0, 0.0, {"yes": 1.0})
        assert world_of(answer, BODIES, vocabulary) == "floppier:2"

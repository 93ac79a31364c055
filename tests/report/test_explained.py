"""Explanations in the report: in words on the page, in numbers in report.json."""

from dataclasses import replace

import jsonschema
import pytest
from test_page import Outline

from vrdp_prob.reasoning.explanation.explanation import Explanation, Part, Shares
from vrdp_prob.reasoning.explanation.observations import Observation
from vrdp_prob.report import render
from vrdp_prob.report.content import AnswerContent
from vrdp_prob.report.document import schema, to_document

OBSERVATION = Observation("looking up the color of object 0", 0.1, 0.02, 0.6)
PART = Part(1, "A and B collide", "yes", 0.4, 0.6, (), Shares(0.7, 0.0, 0.0, 0.2, 0.1, 0.03), (OBSERVATION,))
EXPLANATION = Explanation("What will happen next?", (PART,))


@pytest.fixture(scope="module")
def explained(content):
    first, *others = content.answers
    return replace(content, answers=(replace(first, explanation=EXPLANATION), *others))


def test_the_page_says_why_with_the_names_of_the_objects(explained, content):
    text = Outline(render(explained)).text
    assert "Why it is uncertain, and what would settle it" in text
    assert "70 % comes from masses, restitutions, friction" in text
    assert "Looking up the color of the cyan cube would lower the answer's entropy from 0.60 to 0.10 nats" in text
    assert "Why it is uncertain" not in Outline(render(content)).text


def test_the_document_holds_the_numbers(explained):
    document = to_document(explained)
    jsonschema.validate(document, schema("report"))
    first, *others = document["answers"]
    assert first["explanation"]["parts"][0]["shares"]["chaos"] == 0.1
    assert first["explanation"]["parts"][0]["observations"][0]["entropy"] == 0.1
    assert first["explanation"]["sentences"] == list(EXPLANATION.sentences)
    assert all(other["explanation"] is None for other in others)


def test_an_answer_is_explained_where_it_is_uncertain(content):
    asked = content.answers[0].answer
    assert AnswerContent.of(replace(asked, explainer=lambda: EXPLANATION), None).explanation is EXPLANATION
    certain = Explanation("?", (), "The answer is certain.")
    assert AnswerContent.of(replace(asked, explainer=lambda: certain), None).explanation is None
    assert AnswerContent.of(asked, None).explanation is None

"""Answers beside the truth, from events written by hand."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.concepts.physical.words import UNSURE
from vrdp_prob.evaluation.judgement import Judgement, Kind, judge, kind_of
from vrdp_prob.reasoning.events import EventTable, EventUniverse
from vrdp_prob.reasoning.facts import Motion, TableFacts
from vrdp_prob.scene import Body, Choice, Question, Shape

BODIES = (
    Body("0", Shape.CUBE, radius=0.2, material="metal", color="red"),
    Body("1", Shape.SPHERE, radius=0.2, material="rubber", color="blue"),
    Body("2", Shape.CYLINDER, radius=0.2, material="metal", color="green"),
)
HOW_MANY = ("events", "objects", "filter_collision", "count")


def facts(share: float, draws: int = 100) -> TableFacts:
    """The red cube meets the sphere in all draws and the cylinder in some of them."""
    universe = EventUniverse(tuple(body.id for body in BODIES))
    table = EventTable.empty(universe, draws)
    for other, part in ((1, 1.0), (2, share)):
        place = universe.collision(0, other)
        table.happens[: round(part * draws), place] = True
        table.time[: round(part * draws), place] = float(other)
    still = np.zeros((draws, 1, len(BODIES)), dtype=bool)
    return TableFacts(BODIES, table, Motion(np.zeros(1), still, still), future=table)


def next_question(*answers: str) -> Question:
    pairs = ("The red cube and the sphere collide", "The red cube and the cylinder collide")
    choices = tuple(
        Choice(number, text, answer=answer) for number, (text, answer) in enumerate(zip(pairs, answers, strict=True))
    )
    return Question("What will happen next?", choices=choices, question_id=3)


def test_an_open_answer() -> None:
    question = Question(
        "How many?", program=("events", "objects", "filter_collision", "count"), answer="2", question_id=1
    )
    judged = judge("v", facts(0.7), question)
    assert judged.right
    assert (judged.answer, judged.truth, judged.kind) == ("2", "2", Kind.DESCRIPTIVE)
    assert judged.confidence == judged.probability == pytest.approx(0.7)
    assert judged.squared_error == pytest.approx(0.3**2)
    wrong = judge("v", facts(0.4), question)
    assert not wrong.right
    assert (wrong.confidence, wrong.probability) == pytest.approx((0.6, 0.4))


def test_choices() -> None:
    judged = judge("v", facts(0.7), next_question("correct", "wrong"))
    assert judged.kind is Kind.PREDICTIVE
    assert judged.choices == ((1.0, True), (pytest.approx(0.7), False))
    assert judged.texts == (
        ("0", "The red cube and the sphere collide"),
        ("1", "The red cube and the cylinder collide"),
    )
    assert not judged.right
    assert (judged.answer, judged.truth) == ("0,1", "0")
    assert (judged.confidence, judged.probability) == pytest.approx((0.7, 0.3))
    assert judge("v", facts(0.2), next_question("correct", "wrong")).right


def test_what_is_refused_is_wrong() -> None:
    question = Question("What is the color of the red sphere?", answer="red", question_id=1)
    judged = judge("v", facts(0.5), question)
    assert not judged.right
    assert judged.refused is not None
    assert "red sphere" in judged.refused
    assert judged.probability == 0


def test_kinds_of_what_if() -> None:
    choice = (Choice(0, "The red cube and the cylinder collide", answer="wrong"),)
    removed = Question("What will happen without the sphere?", choices=choice)
    assert kind_of(removed) is Kind.REMOVAL
    heavier = replace(removed, text="If the sphere were heavier, what would happen?")
    assert kind_of(heavier) is Kind.MASS
    floppier = replace(removed, text="If the sphere were floppier, what would happen?")
    assert kind_of(floppier, [UNSURE]) is Kind.WORD


def test_a_judgement_survives_json() -> None:
    judged = judge("v", facts(0.7), next_question("correct", "wrong"))
    document = json.loads(json.dumps(judged.to_document()))
    assert Judgement.of_document(document) == judged
    del document["texts"]  # as an earlier version wrote it
    assert Judgement.of_document(document) == replace(judged, texts=())

"""Answers of two models side by side."""

from dataclasses import replace

import numpy as np
import pytest

from tests.discovery.findings import named, nothing
from vrdp_prob.evaluation.compared_answers import NOT_ASKED, compared, with_answers
from vrdp_prob.inference import default_model
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt
from vrdp_prob.reasoning import Answer, ChoiceAnswer
from vrdp_prob.scene import Body, Choice, Question, QuestionType, Shape, Tracks

OPEN = Question("How many collisions happen?", question_id=0, answer="3")
CHOICES = Question(
    "What will happen next?",
    question_id=1,
    choices=(Choice(0, "The cube and the sphere collide", answer="correct"), Choice(1, "The discs collide")),
)


def value(answer: int, shares: dict[str, float]) -> Answer:
    return Answer(0, OPEN.text, QuestionType.DESCRIPTIVE, answer, max(shares.values()), 0.0, 0.1, shares)


def choice(chosen: tuple[int, ...], shares: tuple[float, float]) -> Answer:
    choices = tuple(
        ChoiceAnswer(one.choice_id, one.text, share, 0.0) for one, share in zip(CHOICES.choices, shares, strict=True)
    )
    return Answer(1, CHOICES.text, QuestionType.PREDICTIVE, chosen, 0.5, 0.0, 0.1, {}, choices)


def test_values_of_an_open_question() -> None:
    found = compared("v", OPEN, value(1, {"1": 0.7, "2": 0.3}), value(2, {"1": 0.2, "2": 0.8}))
    assert [(one.words, one.before, one.after, one.right) for one in found.options] == [
        ("2", 0.3, 0.8, False),
        ("1", 0.7, 0.2, False),
        ("3", 0.0, 0.0, True),
    ]
    assert found.differs
    assert found.change == pytest.approx(0.5)
    assert found.right == (False, False)


def test_choices_and_what_is_known_of_them() -> None:
    found = compared("v", CHOICES, choice((), (0.4, 0.1)), choice((0,), (0.8, 0.1)))
    assert [(one.chosen_before, one.chosen_after, one.right) for one in found.options] == [
        (False, True, True),
        (False, False, None),
    ]
    assert found.differs
    assert found.right is None
    judged = replace(CHOICES, choices=(CHOICES.choices[0], replace(CHOICES.choices[1], answer="wrong")))
    assert compared("v", judged, choice((), (0.4, 0.1)), choice((0,), (0.8, 0.1))).right == (False, True)


def sliding(video: str) -> Tracks:
    """A disc that slides past another one which rests, with noise of 2 mm."""
    times = np.arange(30) / 25
    positions = np.zeros((30, 2, 2))
    positions[:, 0, 0], positions[:, 0, 1], positions[:, 1, 0] = 1.2 * times - 1.0, 1.0, 0.5
    positions += np.random.default_rng(1).normal(0.0, 0.002, positions.shape)
    bodies = (
        Body("1", Shape.CYLINDER, radius=0.2, material="metal", color="red"),
        Body("2", Shape.SPHERE, radius=0.2, material="rubber", color="blue"),
    )
    return Tracks.from_arrays(video, bodies, times, positions)


def test_both_models_are_asked_about_the_videos_with_questions() -> None:
    base = default_model()
    finding = replace(named(), model=base, extended=base.with_effect(SurfaceTilt()), videos=("a", "b"), notes=())
    moving = Question("How many objects are moving at the beginning of the video?", question_id=0, answer="1")
    impossible = Question("What color is the cube?", question_id=1)
    told = with_answers(finding, [sliding("a"), sliding("b")], {"b": [moving, impossible]}, processes=1)
    assert told.answers is not None
    (answer,) = told.answers
    assert (answer.video, answer.question) == ("b", moving.text)
    assert (answer.differs, answer.right) == (False, (True, True))
    (note,) = told.notes
    assert note.startswith("Not answered, and left out: b, 'What color is the cube?': ")


def test_nothing_is_asked_where_nothing_is_named() -> None:
    finding = nothing()
    told = with_answers(finding, [sliding("a")], {"a": [OPEN]})
    assert told == replace(finding, notes=(*finding.notes, NOT_ASKED))
    assert with_answers(finding, [sliding("a")], {"a": []}) is finding

"""Questions that no posterior could answer are refused before there is one; doubtful ones are not."""

from pathlib import Path

import numpy as np
import pytest

from vrdp_prob import InputError, report
from vrdp_prob.reasoning.checking import check_question
from vrdp_prob.scene import Body, Question, Shape, Tracks

UNSURE = {"material": {"metal": 0.4, "rubber": 0.6}}
BODIES = (
    Body("1", Shape.SPHERE, 0.2, color="red", material="metal"),
    Body("2", Shape.SPHERE, 0.2, color="blue", attribute_probabilities=UNSURE),
)


@pytest.fixture
def tracks() -> Tracks:
    """Two spheres that rest far apart, one of them of metal or rubber."""
    positions = np.tile(np.array([[0.0, 0.0], [2.0, 0.0]]), (5, 1, 1))
    return Tracks.from_arrays("v", BODIES, np.arange(5) / 25, positions)


@pytest.mark.parametrize(
    "question",
    [
        "What color is the rubber sphere?",
        "What color is the metal sphere?",
        "What is the shape of the last object that collides with the red sphere?",
        ["events", "objects", "filter_collision", "count"],
    ],
)
def test_what_some_draw_could_answer_is_let_through(tracks: Tracks, question: str | list[str]) -> None:
    check_question(question, tracks=tracks)


@pytest.mark.parametrize(
    ("question", "message"),
    [
        ("What color is the cube?", "there is no cube in the video"),
        ("What material is the sphere made of?", "two objects fit 'the sphere'"),
        ("What is the shape of the last object that collides with the green sphere?", "there is no green sphere"),
    ],
)
def test_what_no_draw_could_answer_is_refused(tracks: Tracks, question: str, message: str) -> None:
    check_question(question)
    with pytest.raises(InputError, match=message):
        check_question(question, tracks=tracks)


def test_objects_of_choices_are_looked_up(tracks: Tracks) -> None:
    with pytest.raises(InputError, match="there is no cube"):
        check_question("What will happen next?", choices=["The cube and the red sphere collide"], tracks=tracks)


def test_a_report_refuses_before_it_infers(tracks: Tracks, tmp_path: Path) -> None:
    asked = [Question("How many collisions happen?"), Question("What color is the cube?")]
    with pytest.raises(InputError, match="question 2: there is no cube"):
        report(tracks, questions=asked, directory=tmp_path)
    with pytest.raises(InputError, match="there is no such video file"):
        report(tracks, video_file=tmp_path / "none.mp4", directory=tmp_path)
    assert list(tmp_path.iterdir()) == []

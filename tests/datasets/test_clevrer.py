"""CLEVRER files: annotations and questions."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vrdp_prob.datasets import load, read_annotation, read_questions, video_names
from vrdp_prob.errors import InputError
from vrdp_prob.scene import QuestionType, Shape


def annotation() -> dict[str, Any]:
    """Two objects, one of which comes into view in the third of four frames."""

    def entry(number: int, frame: int) -> dict[str, Any]:
        return {
            "object_id": number,
            "location": [number + 0.1 * frame, 2.0, 0.2],
            "orientation": [0.0, 0.0, 3.1 + 0.1 * frame if frame < 1 else -3.18 + 0.1 * frame],
            "velocity": [9.0, 9.0, 9.0],
            "angular_velocity": [0.0, 0.0, 0.0],
            "inside_camera_view": number == 0 or frame >= 2,
        }

    return {
        "scene_index": 0,
        "video_filename": "video_00000.mp4",
        "object_property": [
            {"object_id": 0, "color": "red", "material": "metal", "shape": "cube"},
            {"object_id": 1, "color": "blue", "material": "rubber", "shape": "sphere"},
        ],
        "motion_trajectory": [{"frame_id": frame, "objects": [entry(0, frame), entry(1, frame)]} for frame in range(4)],
        "collision": [],
    }


def test_only_what_is_in_view_is_measured(tmp_path: Path) -> None:
    path = tmp_path / "annotation_00000.json"
    path.write_text(json.dumps(annotation()))
    tracks = load(path)
    assert tracks.video == "video_00000"
    assert [body.shape for body in tracks.bodies] == [Shape.CUBE, Shape.SPHERE]
    np.testing.assert_array_equal(tracks.seen, [[1, 0], [1, 0], [1, 1], [1, 1]])
    np.testing.assert_allclose(tracks.times, np.arange(4) / 25)
    assert tracks.angles is not None
    assert np.all(np.abs(np.diff(tracks.angles[:, 0])) < 1), "the yaw of a cube is unwrapped"
    assert np.isnan(tracks.angles[:, 1]).all(), "the yaw of a rolling sphere says nothing"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda document: document.pop("motion_trajectory"), "not a CLEVRER annotation"),
        (lambda document: document["object_property"][0].update(shape="cone"), "object 0 has the unknown shape 'cone'"),
        # types are checked under test, before the body says which field it is
        (lambda document: document["object_property"][0].update(color=3), "its color is 3|a field is of another form"),
        (lambda document: document["object_property"][1].update(object_id=0), "the object_id 0 is there twice"),
        (lambda document: document.update(object_property=[], motion_trajectory=[]), "there are 0 objects"),
    ],
)
def test_annotation_mistakes(tmp_path: Path, change: Any, message: str) -> None:
    document = annotation()
    change(document)
    path = tmp_path / "annotation.json"
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match=message):
        read_annotation(path)


def test_a_truncated_annotation(tmp_path: Path) -> None:
    path = tmp_path / "annotation.json"
    path.write_text(json.dumps(annotation())[:100])
    with pytest.raises(InputError, match="not a JSON file"):
        read_annotation(path)


def test_questions_are_found_by_the_stem_of_their_video(tmp_path: Path) -> None:
    path = tmp_path / "questions.json"
    choice = {"choice_id": 3, "choice": "The cube and the sphere collide", "program": ["all_events"], "answer": "wrong"}
    entry = {
        "question_id": 8,
        "question": "What will happen next?",
        "question_type": "predictive",
        "program": ["unseen_events", "belong_to"],
        "choices": [choice],
    }
    path.write_text(json.dumps([{"scene_index": 0, "video_filename": "video_00007.mp4", "questions": [entry]}]))
    (question,) = read_questions(path)["video_00007"]
    assert question.question_type is QuestionType.PREDICTIVE
    assert question.program == ("unseen_events", "belong_to")
    assert (question.choices[0].choice_id, question.choices[0].answer) == (3, "wrong")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not a JSON file"),
        ("[]", "holds no question"),
        ('[{"video_filename": "a.mp4", "questions": []}]', "holds no question"),
        ('[{"questions": []}]', "scene 1 has no 'video_filename'"),
        ('[{"video_filename": 5, "questions": []}]', "scene 1 has 5 for 'video_filename'"),
        ('[{"video_filename": "a.mp4"}]', "scene 1 has no 'questions'"),
        ('[{"video_filename": "a.mp4", "questions": null}]', "scene 1 has null for 'questions'"),
        ('[{"video_filename": "a.mp4", "questions": 5}]', "scene 1 has 5 for 'questions'"),
        ('[{"video_filename": "a.mp4", "questions": {"a": 1}}]', "scene 1 has {\"a\": 1} for 'questions'"),
        ("5", "scene 1 is 5"),
        ('[{"video_filename": "a.mp4", "questions": [{"question_id": 4}]}]', "a, question 4: there is no 'question'"),
        ('[{"video_filename": "a.mp4", "questions": ["why?"]}]', r"question \?: \"why\?\" is no question"),
    ],
)
def test_question_file_mistakes(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "questions.json"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_questions(path)


def question_file(path: Path, *entries: dict[str, Any]) -> Path:
    """A question file about one video; every entry has a text and a name unless it says otherwise."""
    questions = [{"question": "Why?", "question_id": 4 + place} | entry for place, entry in enumerate(entries)]
    path.write_text(json.dumps([{"video_filename": "a.mp4", "questions": questions}]))
    return path


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ({"question": None}, "'question' is null; give a text"),
        ({"question": 7}, "'question' is 7; give a text"),
        ({"question_type": "foo"}, 'is "foo"; use one of descriptive, explanatory, predictive, counterfactual'),
        ({"question_type": ["descriptive"]}, "'question_type' is .*; use one of descriptive"),
        ({"question_id": [1]}, "'question_id' is .*; give a whole number or a text"),
        ({"question_subtype": 3}, "'question_subtype' is 3; give a text"),
        ({"answer": {"a": 1}}, "'answer' is .*; give a text or a number"),
        ({"program": "objects count"}, "'program' is \"objects count\"; a program is a list of tokens"),
        ({"program": [["objects"], "count"]}, "a program is a list of tokens"),
        ({"choices": "abc"}, "'choices' is \"abc\"; give a list"),
        ({"choices": ["abc"]}, "entry 1 of 'choices' is \"abc\"; each needs at least 'choice'"),
        ({"choices": [{"choice": "a"}, {"choice": 5}]}, "entry 2 of 'choices': 'choice' is 5; give a text"),
        ({"choices": [{"choice_id": 0}]}, "entry 1 of 'choices': there is no 'choice'"),
        ({"choices": [{"choice": "a", "answer": "maybe"}]}, "is judged 'maybe'; judge it 'correct' or 'wrong'"),
        ({"choices": [{"choice": "a", "answer": True}]}, "'answer' is true; judge it 'correct' or 'wrong'"),
        (
            {"choices": [{"choice": "a", "choice_id": "1"}, {"choice": "b", "choice_id": 1}]},
            "choice_id 1 is there twice",
        ),
    ],
)
def test_mistakes_in_a_question_are_told_by_its_field(tmp_path: Path, entry: dict[str, Any], message: str) -> None:
    path = question_file(tmp_path / "questions.json", entry)
    with pytest.raises(InputError, match=rf"questions.json, a, question .*: .*{message}"):
        read_questions(path)


def test_questions_of_a_scene_are_named_apart(tmp_path: Path) -> None:
    twice = question_file(tmp_path / "questions.json", {"question_id": 3}, {"question_id": "3"})
    with pytest.raises(InputError, match=r"questions.json, a: the question_id 3 is there twice; name them apart"):
        read_questions(twice)
    nameless = question_file(tmp_path / "questions.json", {"question_id": None}, {"question_id": None})
    assert [question.question_id for question in read_questions(nameless)["a"]] == [None, None]


def test_a_question_knows_its_file_but_is_what_it_asks(tmp_path: Path) -> None:
    first, second = (question_file(tmp_path / name, {}) for name in ("a.json", "b.json"))
    (one,), (other,) = (read_questions(path)["a"] for path in (first, second))
    assert (one.source, other.source) == (f"{first}, a", f"{second}, a")
    assert (one, repr(one)) == (other, repr(other))


def test_a_file_that_is_no_text(tmp_path: Path) -> None:
    path = tmp_path / "questions.json"
    path.write_bytes(b"\x80\x00\xff")
    with pytest.raises(InputError, match=r"not a JSON file \(it is not text\)"):
        read_questions(path)


def test_annotations_and_tracks_of_the_practice_set_agree(shared_data: Path) -> None:
    folder = shared_data / "clevrer_bullet"
    exact = load(folder / "annotations" / "annotation_00000.json")
    noisy = load(folder, video="video_00000")
    assert exact.bodies == noisy.bodies
    assert exact.camera is not None
    difference = (exact.positions - noisy.positions)[noisy.seen]
    assert abs(difference.std() - 0.01) < 0.001, "the noise that the data set states"


def test_a_folder_of_annotations_is_read_as_its_videos(shared_data: Path) -> None:
    folder = shared_data / "clevrer_bullet" / "annotations"
    assert len(video_names(folder)) == 60
    assert load(folder, video="video_00007").video == "video_00007"
    with pytest.raises(InputError, match="there is no video 'video_9'"):
        load(folder, video="video_9")


def test_choices_without_an_id_take_one_that_is_free(tmp_path: Path) -> None:
    choices = [{"choice": "a", "choice_id": None}, {"choice": "b", "choice_id": 0}, {"choice": "c"}]
    scene = {"video_filename": "v.mp4", "questions": [{"question": "q", "choices": choices, "question_subtype": None}]}
    file = tmp_path / "questions.json"
    file.write_text(json.dumps([scene]))
    (question,) = read_questions(file)["v"]
    assert [choice.choice_id for choice in question.choices] == [1, 0, 2]
    assert question.labels is None

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
        ('[{"questions": []}]', "needs 'video_filename' and 'questions'"),
        ('[{"video_filename": "a.mp4", "questions": [{"question_id": 4}]}]', "question 4: KeyError 'question'"),
        ('[{"video_filename": "a.mp4", "questions": ["why?"]}]', r"question \?: "),
    ],
)
def test_question_file_mistakes(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "questions.json"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
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

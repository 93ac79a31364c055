"""Concepts as a user learns and uses them."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from command_line import refused

from vrdp_prob import cli
from vrdp_prob.concepts.perceived.from_files import facts, films
from vrdp_prob.concepts.perceived.storage import read_concepts
from vrdp_prob.inference.runs.checkpoint import Checkpoint

COUNT = {"question_id": 0, "question": "How many collisions happen?", "answer": "1"}


def questions(folder: Path, *asked: dict[str, object], video: str = "clip.mp4") -> Path:
    file = folder / "questions.json"
    file.write_text(json.dumps([{"scene_index": 3, "video_filename": video, "questions": list(asked)}]))
    return file


def test_a_file_that_holds_no_concepts(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "x.concepts").write_bytes(b"something else")
    ask = ["ask", folder, "How many collisions happen?", "--concepts"]
    assert "no such file; learn concepts first" in refused(capsys, *ask, tmp_path / "nowhere")
    assert "holds no learned concepts" in refused(capsys, *ask, tmp_path / "x.concepts")
    report = ["report", folder, "--out", tmp_path / "out", "--concepts", tmp_path / "x.concepts"]
    assert "holds no learned concepts" in refused(capsys, *report)
    assert not (tmp_path / "out").exists()
    evaluate = ["evaluate", folder, "--questions", questions(tmp_path, COUNT, video="v.mp4"), "--out", tmp_path / "out"]
    assert "holds no learned concepts" in refused(capsys, *evaluate, "--concepts", tmp_path / "x.concepts")


def test_questions_without_their_video(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    learn = ["learn-concepts", tmp_path / "videos", "--out", tmp_path / "x.concepts", "--questions"]
    assert "there is no such folder" in refused(capsys, *learn, questions(tmp_path, COUNT))
    (tmp_path / "videos").mkdir()
    line = refused(capsys, *learn, questions(tmp_path, COUNT))
    assert "there is no video clip, which" in line
    assert "leave its scene out" in line
    assert "no scene from 7 to 8 is in the file" in refused(
        capsys, *learn, questions(tmp_path, COUNT), "--scenes", "7:9"
    )
    assert not (tmp_path / "x.concepts").exists()


def test_answers_that_cannot_teach(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "clip.mp4").write_bytes(b"")
    learn = ["learn-concepts", tmp_path, "--out", tmp_path / "x.concepts", "--questions"]
    other = COUNT | {"question_id": 1, "answer": "2"}
    assert "ask the same but are answered '1' and '2'" in refused(capsys, *learn, questions(tmp_path, COUNT, other))
    unanswered = {"question_id": 0, "question": "How many collisions happen?"}
    assert "no descriptive or explanatory question" in refused(capsys, *learn, questions(tmp_path, unanswered))
    assert "no camera" in refused(capsys, *learn, questions(tmp_path, COUNT))


def test_what_is_wrong_is_told_before_any_video_is_looked_at(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The video is no video, so that looking at it would be refused."""
    (tmp_path / "clip.mp4").write_bytes(b"")
    learn = ["learn-concepts", tmp_path, "--camera", "clevrer", "--out", tmp_path / "x.concepts", "--questions"]
    assert "no question has a word for a color" in refused(capsys, *learn, questions(tmp_path, COUNT))
    words = COUNT | {"question": "How many red metal cubes are there?"}
    asked = questions(tmp_path, words)
    assert "device 'abacus': torch finds none of this name here" in refused(capsys, *learn, asked, "--device", "abacus")
    own = facts(films(tmp_path, asked, camera="clevrer"), seed=1, device="cpu")
    Checkpoint(tmp_path / "x.concepts-checkpoint" / "networks", own).keep("part", {"a": np.ones(2)})
    assert "belongs to another run (other seed)" in refused(capsys, *learn, asked)
    assert "belongs to another run (other videos and answers)" in refused(
        capsys, *learn, questions(tmp_path, words | {"answer": "2"}), "--seed", "1"
    )


@pytest.mark.parametrize(
    ("question", "answer", "message"),
    [
        ("How many collisions happen?", "many", "give a whole number"),
        ("How many collisions happen?", "-3", "give a whole number"),
        ("How many collisions happen?", float("nan"), "give a whole number"),
        ("Are there any moving cubes when the video ends?", "Yes", "give 'yes' or 'no'"),
        ("What color is the metal cube?", "orange", "the words are gray, red"),
    ],
)
def test_answers_that_a_question_cannot_have(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], question: str, answer: object, message: str
) -> None:
    asked = questions(tmp_path, {"question_id": 7, "question": question, "answer": answer})
    (tmp_path / "clip.mp4").write_bytes(b"")
    line = refused(capsys, "learn-concepts", tmp_path, "--questions", asked, "--out", tmp_path / "x.concepts")
    assert "question 7: the answer" in line
    assert message in line
    if answer != "orange":  # an object of somebody's own tracks may have any color
        assert message in refused(capsys, "evaluate", tmp_path, "--questions", asked, "--out", tmp_path / "out")


def test_a_video_that_was_mended_is_looked_at(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A refused video leaves no claim on the checkpoint behind."""
    (tmp_path / "clip.mp4").write_bytes(b"broken")
    asked = questions(tmp_path, COUNT | {"question": "How many red metal cubes are there?"})
    learn = ["learn-concepts", tmp_path, "--questions", asked, "--camera", "clevrer", "--out", tmp_path / "x.concepts"]
    first = refused(capsys, *learn, "--processes", "1")
    (tmp_path / "clip.mp4").write_bytes(b"broken otherwise")
    assert refused(capsys, *learn, "--processes", "1") == first


@pytest.mark.slow
def test_learned_in_one_command_and_used_in_another(
    shared_data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data, out = shared_data / "clevrer_bullet", tmp_path / "x.concepts"
    learn = ["learn-concepts", data / "videos", "--questions", data / "questions.json", "--scenes", "5:7", "--out", out]
    assert cli.run([str(word) for word in learn]) == 0
    said = capsys.readouterr().out
    assert "Learned from 2 videos" in said
    assert str(out) in said
    assert len(read_concepts(out).networks) == 5
    for name in ("videos/video_00005.mp4", "camera.json"):
        shutil.copy(data / name, tmp_path)
    ask = ["ask", tmp_path / "video_00005.mp4", "How many purple objects are there?", "--sampler", "laplace"]
    assert cli.run([str(word) for word in [*ask, "--json", "--concepts", out]]) == 0
    assert json.loads(capsys.readouterr().out)["answer"] == 2
    tracks = ["ask", data, "How many collisions happen?", "--video", "video_00005", "--concepts", out]
    assert "learned concepts look at videos" in refused(capsys, *tracks)

"""Input that cannot be used: exit code 2, and one sentence before any expensive work."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from command_line import OBJECTS, refused, two_discs

from vrdp_prob import cli
from vrdp_prob.report import pipeline
from vrdp_prob.scene import Camera


def write_video(path: Path, frames: int = 12, *, size: tuple[int, int] = (480, 320)) -> None:
    """A video of an empty gray floor."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), 25, size)
    for _ in range(frames):
        writer.write(np.full((size[1], size[0], 3), 128, np.uint8))
    writer.release()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "no such file"),
        (b"", "clip.mp4"),
        (b"not a video at all" * 50, "clip.mp4"),
    ],
)
def test_files_that_are_no_videos(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: bytes | None, message: str
) -> None:
    video = tmp_path / "clip.mp4"
    if content is not None:
        video.write_bytes(content)
    assert message in refused(capsys, "report", video, "--camera", "clevrer", "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_truncated_video(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    whole = cli.demo_folder() / "video_00000.mp4"
    (tmp_path / "clip.mp4").write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    assert "clip.mp4" in refused(capsys, "report", tmp_path / "clip.mp4", "--camera", cli.demo_folder() / "camera.json")


def test_a_video_of_an_empty_floor(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_video(tmp_path / "clip.mp4")
    assert "object" in refused(capsys, "report", tmp_path / "clip.mp4", "--camera", "clevrer")


def test_a_video_without_a_camera(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "deep").mkdir()
    write_video(tmp_path / "deep" / "clip.mp4")
    assert "no camera; put camera.json beside the video" in refused(capsys, "report", tmp_path / "deep" / "clip.mp4")


def test_a_camera_with_a_singular_matrix(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_video(tmp_path / "clip.mp4")
    document = Camera.clevrer().to_document() | {"projection": [[1, 2, 3, 4]] * 3}
    (tmp_path / "camera.json").write_text(json.dumps(document))
    assert "singular matrix" in refused(capsys, "report", tmp_path / "clip.mp4")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("video,object,time,x,y", "video,object,time,x,z", "column y missing"),
        ("v,1,0.04,", "v,1,nan,", "'time' is 'nan'"),
        ("v,1,0.04,-1.44161", "v,1,0.04,inf", "'x' is 'inf'"),
        ("v,1,0.04,", "v,1,0.00,", "is there twice"),
        ("v,1,0.08,", "v,1,0.02,", "comes after a later one"),
    ],
)
def test_unusable_tracks(folder: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, message: str) -> None:
    text = (folder / "tracks.csv").read_text()
    changed = [new + line.removeprefix(old) if line.startswith(old) else line for line in text.splitlines()]
    (folder / "tracks.csv").write_text("\n".join(changed) + "\n")
    assert message in refused(capsys, "report", folder, "--out", folder / "out")
    assert not (folder / "out").exists()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("sphere", "ball", "shape 'ball' is not known"),
        ("sphere,0.2", "sphere,-1", "radius is -1"),
        ("0.2", "1.2", "objects 1 and 2 overlap at 0 s"),
    ],
)
def test_unusable_objects(folder: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, message: str) -> None:
    (folder / "objects.csv").write_text(OBJECTS.replace(old, new))
    assert message in refused(capsys, "report", folder)


@pytest.mark.parametrize(("rows", "message"), [(1, "there are 0 objects"), (2, "seen in 1 frame")])
def test_too_few_rows(folder: Path, capsys: pytest.CaptureFixture[str], rows: int, message: str) -> None:
    lines = two_discs().splitlines()[:rows]
    (folder / "tracks.csv").write_text("\n".join(lines) + "\n")
    (folder / "objects.csv").write_text("".join(OBJECTS.splitlines(keepends=True)[:rows]))
    assert message in refused(capsys, "report", folder)


@pytest.mark.parametrize(
    ("question", "message"),
    [
        ("", "the question is empty"),
        ("   ", "the question is empty"),
        ("Why does the moon shine?", "Why"),
        ("What color is the cube?", "cube"),
        ("What will happen next?", "choice"),
    ],
)
def test_unusable_questions(folder: Path, capsys: pytest.CaptureFixture[str], question: str, message: str) -> None:
    assert message.lower() in refused(capsys, "ask", folder, question, "--sampler", "laplace").lower()


@pytest.mark.parametrize(("text", "message"), [("", "not a JSON file"), ("[]", "holds no question")])
def test_unusable_question_files(folder: Path, capsys: pytest.CaptureFixture[str], text: str, message: str) -> None:
    (folder / "questions.json").write_text(text)
    assert message in refused(capsys, "report", folder, "--questions", folder / "questions.json")


@pytest.mark.parametrize("command", [("report",), ("ask", "How many collisions happen?")])
def test_a_table_of_another_name(folder: Path, capsys: pytest.CaptureFixture[str], command: tuple[str, ...]) -> None:
    (folder / "tracks.csv").rename(folder / "run_1.csv")
    line = refused(capsys, command[0], folder / "run_1.csv", *command[1:])
    assert "must be named tracks.csv" in line


def forbid(monkeypatch: pytest.MonkeyPatch, *names: str) -> None:
    """Let functions of the command line fail the test when they are called."""

    def fail(*_arguments: object, **_options: object) -> None:
        pytest.fail("expensive work before a refusal")

    for name in names:
        monkeypatch.setattr(cli, name, fail)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--sampler", "gibbs"], "sampler 'gibbs' is not known"),
        (["--noise", "white"], "noise 'white' is not known; use one of auto, gaussian, student_t"),
        (["--defaults", "none"], "defaults 'none' is not known; use one of fixed, prior"),
        (["--checkpoint", "{folder}/tracks.csv"], "tracks.csv: "),
        (["--model", "nowhere.toml"], "nowhere.toml"),
    ],
)
@pytest.mark.parametrize("command", [("report",), ("ask", "How many collisions happen?")])
def test_options_are_refused_before_the_video_is_read(
    folder: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    *,
    command: tuple[str, ...],
    options: list[str],
    message: str,
) -> None:
    forbid(monkeypatch, "load", "load_all")
    words = [word.format(folder=folder) for word in options]
    assert message in refused(capsys, command[0], folder, *command[1:], *words)


@pytest.mark.parametrize("error", ["0", "1", "-0.1", "nan"])
def test_an_error_that_cannot_be_reached_is_refused_before_the_video_is_read(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, error: str
) -> None:
    forbid(monkeypatch, "load", "load_all")
    assert "between 0 and 1" in refused(capsys, "ask", folder, "How many collisions happen?", "--mc-error", error)


@pytest.mark.parametrize(
    ("question", "choices", "message"),
    [
        ("Why does the moon shine?", [], "why"),
        ("What will happen next?", [], "needs choices"),
        ("What will happen next?", ["The moon shines"], "choice 'the moon shines' is not understood at 'moon'"),
        ("How many collisions happen?", ["two"], "without choices"),
    ],
)
def test_questions_are_refused_before_the_video_is_read(
    folder: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    *,
    question: str,
    choices: list[str],
    message: str,
) -> None:
    forbid(monkeypatch, "load", "load_all")
    options = [word for choice in choices for word in ("--choice", choice)]
    assert message in refused(capsys, "ask", folder, question, *options).lower()
    entry = {"question": question, "question_id": 7, "choices": [{"choice": choice} for choice in choices]}
    document = [{"video_filename": "v.mp4", "questions": [entry]}]
    (folder / "questions.json").write_text(json.dumps(document))
    line = refused(capsys, "report", folder, "--questions", folder / "questions.json")
    assert message in line.lower()
    assert "questions.json, v, question 7: " in line


@pytest.mark.parametrize(
    ("question", "message"),
    [
        ("What color is the cube?", "there is no cube in the video"),
        ("What color is the object that collides with the green object?", "there is no green object"),
        ("What is the shape of the thing?", "2 objects"),
    ],
)
def test_objects_are_looked_up_before_inference(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, question: str, message: str
) -> None:
    forbid(monkeypatch, "infer")
    monkeypatch.setattr(pipeline, "infer", cli.infer)
    assert message in refused(capsys, "ask", folder, question).replace("two objects", "2 objects")
    document = [{"video_filename": "v.mp4", "questions": [{"question": question}]}]
    (folder / "questions.json").write_text(json.dumps(document))
    line = refused(capsys, "report", folder, "--questions", folder / "questions.json")
    assert message in line.replace("two objects", "2 objects")
    assert f"{folder / 'questions.json'}, v, question 1: " in line


def test_positions_are_no_videos_to_calibrate_with(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = refused(capsys, "calibrate-camera", folder, "--positions", folder, "--out", folder / "camera.json")
    assert "a tracks folder or an annotation is no video" in line
    assert "no such file" in refused(capsys, "calibrate-camera", folder / "none.mp4", "--positions", folder)
    assert not (folder / "camera.json").exists()


def test_an_output_folder_that_cannot_be_written(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    forbid(monkeypatch, "load_all")
    (folder / "taken").write_text("a file is in the way")
    line = refused(capsys, "report", folder, "--out", folder / "taken", "--sampler", "laplace")
    assert "taken" in line


def test_a_video_that_is_not_there_is_refused_before_its_questions(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    line = refused(capsys, "report", folder, "--video", "w", "--questions", folder / "none.json")
    assert "there is no video 'w'; the videos are v" in line


def test_a_file_in_the_place_of_a_report_of_one_of_several_videos_is_refused_before_the_work(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("tracks.csv", "objects.csv"):
        header, *rows = (folder / name).read_text().splitlines()
        other = [row.replace("v,", "../w,", 1) for row in rows]
        (folder / name).write_text("\n".join([header, *rows, *other]) + "\n")
    forbid(monkeypatch, "load_all")
    (folder / "out").mkdir()
    (folder / "out" / ".._w").write_text("a file is in the way")
    assert ".._w: the folder cannot be written" in refused(capsys, "report", folder, "--out", folder / "out")


def test_unusable_options(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "sampler 'gibbs' is not known" in refused(capsys, "report", folder, "--sampler", "gibbs")
    assert "--seed" in refused(capsys, "report", folder, "--seed", "many")
    assert "--seed" in refused(capsys, "report", folder, "--seed", "-1")
    assert "No such option" in refused(capsys, "report", folder, "--colour")
    assert "INPUT" in refused(capsys, "report")

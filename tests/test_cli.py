"""The command line as a user meets it: exit codes, one sentence for a mistake, nothing half-written."""

import errno
import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import jsonschema
import numpy as np
import pytest

from vrdp_prob import __version__, cli
from vrdp_prob.progress import Advance
from vrdp_prob.reasoning import Answer, AskablePosterior, ChoiceAnswer
from vrdp_prob.reasoning.answer import monte_carlo_error
from vrdp_prob.report import pipeline, schema
from vrdp_prob.scene import Camera, QuestionType

TRACKS_HEADER = "video,object,time,x,y"
OBJECTS = "video,object,shape,radius,material,color\nv,1,sphere,0.2,metal,red\nv,2,cylinder,0.2,rubber,blue\n"


def two_discs(frames: int = 60) -> str:
    """Tracks of a red sphere that runs into a resting blue cylinder, computed by hand: no friction, e = 0.8."""
    noise = np.random.default_rng(0)
    rows = [TRACKS_HEADER]
    for frame in range(frames):
        time = frame / 25
        contact = 1.1 / 1.5
        first = -1.5 + 1.5 * min(time, contact) + 0.15 * max(time - contact, 0)
        second = 0.0 + 1.35 * max(time - contact, 0)
        for name, x in (("1", first), ("2", second)):
            rows.append(f"v,{name},{time:.2f},{x + noise.normal(0, 0.003):.5f},{noise.normal(0, 0.003):.5f}")
    return "\n".join(rows) + "\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A tracks folder of one video with one collision."""
    (tmp_path / "tracks.csv").write_text(two_discs())
    (tmp_path / "objects.csv").write_text(OBJECTS)
    return tmp_path


def refused(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    """Run a command that must refuse its input with exit code 2 and one line; return the line."""
    assert cli.run([str(argument) for argument in arguments]) == cli.UNUSABLE_INPUT
    captured = capsys.readouterr()
    assert captured.out == ""
    (line,) = captured.err.strip().splitlines()
    assert line.startswith("vrdp-prob: ")
    assert line.endswith((".", ")"))
    return line


def write_video(path: Path, frames: int = 12, *, size: tuple[int, int] = (480, 320)) -> None:
    """A video of an empty gray floor."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), 25, size)
    for _ in range(frames):
        writer.write(np.full((size[1], size[0], 3), 128, np.uint8))
    writer.release()


def test_report_writes_its_three_files(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    questions = [
        {
            "video_filename": "v.mp4",
            "questions": [
                {"question_id": 0, "question": "How many collisions happen?"},
                {
                    "question_id": 1,
                    "question": "What will happen without the red object?",
                    "choices": [{"choice_id": 0, "choice": "The sphere and the cylinder collide"}],
                },
            ],
        }
    ]
    (tmp_path / "questions.json").write_text(json.dumps(questions))
    out = tmp_path / "out"
    command = ["report", folder, "--questions", tmp_path / "questions.json", "--out", out, "--sampler", "laplace"]
    assert cli.run([str(word) for word in command]) == 0
    captured = capsys.readouterr()
    assert sorted(path.name for path in out.iterdir()) == ["posterior.nc", "report.html", "report.json"]
    assert str(out / "report.html") in captured.out
    document = json.loads((out / "report.json").read_text())
    jsonschema.validate(document, schema("report"))
    assert [answer["answer"] for answer in document["answers"]] == [1, []]
    assert document["objects"][0]["mass"]["status"] == "ratio_only"
    saved = AskablePosterior.read(str(out / "posterior.nc"))
    assert saved.ask("How many collisions happen?").to_document() | {"question_id": 0} == document["answers"][0]


def test_ask_prints_exactly_one_document(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    question = "What color is the object that collides with the red object?"
    assert cli.run(["ask", str(folder), question, "--json", "--sampler", "laplace", "--seed", "3"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["answer"] == "blue"
    jsonschema.validate(document, schema("report")["properties"]["answers"]["items"])


def answer(**fields: object) -> Answer:
    """An answer of 400 effective draws to an open question."""
    basis = {
        "question_id": None,
        "question": "How many collisions happen?",
        "question_type": QuestionType.DESCRIPTIVE,
        "answer": 2,
        "probability": 0.6,
        "mc_error": monte_carlo_error(0.6, 400),
        "entropy": 0.0,
        "distribution": {"2": 0.6, "1": 0.3, "3": 0.1},
    }
    return Answer(**(basis | fields))


@pytest.mark.parametrize(
    ("given", "lines"),
    [
        (answer(), ["  60 % ± 2     2", "  30 % ± 2     1", "  10 % ± 1     3"]),
        (
            answer(probability=1.0, mc_error=monte_carlo_error(1.0, 400), distribution={"2": 1.0}),
            ["> 99 %         2"],
        ),
        (answer(probability=1.0, mc_error=0.0, distribution={"2": 1.0}), [" 100 %         2"]),
        (
            answer(choices=(ChoiceAnswer(0, "A and B collide", 0.25, 0.004),), notes=("The end is near.",)),
            ["  25 % ± 0.4   A and B collide", "note: The end is near."],
        ),
        (
            answer(probability=1.0, mc_error=0.0, distribution={"2": 1.0}, relies_on_default=("3", "4")),
            [
                " 100 %         2",
                "note: Rests on default values of objects 3 and 4, which this video does not determine.",
            ],
        ),
    ],
)
def test_an_answer_is_printed_with_its_error(
    folder: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    *,
    given: Answer,
    lines: list[str],
) -> None:
    monkeypatch.setattr(cli, "infer", lambda *_arguments, **_options: None)
    monkeypatch.setattr(cli, "ask", lambda *_arguments, **_options: given)
    assert cli.run(["ask", str(folder), given.question]) == 0
    assert capsys.readouterr().out.splitlines() == lines


def test_the_same_seed_gives_the_same_answer(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["ask", str(folder), "How many collisions happen?", "--json", "--sampler", "laplace"]
    outputs = []
    for seed in ("5", "5"):
        assert cli.run([*command, "--seed", seed]) == 0
        outputs.append(capsys.readouterr().out)
    assert outputs[0] == outputs[1]


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
    assert message in refused(capsys, command[0], folder, *command[1:], *options)


@pytest.mark.parametrize(
    ("question", "choices", "message"),
    [
        ("Why does the moon shine?", [], "why"),
        ("What will happen next?", [], "needs choices"),
        ("What will happen next?", ["The moon shines"], "moon"),
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


def test_unusable_options(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "sampler 'gibbs' is not known" in refused(capsys, "report", folder, "--sampler", "gibbs")
    assert "--seed" in refused(capsys, "report", folder, "--seed", "many")
    assert "--seed" in refused(capsys, "report", folder, "--seed", "-1")
    assert "No such option" in refused(capsys, "report", folder, "--colour")
    assert "INPUT" in refused(capsys, "report")


@pytest.mark.parametrize("failing", ["fill_file", "write_report"])
def test_a_report_that_cannot_be_written_leaves_the_old_one(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, failing: str
) -> None:
    def fail(*_arguments: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    out = folder / "out"
    out.mkdir()
    for name in ("posterior.nc", "report.html", "report.json"):
        (out / name).write_text("old")
    monkeypatch.setattr(pipeline, failing, fail)
    line = refused(capsys, "report", folder, "--out", out, "--sampler", "laplace", "--quiet")
    assert "posterior.nc: the file cannot be written (No space left on device)" in line
    assert {path.name: path.read_text() for path in out.iterdir()} == dict.fromkeys(
        ("posterior.nc", "report.html", "report.json"), "old"
    )


def test_the_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["--version"]) == 0
    assert capsys.readouterr().out == f"vrdp-prob {__version__}\n"


def test_no_command_prints_the_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run([]) == 0
    captured = capsys.readouterr()
    assert "calibrate-camera" in captured.out
    assert captured.err == ""


class Interrupting:
    """A progress display during whose stage of a given number somebody presses Ctrl-C."""

    def __init__(self, number: int) -> None:
        self.left = number

    @contextmanager
    def stage(self, description: str, total: float | None = None) -> Iterator[Advance]:
        del description, total
        yield lambda _steps: None
        self.left -= 1
        if self.left == 0:
            raise KeyboardInterrupt


def test_interruption_leaves_nothing_half_written(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    command = ["report", str(folder), "--out", str(folder / "out"), "--sampler", "laplace"]
    for number in range(1, 20):
        display = Interrupting(number)
        monkeypatch.setattr(cli, "progress_display", lambda *, quiet, display=display: display)
        code = cli.run(command)
        left = sorted(path.name for path in (folder / "out").glob("*"))
        if code == 0:
            assert number > 3, "the work tells of more than two stages"
            return
        assert code == cli.FAILURE
        assert "interrupted" in capsys.readouterr().err
        assert left in ([], ["posterior.nc", "report.html", "report.json"])
    pytest.fail("the report never came to its end")

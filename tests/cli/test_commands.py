"""Commands as a user meets them: what they print and write, and nothing half-written."""

import errno
import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import jsonschema
import pytest
from command_line import refused

from vrdp_prob import InputError, __version__, cli
from vrdp_prob.progress import Advance
from vrdp_prob.reasoning import Answer, AskablePosterior, ChoiceAnswer
from vrdp_prob.reasoning.answer import monte_carlo_error
from vrdp_prob.report import pipeline, schema
from vrdp_prob.scene import QuestionType


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
    again = saved.ask("How many collisions happen?").to_document()
    assert again | {"question_id": 0, "explanation": None} == document["answers"][0]


def test_ask_prints_exactly_one_document(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    question = "What color is the object that collides with the red object?"
    assert cli.run(["ask", str(folder), question, "--json", "--explain", "--sampler", "laplace", "--seed", "3"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["answer"] == "blue"
    assert document["explanation"] == {"parts": [], "sentences": [document["explanation"]["sentences"][0]]}
    jsonschema.validate(document, schema("report")["properties"]["answers"]["items"])
    assert document["converged"] is True or "has not converged" in " ".join(document["warnings"])


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
                "note: Rests on mass or restitution of objects 3 and 4, which this video does not determine.",
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
    misfit = "The model does not fit."
    posterior = SimpleNamespace(
        warnings=(misfit, "The draws have not converged."), misfit=SimpleNamespace(sentences=(misfit,))
    )
    monkeypatch.setattr(cli, "infer", lambda *_arguments, **_options: posterior)
    monkeypatch.setattr(cli, "ask", lambda *_arguments, **_options: given)
    assert cli.run(["ask", str(folder), given.question]) == 0
    printed = capsys.readouterr().out.splitlines()
    assert printed == [f"note: {misfit}", *lines, "note: The draws have not converged."]


def test_the_same_seed_gives_the_same_answer(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["ask", str(folder), "How many collisions happen?", "--json", "--sampler", "laplace"]
    outputs = []
    for seed in ("5", "5"):
        assert cli.run([*command, "--seed", seed]) == 0
        outputs.append(capsys.readouterr().out)
    assert outputs[0] == outputs[1]


@pytest.mark.parametrize("command", [("report",), ("ask", "How many collisions happen?")])
def test_options_of_the_inference_reach_it(
    folder: Path, monkeypatch: pytest.MonkeyPatch, command: tuple[str, ...]
) -> None:
    given: dict[str, object] = {}

    def infer(*_arguments: object, **options: object) -> None:
        given.update(options)
        raise InputError("enough is known.")

    monkeypatch.setattr(cli, "infer", infer)
    monkeypatch.setattr(pipeline, "infer", infer)
    options = {
        "--noise": "student_t",
        "--defaults": "prior",
        "--checkpoint": str(folder / "kept"),
        "--sampler": "nuts",
        "--seed": "4",
    }
    words = [word for option in options.items() for word in option]
    assert cli.run([command[0], str(folder), *command[1:], *words]) == cli.UNUSABLE_INPUT
    assert {f"--{name}": str(value) for name, value in given.items() if f"--{name}" in options} == options


def test_a_checkpoint_is_of_one_run(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["ask", str(folder), "How many collisions happen?", "--json", "--sampler", "laplace"]
    command += ["--checkpoint", str(folder / "kept")]
    outputs = []
    for _ in range(2):
        assert cli.run(command) == 0
        outputs.append(capsys.readouterr().out)
    assert outputs[0] == outputs[1]
    assert "the checkpoint belongs to another run (other seed)" in refused(capsys, *command, "--seed", "9")


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


def test_the_package_and_its_module_are_the_command() -> None:
    for module in ("vrdp_prob", "vrdp_prob.cli"):
        found = subprocess.run([sys.executable, "-m", module, "--version"], capture_output=True, text=True, check=True)
        assert found.stdout == f"vrdp-prob {__version__}\n"


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

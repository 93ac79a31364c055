"""Words on the command line: learned, used, refused."""

import json
from pathlib import Path

import pytest
from command_line import refused

from tests.concepts.physical.word_videos import faster, write_videos
from tests.concepts.physical.words import UNSURE
from tests.reasoning.sliding_discs import Disc
from vrdp_prob import cli
from vrdp_prob.concepts.physical import LearnedWord

QUESTION = "If the red sphere were floppier, what would happen?"
CHOICE = "The red sphere collides with the blue cylinder"
ROW = (Disc((-1.5, 0.0), (0.85, 0.0)), Disc((0.0, 0.05)), Disc((0.9, 0.15)))
"""Disc 0 stops just before disc 1; faster it hits it."""


@pytest.fixture
def word(tmp_path: Path) -> Path:
    """The file of a word."""
    UNSURE.write(tmp_path / "floppier.json")
    return tmp_path / "floppier.json"


def test_ask_with_a_word(folder: Path, word: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["ask", folder, QUESTION, "--choice", CHOICE, "--word", word, "--sampler", "laplace", "--json"]
    assert cli.run([str(argument) for argument in arguments]) == 0
    answer = json.loads(capsys.readouterr().out)
    # whatever floppier means, the first contact happens unless the sphere is slower
    assert answer["question_type"] == "counterfactual"
    assert answer["choices"][0]["probability"] > 0.8


def test_files_of_words_that_cannot_be_used(folder: Path, word: Path, capsys: pytest.CaptureFixture[str]) -> None:
    twice = ("--word", word, "--word", word)
    assert "'floppier' is given twice" in refused(capsys, "ask", folder, QUESTION, "--choice", CHOICE, *twice)
    missing = ("--word", word.with_name("other.json"))
    for command in (
        ("ask", folder, QUESTION, "--choice", CHOICE),
        ("report", folder, "--out", folder / "out"),
        ("evaluate", folder, "--questions", folder / "tracks.csv", "--out", folder / "out"),
    ):
        assert "other.json: the file cannot be read" in refused(capsys, *command, *missing)
    assert not (folder / "out").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("red",), "the word 'red' means something else in questions"),
        (("Faster",), "is not one word of the letters a to z"),
        (("slower",), "no question uses the word 'slower'"),
        (("faster", "--scenes", "3:5"), "no question about scenes 3 to 4 uses the word 'faster'"),
        (("faster", "--sampler", "guess"), "sampler"),
    ],
)
def test_words_that_cannot_be_learned(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], message: str
) -> None:
    questions = write_videos(tmp_path, "faster", faster, [ROW])
    name, *options = arguments
    file = tmp_path / "word.json"
    line = refused(capsys, "learn-word", name, tmp_path, "--questions", questions, "--out", file, *options)
    assert message in line
    assert not file.exists()


def test_files_that_cannot_teach(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    questions = write_videos(tmp_path, "faster", faster, [ROW])
    refusal = refused(capsys, "learn-word", "faster", tmp_path, "--questions", tmp_path / "other.json")
    assert "other.json: the file cannot be read" in refusal
    assert "nowhere" in refused(capsys, "learn-word", "faster", tmp_path / "nowhere", "--questions", questions)
    questions.write_text(questions.read_text()[:-20])
    assert "not a JSON file" in refused(capsys, "learn-word", "faster", tmp_path, "--questions", questions)


def test_answers_that_a_question_cannot_have(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    questions = write_videos(tmp_path, "faster", faster, [ROW])
    document = json.loads(questions.read_text())
    (judged,) = (question for question in document[0]["questions"] if "choices" in question)
    learn = ["learn-word", "faster", tmp_path, "--questions", questions, "--out", tmp_path / "faster.json"]
    judged["choices"][0]["answer"] = "perhaps"
    questions.write_text(json.dumps(document))
    assert "is judged 'perhaps'; judge it 'correct' or 'wrong'" in refused(capsys, *learn)
    asked = "Would the red cylinder hit the blue cylinder if the red cylinder were faster?"
    document[0]["questions"] = [{"question_id": 0, "question": asked, "answer": "maybe"}]
    questions.write_text(json.dumps(document))
    assert "the answer 'maybe' is none that this question can have; give 'yes' or 'no'" in refused(capsys, *learn)


@pytest.mark.slow
def test_learn_word_then_evaluate_with_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    questions = write_videos(tmp_path, "faster", faster, [ROW])
    file = tmp_path / "faster.json"
    common = [str(tmp_path), "--questions", str(questions), "--processes", "1"]
    assert cli.run(["learn-word", "faster", *common, "--out", str(file)]) == 0
    printed = capsys.readouterr().out.splitlines()
    assert printed == [*LearnedWord.read(file).summary, str(file)]
    evaluated = ["evaluate", *common, "--word", str(file), "--out", str(tmp_path / "out"), "--json"]
    assert cli.run(evaluated) == 0
    scores = json.loads(capsys.readouterr().out)["posterior"]["counterfactual_word"]
    assert scores["questions"] == 1
    reported = ["report", str(tmp_path), "--questions", str(questions), "--sampler", "laplace", "--word", str(file)]
    assert cli.run([*reported, "--out", str(tmp_path / "report"), "--quiet"]) == 0
    answers = json.loads((tmp_path / "report" / "report.json").read_text())["answers"]
    assert [answer["question"] for answer in answers if answer["question_type"] == "counterfactual"] == [
        "If the red cylinder were faster, what would happen?"
    ]

"""A folder of videos and a question file from end to end: scores, documents, interruption, a cluster."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from importlib import resources
from pathlib import Path

import jsonschema
import pytest
from videos import SPEEDS, write_videos

from vrdp_prob import InputError, cli
from vrdp_prob.evaluation import evaluate
from vrdp_prob.evaluation.document import table, to_document, write_evaluation
from vrdp_prob.evaluation.evaluate import Evaluation
from vrdp_prob.evaluation.page import render

DRAWS = 100


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("videos")
    write_videos(path)
    return path


@pytest.fixture(scope="module")
def evaluation(folder: Path) -> Evaluation:
    return evaluate(folder, folder / "questions.json", scenes=(10, 12), draws=DRAWS, processes=2)


def without_times(evaluation: Evaluation) -> list[dict[str, object]]:
    return [{**result.to_document(), "seconds": 0.0} for result in evaluation.results]


def test_scores_of_known_answers(evaluation: Evaluation) -> None:
    scores = evaluation.scores["posterior"]
    assert [result.scene for result in evaluation.results] == ["video_00000", "video_00001"]
    assert scores["descriptive"].accuracy_per_question == 0.5  # one stated answer is wrong on purpose
    for group in ("explanatory", "predictive", "counterfactual_mass", "counterfactual"):
        assert scores[group].accuracy_per_question == 1.0
        assert scores[group].accuracy_per_option == 1.0
    assert scores["counterfactual_removal"].questions == 0
    assert evaluation.failed == ()


def test_the_best_fit_has_no_doubt(evaluation: Evaluation) -> None:
    assert {judgement.confidence for judgement in evaluation.judgements("map")} == {1.0}
    assert {share for judgement in evaluation.judgements("map") for share, _ in judgement.choices} <= {0.0, 1.0}


def test_the_document_keeps_the_contract(evaluation: Evaluation, tmp_path: Path) -> None:
    schema = json.loads((resources.files("vrdp_prob.report") / "schemas" / "evaluation.schema.json").read_text())
    page, file = write_evaluation(evaluation, tmp_path)
    document = json.loads(file.read_text(), parse_constant=lambda name: pytest.fail(f"{name} is not strict JSON"))
    jsonschema.validate(document, schema)
    assert document == json.loads(json.dumps(to_document(evaluation)))
    text = page.read_text()
    assert "What is the shape of the red object?" in text  # the wrong answer is listed
    assert "2 videos" in text
    assert any(line.startswith("descriptive") for line in table(evaluation))


def test_a_video_that_fails_counts_as_wrong(folder: Path, tmp_path: Path) -> None:
    for name in ("tracks.csv", "objects.csv", "questions.json"):
        (tmp_path / name).write_text((folder / name).read_text())
    rows = (tmp_path / "tracks.csv").read_text().splitlines()
    still = [
        ",".join([*row.split(",")[:3], "0.0" if row.split(",")[1] == "1" else "1.0", "0.0"])
        if row.startswith("video_00001")
        else row
        for row in rows
    ]
    (tmp_path / "tracks.csv").write_text("\n".join(still) + "\n")
    found = evaluate(tmp_path, tmp_path / "questions.json", scenes=(11, 12), draws=DRAWS, processes=1)
    document = to_document(found)
    (failed,) = document["failed"]
    assert failed["scene"] == "video_00001"
    assert "moves" in failed["reason"]
    assert document["posterior"]["descriptive"]["accuracy_per_question"] == 0.0
    assert document["posterior"]["descriptive"]["questions"] == 2


COMMAND = """
import sys
from vrdp_prob.cli import run
if __name__ == "__main__":
    sys.exit(run(sys.argv[1:]))
"""


@pytest.mark.slow
def test_a_killed_evaluation_goes_on(folder: Path, tmp_path: Path) -> None:
    script = tmp_path / "command.py"
    script.write_text(COMMAND)
    out = tmp_path / "out"
    words = ["evaluate", str(folder), "--questions", str(folder / "questions.json"), "--out", str(out), "--json"]
    command = [sys.executable, str(script), *words, "--processes", "1", "--quiet"]
    with subprocess.Popen(command, start_new_session=True, stdout=subprocess.DEVNULL) as running:
        first, deadline = out / "scenes" / "video_00000" / "result.json", time.monotonic() + 300
        while not first.exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        os.killpg(running.pid, signal.SIGKILL)
    done = {file: file.read_bytes() for file in (out / "scenes").glob("*/result.json")}
    assert 1 <= len(done) < len(SPEEDS)
    finished = subprocess.run(command, stdout=subprocess.PIPE, check=True)
    again = json.loads(finished.stdout)
    assert again["scenes"] == len(SPEEDS)
    for file, content in done.items():
        assert file.read_bytes() == content  # not made again
    whole = evaluate(folder, folder / "questions.json", processes=1)
    expected = json.loads(json.dumps(to_document(whole)))
    assert {**expected, "seconds_per_video": 0} == {**again, "seconds_per_video": 0}


@pytest.mark.slow
def test_results_of_other_settings_are_not_mixed(folder: Path, tmp_path: Path) -> None:
    evaluate(folder, folder / "questions.json", scenes=(10, 11), draws=DRAWS, out=tmp_path, processes=1)
    with pytest.raises(InputError, match=r"another run \(other seed\)"):
        evaluate(folder, folder / "questions.json", scenes=(10, 11), draws=DRAWS, seed=1, out=tmp_path)


def test_a_refused_evaluation_leaves_the_folder_to_the_next(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("vrdp_prob.workers.PATIENCE", 1)
    pytest.importorskip("distributed", reason="the optional library distributed is not installed")
    call = {"scenes": (10, 11), "draws": DRAWS, "out": tmp_path / "out"}
    with pytest.raises(InputError, match="no Dask scheduler answers"):
        evaluate(folder, folder / "questions.json", **call, seed=5, dask="tcp://127.0.0.1:1")
    assert not (tmp_path / "out").exists()
    evaluate(folder, folder / "questions.json", **call, seed=6, processes=1)
    with pytest.raises(InputError, match=r"another run \(other seed\)"):
        evaluate(folder, folder / "questions.json", **call, seed=5)


def test_one_video_gives_no_intervals(folder: Path, tmp_path: Path) -> None:
    alone = evaluate(folder, folder / "questions.json", scenes=(10, 11), draws=DRAWS, processes=1)
    document = to_document(alone)
    assert document["posterior"]["descriptive"]["intervals"] == {}
    gain = document["brier_gain_over_map"]["descriptive"]
    assert (gain["low"], gain["high"]) == (None, None)
    schema = json.loads((resources.files("vrdp_prob.report") / "schemas" / "evaluation.schema.json").read_text())
    jsonschema.validate(json.loads(json.dumps(document)), schema)
    page = write_evaluation(alone, tmp_path)[0].read_text()
    assert "<title>Evaluation of 1 video</title>" in page
    assert "5 questions about 1 video" in page
    assert "One video alone gives no intervals" in page
    assert "Intervals in brackets" not in page
    assert " to " not in "".join(line for line in page.splitlines() if line.startswith("<tr><td>"))
    assert 'class="good"' not in page
    assert any(line.startswith("1 video, ") for line in table(alone))


@pytest.mark.slow
def test_a_quiet_evaluation_prints_nothing(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["evaluate", str(folder), "--questions", str(folder / "questions.json"), "--scenes", "10:11"]
    command += ["--processes", "1", "--out", str(tmp_path)]
    assert cli.run([*command, "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")
    assert cli.run(command) == 0
    files = [str(tmp_path / name) for name in ("evaluation.html", "evaluation.json")]
    assert capsys.readouterr().out.splitlines()[-2:] == files


def test_wrong_answers_are_told_with_the_texts_of_their_choices(evaluation: Evaluation) -> None:
    pairs = (("0", "The red cylinder and the blue cylinder collide"), ("1", "The <green> one and the red one meet"))
    (result, *_), (judged, *_) = evaluation.results, evaluation.judgements("posterior", "predictive")
    wrong = replace(judged, answer="0,1", truth="", right=False, texts=pairs)
    judgements = dict.fromkeys(result.judgements, (wrong,))
    page = render(Evaluation((replace(result, judgements=judgements),)))
    told = "0: The red cylinder and the blue cylinder collide<br>1: The &lt;green&gt; one and the red one meet"
    assert told in page
    assert "none of the choices" in page


@pytest.mark.filterwarnings("ignore")  # of the cluster's own libraries
def test_a_cluster_gives_the_same_numbers(folder: Path, evaluation: Evaluation) -> None:
    distributed = pytest.importorskip("distributed", reason="the optional library distributed is not installed")
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
        found = evaluate(
            folder, folder / "questions.json", scenes=(10, 12), draws=DRAWS, dask=cluster.scheduler_address
        )
    assert without_times(found) == without_times(evaluation)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"scenes": (0, 5)}, "which holds 10 to 12"),
        ({"source": "films"}, "use tracks or videos"),
        ({"source": "videos"}, "holds no video"),
        ({"sampler": "gibbs"}, "sampler 'gibbs' is not known"),
        ({"draws": 0}, "draws is 0; give a whole number of at least 1"),
        ({"seed": -1}, "seed is -1; give a whole number of at least 0"),
        ({"processes": 0}, "processes is 0; give a whole number of at least 1"),
        ({"dask": "tcp://127.0.0.1:1"}, "no Dask scheduler answers"),
    ],
)
def test_bad_calls_are_refused(
    folder: Path, change: dict[str, object], message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("vrdp_prob.workers.PATIENCE", 1)
    with pytest.raises(InputError, match=message):
        evaluate(folder, folder / "questions.json", **change)  # type: ignore[arg-type]  # wrong on purpose


@pytest.mark.parametrize(
    ("scenes", "message"),
    [
        (
            [
                {
                    "video_filename": "other.mp4",
                    "questions": [{"question": "How many collisions happen?", "answer": "1"}],
                }
            ],
            "none of the videos",
        ),
        (
            [{"video_filename": "video_00000.mp4", "questions": [{"question": "How many collisions happen?"}]}],
            "nothing to score",
        ),
        (
            [{"video_filename": "video_00000.mp4", "questions": [{"question": "Quo vadis?", "answer": "1"}]}],
            "question None",
        ),
        ([{"video_filename": "video_00000.mp4", "scene_index": "x", "questions": []}], "must be a whole number"),
        ([{"questions": []}], "not a CLEVRER question file"),
    ],
)
def test_bad_question_files_are_refused(
    folder: Path, tmp_path: Path, scenes: list[dict[str, object]], message: str
) -> None:
    file = tmp_path / "questions.json"
    file.write_text(json.dumps(scenes))
    with pytest.raises(InputError, match=message):
        evaluate(folder, file)

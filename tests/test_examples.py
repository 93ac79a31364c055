"""The examples run as they stand."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[1] / "examples"


def run_example(name: str, folder: Path) -> str:
    """Run a script in an empty folder; return what it prints."""
    command = [sys.executable, str(EXAMPLES / name)]
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    finished = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert finished.returncode == 0, finished.stderr
    assert finished.stderr == ""
    return finished.stdout


def test_ask_a_question(tmp_path: Path) -> None:
    printed = run_example("ask_a_question.py", tmp_path)
    assert "How many collisions happen?" in printed
    assert printed.count("%") >= 3


def test_report_on_a_video(tmp_path: Path) -> None:
    printed = run_example("report_on_a_video.py", tmp_path)
    paths = [tmp_path / line for line in printed.splitlines()]
    assert [path.name for path in paths] == ["report.html", "report.json", "posterior.nc"]
    assert all(path.stat().st_size > 1000 for path in paths)


def test_your_own_tracks(tmp_path: Path) -> None:
    printed = run_example("your_own_tracks.py", tmp_path)
    mean = float(printed.split("mass of B: ")[1].split(" kg")[0])
    assert mean == pytest.approx(0.036, rel=0.02)


def test_find_the_hidden_effect(tmp_path: Path) -> None:
    printed = run_example("find_the_hidden_effect.py", tmp_path)
    assert "verdict: named\nsurface_tilt" in printed
    low, high = (float(end) for end in printed.split("tilt_x: ")[1].splitlines()[0].split(" to "))
    assert low < 0.016 < high


def test_teach_a_word(tmp_path: Path) -> None:
    printed = run_example("teach_a_word.py", tmp_path)
    assert printed.startswith("'zippier' most probably changes the speed: times ")
    low, high = (float(end) for end in printed.split("90 % interval ")[1].split(" (")[0].split(" to "))
    assert low < 1.5 < high
    assert "if the red cylinder were zippier? yes (" in printed


def test_every_example_is_run() -> None:
    scripts = {path.name for path in EXAMPLES.glob("*.py")}
    assert scripts == {
        "ask_a_question.py",
        "find_the_hidden_effect.py",
        "report_on_a_video.py",
        "teach_a_word.py",
        "your_own_tracks.py",
    }

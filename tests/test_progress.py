"""Long work tells that it goes on."""

import threading
import time

import pytest

from vrdp_prob.progress import LogProgress, SilentProgress, progress_display


def test_a_log_gets_a_line_now_and_then(capsys: pytest.CaptureFixture[str]) -> None:
    times = iter([100.0, 110.0, 120.0, 131.0, 135.0, 162.0])
    with LogProgress(every=30, clock=times.__next__).stage("Evaluating", total=60) as advance:
        for _ in range(5):
            advance(3)
    assert capsys.readouterr().err.splitlines() == [
        "Evaluating: 9 of 60 in 31 s, about 176 s left",
        "Evaluating: 15 of 60 in 62 s, about 186 s left",
    ]


def test_what_was_done_before_says_nothing_of_the_time_left(capsys: pytest.CaptureFixture[str]) -> None:
    times = iter([0.0, 0.1, 40.0])
    with LogProgress(every=30, clock=times.__next__).stage("Evaluating", total=1000) as advance:
        advance(900)
        advance(1)
    assert capsys.readouterr().err == "Evaluating: 901 of 1000 in 40 s, about 3960 s left\n"


def test_a_stage_of_unknown_length_counts_its_steps(capsys: pytest.CaptureFixture[str]) -> None:
    with LogProgress(every=0).stage("Trying causes") as advance:
        advance(2)
    assert capsys.readouterr().err == "Trying causes: 2 steps in 0 s\n"


def test_a_log_goes_on_where_no_step_is_done(capsys: pytest.CaptureFixture[str]) -> None:
    with LogProgress(every=0.2).stage("Trying causes") as advance:
        advance(1)
        told, deadline = "", time.monotonic() + 20
        while told.count("\n") < 2 and time.monotonic() < deadline:
            time.sleep(0.05)
            told += capsys.readouterr().err
    assert told.count("Trying causes: 1 steps in") == told.count("\n") >= 2


def test_a_stage_without_steps_tells_its_time(capsys: pytest.CaptureFixture[str]) -> None:
    times = iter([0.0, 40.0])
    with LogProgress(every=30, clock=times.__next__).stage("Fitting all videos together") as advance:
        advance(0)
    assert capsys.readouterr().err == "Fitting all videos together: 40 s\n"


def test_a_stage_that_fails_ends(capsys: pytest.CaptureFixture[str]) -> None:
    before = threading.active_count()
    stage = LogProgress(every=0.1).stage("Trying causes")
    with pytest.raises(ValueError, match="broken"), stage:
        raise ValueError("broken")
    assert threading.active_count() == before
    assert not capsys.readouterr().err


def test_a_log_has_no_bars() -> None:
    assert isinstance(progress_display(quiet=False), LogProgress)
    assert isinstance(progress_display(quiet=True), SilentProgress)

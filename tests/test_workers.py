"""Processes that work for another end with it."""

import os
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import pytest

from vrdp_prob.workers import local_workers

PROGRAM = """
import os, sys, time
from pathlib import Path
from vrdp_prob.workers import local_workers

def work(file):
    Path(file).write_text(str(os.getpid()))
    time.sleep(600)

with local_workers(1, tasks=1) as workers:
    workers.submit(work, sys.argv[1]).result()
"""
PATIENCE = 60
"""Seconds for a process to begin or to end, on a machine that is busy."""


def test_workers_end_when_their_parent_is_killed(tmp_path: Path) -> None:
    file = tmp_path / "worker"
    parent = subprocess.Popen([sys.executable, "-c", PROGRAM, str(file)])
    assert _within_patience(lambda: file.exists() and file.read_text() != "")
    worker = int(file.read_text())
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    assert _within_patience(lambda: not _is_running(worker))


def test_that_a_grown_worker_is_replaced_is_no_news(recwarn: pytest.WarningsRecorder) -> None:
    with local_workers(1, tasks=1) as workers:
        warnings.warn("A worker was restarted while some jobs were given to the executor", UserWarning, stacklevel=1)
        assert workers.submit(abs, -3).result() == 3
    assert not recwarn


def _within_patience(holds: Callable[[], bool]) -> bool:
    end = time.monotonic() + PATIENCE
    while not holds():
        if time.monotonic() > end:
            return False
        time.sleep(0.1)
    return True


def _is_running(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    # one that has ended stays in the table until whoever adopted it looks
    state = Path(f"/proc/{process}/stat")
    return not (state.exists() and state.read_text().rpartition(")")[2].split()[0] == "Z")

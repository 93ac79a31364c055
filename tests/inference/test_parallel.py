"""Work side by side gives the same results in the same order, wherever it is done."""

import math
import os
import threading

import pytest

from vrdp_prob.inference.runs.parallel import in_parallel, in_processes, several_processes


def process(_: int) -> int:
    return os.getpid()


def thread(_: int) -> int:
    return threading.get_ident()


def threads_of_one_item(_: int) -> set[int]:
    return set(in_parallel(thread, range(8)))


def test_results_of_processes_come_in_order_and_are_told_of() -> None:
    told: list[float] = []
    with several_processes(2):
        assert in_processes(math.sqrt, [1.0, 4.0, 9.0], advance=told.append) == [1.0, 2.0, 3.0]
        assert os.getpid() not in in_processes(process, range(4))
        # A process that is one of several has no threads beside it.
        assert all(len(found) == 1 for found in in_processes(threads_of_one_item, range(2)))
        with pytest.raises(ValueError, match="math domain"):
            in_processes(math.sqrt, [1.0, -1.0])
    assert told == [1, 1, 1]


def test_everything_stays_here_where_no_processes_are_asked_for() -> None:
    told: list[float] = []
    assert in_processes(process, range(3), advance=told.append) == [os.getpid()] * 3
    assert told == [1, 1, 1]


def test_everything_stays_here_where_one_process_is_asked_for() -> None:
    with several_processes(1):
        assert in_processes(process, range(3)) == [os.getpid()] * 3

"""Processor times of functions that are measured side by side."""

import math
import resource
import time
from collections.abc import Callable, Mapping

import numpy as np

ROUNDS = 5
"""Rounds in which all functions take turns, so that a slow spell of the machine meets all of them."""
MOST = 300


def seconds(function: Callable[[], object]) -> float:
    """Processor time of one call."""
    start = time.process_time()
    function()
    return time.process_time() - start


def processor_seconds() -> float:
    """Processor time of this process and of those it started that have ended."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def interleaved(functions: Mapping[str, Callable[[], object]], budget: float) -> dict[str, float]:
    """Median processor time in s of each function, of as many calls as fit into a budget in s.

    The first call is left out, unless it alone takes as long as the budget.
    """
    first = {name: seconds(function) for name, function in functions.items()}
    wanted = {name: min(MOST, math.floor(budget / taken)) for name, taken in first.items()}
    times: dict[str, list[float]] = {name: [] if wanted[name] else [first[name]] for name in functions}
    for turn in range(ROUNDS):
        for name, function in functions.items():
            for _ in range(wanted[name] * (turn + 1) // ROUNDS - wanted[name] * turn // ROUNDS):
                times[name].append(seconds(function))
    return {name: float(np.median(taken)) for name, taken in times.items()}

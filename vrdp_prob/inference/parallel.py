"""Work on many items side by side, and which threads it has."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache, wraps
from typing import ParamSpec, TypeVar

from threadpoolctl import ThreadpoolController

Item = TypeVar("Item")
Result = TypeVar("Result")
Arguments = ParamSpec("Arguments")


def in_parallel(task: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """Results of a task, one thread per processor; the simulator lets threads run side by side."""
    with (
        _linear_algebra().limit(limits=1),
        ThreadPoolExecutor(max_workers=max(1, min(len(items), os.cpu_count() or 1))) as workers,
    ):
        return list(workers.map(task, items))


def linear_algebra_in_one_thread(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """A function during which linear algebra keeps to the thread that asks for it.

    Matrices are small here, and what runs side by side has threads of its own: on two processors those of the linear
    algebra, waiting for one another, took 2 of the 4.7 processor minutes of a search of six videos for causes.
    """

    @wraps(function)
    def limited(*arguments: Arguments.args, **options: Arguments.kwargs) -> Result:
        with _linear_algebra().limit(limits=1):
            return function(*arguments, **options)

    return limited


@cache
def _linear_algebra() -> ThreadpoolController:
    return ThreadpoolController()

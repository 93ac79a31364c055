"""Work on many items side by side: in threads what takes milliseconds, in processes what takes seconds."""

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache, wraps
from typing import ParamSpec, TypeVar

from threadpoolctl import ThreadpoolController

from vrdp_prob.inference.runs.journal import Step, in_a_step
from vrdp_prob.progress import Advance
from vrdp_prob.workers import check_processes, local_workers

Item = TypeVar("Item")
Result = TypeVar("Result")
Arguments = ParamSpec("Arguments")

_workers: ContextVar[Executor | None] = ContextVar("_workers", default=None)
_alone: ContextVar[bool] = ContextVar("_alone", default=False)
"""Whether this is one of several processes, which then has no threads."""


@contextmanager
def several_processes(count: int | None) -> Iterator[None]:
    """Processes for `in_processes`, as many as there are cores where None; they end with the block.

    Python code of threads waits for one another: a search for causes is no faster in two threads than in one.

    Parameters
    ----------
    count
        Number of processes. With 1 everything stays in this one.
    """
    check_processes(count)
    number = count or os.cpu_count() or 1
    if number == 1 or _alone.get():
        yield
        return
    with local_workers(number, tasks=number) as workers:
        token = _workers.set(workers)
        try:
            yield
        finally:
            _workers.reset(token)


def in_processes(
    task: Callable[[Item], Result], items: Sequence[Item], *, advance: Advance | None = None
) -> list[Result]:
    """Results of a task, each made in one of `several_processes`; in threads where there are none.

    Each is a step of a run that keeps a journal.

    Parameters
    ----------
    task
        Makes a result. It and what it holds are sent to the processes, so that results hold copies of it.
    items
        What it makes them of.
    advance
        Told of each result.
    """
    with in_a_step() as journal:
        if journal is None:
            return _made(task, items, advance)
        steps = [journal.step(task, item) for item in items]
        found = [one.read() for one in steps]
        missing = [step for step, one in zip(steps, found, strict=True) if one is None]
        if advance is not None and len(missing) < len(steps):
            advance(len(steps) - len(missing))
        made = iter(_made(Step.make, missing, advance))
        return [next(made) if one is None else one[0] for one in found]


def _made(task: Callable[[Item], Result], items: Sequence[Item], advance: Advance | None) -> list[Result]:
    workers = _workers.get()
    if workers is None or len(items) < 2:
        return in_parallel(_told(task, advance), items)
    found = []
    for future in [workers.submit(_made_alone, task, item) for item in items]:
        found.append(future.result())
        if advance is not None:
            advance(1)
    return found


def in_parallel(task: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """Results of a task, one thread per processor; the simulator lets threads run side by side."""
    threads = 1 if _alone.get() else min(len(items), os.cpu_count() or 1)
    if threads < 2:
        return [task(item) for item in items]
    with _linear_algebra().limit(limits=1), ThreadPoolExecutor(max_workers=threads) as workers:
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


def _told(task: Callable[[Item], Result], advance: Advance | None) -> Callable[[Item], Result]:
    def done(item: Item) -> Result:
        result = task(item)
        if advance is not None:
            advance(1)
        return result

    return done


@linear_algebra_in_one_thread
def _made_alone(task: Callable[[Item], Result], item: Item) -> Result:
    """A result made in a process of its own."""
    token = _alone.set(True)
    try:
        return task(item)
    finally:
        _alone.reset(token)


@cache
def _linear_algebra() -> ThreadpoolController:
    return ThreadpoolController()

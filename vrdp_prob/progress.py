"""How long work tells that it goes on: a bar with the time left in a terminal, a line now and then in a log."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from threading import Event, Lock, Thread
from typing import Protocol, runtime_checkable

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

Advance = Callable[[float], None]

AT_ONCE = 1.0
"""Seconds within which steps are reported that were done before."""
SHORTEST = 0.1
"""Seconds between two looks at a stage in which no step is done."""


@runtime_checkable
class ProgressDisplay(Protocol):
    """Whoever wants to follow long work implements this one method."""

    def stage(self, description: str, total: float | None = None) -> AbstractContextManager[Advance]:
        """Open a stage of work, which gives the function that reports finished steps.

        Parameters
        ----------
        description
            What is done, in a few words.
        total
            Number of steps, None where it is not known beforehand.
        """
        ...


class SilentProgress:
    """Tells nothing."""

    @contextmanager
    def stage(self, description: str, total: float | None = None) -> Iterator[Advance]:
        """Open a stage that nobody follows."""
        del description, total
        yield lambda _steps: None


class TerminalProgress:
    """One bar per stage with the time left, on standard error; the finished bars stay to be read.

    Parameters
    ----------
    console
        Where to draw; standard error by default.
    """

    def __init__(self, console: Console | None = None) -> None:
        self._console = console or Console(stderr=True)

    @contextmanager
    def stage(self, description: str, total: float | None = None) -> Iterator[Advance]:
        """Open a stage drawn as a bar."""
        columns = (
            TextColumn("{task.description:<34}"),
            BarColumn(bar_width=24),
            TaskProgressColumn(),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
        )
        with Progress(*columns, console=self._console) as progress:
            task = progress.add_task(description, total=total)
            yield lambda steps: progress.advance(task, steps)
            if total is None:
                progress.update(task, total=1, completed=1)
            else:
                progress.update(task, completed=total)


class LogProgress:
    """A line on standard error now and then, while steps are done and while none is; short stages tell nothing.

    Parameters
    ----------
    every
        Seconds between two lines at least.
    clock
        Tells the time in seconds.
    """

    def __init__(self, every: float = 30.0, clock: Callable[[], float] = time.monotonic) -> None:
        self._every = every
        self._clock = clock

    @contextmanager
    def stage(self, description: str, total: float | None = None) -> Iterator[Advance]:
        """Open a stage told in lines."""
        begin = told = self._clock()
        done = kept = 0.0
        one_at_a_time, ended = Lock(), Event()

        def advance(steps: float) -> None:
            nonlocal done, kept, told
            with one_at_a_time:
                done += steps
                now = self._clock()
                if now - begin < AT_ONCE:
                    kept = done
                if now - told >= self._every:
                    told = now
                    print(_line(description, done, kept, total, now - begin), file=sys.stderr, flush=True)

        def go_on() -> None:
            while not ended.wait(max(self._every, SHORTEST)):
                advance(0)

        going_on = Thread(target=go_on, daemon=True)
        going_on.start()
        try:
            yield advance
        finally:
            ended.set()
            going_on.join()


def _line(description: str, done: float, kept: float, total: float | None, seconds: float) -> str:
    """How far a stage is; what was there when it began says nothing of the time that is left."""
    if not total:
        steps = f"{done:.0f} steps in " if done else ""
        return f"{description}: {steps}{seconds:.0f} s"
    left = f", about {seconds * (total - done) / (done - kept):.0f} s left" if kept < done < total else ""
    return f"{description}: {done:.0f} of {total:.0f} in {seconds:.0f} s{left}"


def progress_display(*, quiet: bool) -> ProgressDisplay:
    """Nothing where somebody asked for quiet; bars where standard error is a terminal, lines elsewhere."""
    if quiet:
        return SilentProgress()
    console = Console(stderr=True)
    return TerminalProgress(console) if console.is_terminal else LogProgress()

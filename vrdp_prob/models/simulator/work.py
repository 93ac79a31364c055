"""How much a simulation had to do, counted in something that is the same on every machine.

The unit is one row of the kernel's record, a piece of motion of one body or one event; a derivative counts the rows
once more. Time on one machine is about proportional to it; worlds in which bodies press on each other have a hundred
times as many rows as others.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass


@dataclass
class WorkMeter:
    """What all simulations of the calling thread have done since it was put up.

    Parameters
    ----------
    rows
        Pieces of motion and events.
    """

    rows: int = 0


_meter: ContextVar[WorkMeter | None] = ContextVar("work_meter", default=None)


@contextmanager
def metered() -> Iterator[WorkMeter]:
    """Count the work of the simulations in a block; a meter around another one counts its work too."""
    outer, meter = _meter.get(), WorkMeter()
    token = _meter.set(meter)
    try:
        yield meter
    finally:
        _meter.reset(token)
        if outer is not None:
            outer.rows += meter.rows


def record_work(rows: int) -> None:
    """Add to the meter of the calling thread, where there is one."""
    meter = _meter.get()
    if meter is not None:
        meter.rows += rows


def work_sentence(limit: int) -> str:
    """What to say where sampling stopped at a limit of work."""
    return f"It stopped at its budget of simulated work ({limit:.3g} pieces of motion and events)."

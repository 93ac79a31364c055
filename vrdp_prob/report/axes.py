"""Horizontal axes of the pages' figures: where a value stands, in per cent of the width, and which ticks there are."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from vrdp_prob.inference.draws.summaries import Summary


@dataclass(frozen=True)
class Axis:
    """A horizontal axis for intervals; places on it are percentages of its width.

    Parameters
    ----------
    low, high
        Its ends.
    logarithmic
        Whether equal ratios are equal lengths.
    ticks
        Values with a label.
    """

    low: float
    high: float
    logarithmic: bool
    ticks: tuple[float, ...]

    def place(self, value: float) -> float:
        """Percentage of the width at which a value stands; values beyond an end stand at that end."""
        low, high, at = self.low, self.high, min(max(value, self.low), self.high)
        if self.logarithmic:
            low, high, at = math.log(low), math.log(high), math.log(at)
        return round(100 * (at - low) / (high - low), 2)


_LOG_TICKS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)


def log_axis(intervals: Sequence[Summary]) -> Axis:
    """A logarithmic axis that holds all intervals and 1, with ticks at 1, 2 and 5 times powers of ten."""
    low = max(min([0.5, *(interval.q05 for interval in intervals)]) * 0.9, 1e-3)
    high = min(max([2.0, *(interval.q95 for interval in intervals)]) * 1.1, 1e3)
    return Axis(low, high, True, tuple(tick for tick in _LOG_TICKS if low <= tick <= high))


def unit_axis(intervals: Sequence[Summary]) -> Axis:
    """A linear axis from 0 to 1, longer where an interval needs it."""
    high = max([1.0, *(min(interval.q95, 3.0) for interval in intervals)])
    return Axis(0.0, high, False, (0.0, 0.25, 0.5, 0.75, 1.0))


MANY_TIMES = 30.0
"""Ratio of the largest to the smallest size beyond which an axis of sizes is logarithmic."""


def linear_axis(values: Iterable[float]) -> Axis:
    """A linear axis that holds all values and 0, with two to seven round ticks."""
    shown = [0.0, *values]
    low, high = min(shown), max(shown)
    if low == high:
        return Axis(-1.0, 1.0, False, (-1.0, 0.0, 1.0))
    room, step = 0.03 * (high - low), _round_step((high - low) / 5)
    ticks = tuple(round(step * number, 12) for number in range(math.ceil(low / step), math.floor(high / step) + 1))
    return Axis(low - room if low < 0 else 0.0, high + room if high > 0 else 0.0, False, ticks)


def size_axis(values: Iterable[float]) -> Axis:
    """An axis for positive sizes: linear from 0, or logarithmic where some are many times as large as others."""
    sizes = [value for value in values if value > 0]
    if not sizes or max(sizes) < MANY_TIMES * min(sizes):
        return linear_axis(sizes)
    first, last = math.floor(math.log10(min(sizes))), math.ceil(math.log10(max(sizes)))
    step = math.ceil((last - first) / 4)
    return Axis(10.0**first, 10.0**last, True, tuple(10.0**power for power in range(first, last + 1, step)))


def _round_step(least: float) -> float:
    """The smallest of 1, 2, 5 times a power of ten that is not below a number."""
    power = 10.0 ** math.floor(math.log10(least))
    return next(step for factor in (1, 2, 5, 10) if (step := factor * power) >= least * (1 - 1e-9))

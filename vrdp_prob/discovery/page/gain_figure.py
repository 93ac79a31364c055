"""Geometry of the figures of a gain: error in left-out videos before and after, and elpd differences by video."""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from vrdp_prob.discovery.finding import Gain
from vrdp_prob.discovery.page.wording import length_unit, number, signed
from vrdp_prob.report.axes import Axis, linear_axis, size_axis

STRETCHES = {"rmse": "all frames", "rmse_one_second": "1 s ahead", "rmse_end": "last frames"}
"""Where errors are told of, by the name of their field."""
MOST_ROWS = 20
"""Videos that have a row each; more are stacked."""
STACKS = 50
"""Places for stacks of dots side by side."""
DOT = 8.0
"""Room of a dot in a stack, in pixels; less where stacks are high."""
HIGHEST = 180.0
"""Height of the highest stack, in pixels."""


@dataclass(frozen=True)
class Change:
    """An error before and after.

    Parameters
    ----------
    label
        Where the error is.
    before, after
        Places in per cent of the width; None where there is no number.
    words
        Both as text.
    """

    label: str
    before: float | None
    after: float | None
    words: str


@dataclass(frozen=True)
class ErrorFigure:
    """Errors before and after, of every gain; `noise` is the place of the measurement noise, None where not known."""

    axis: Axis
    unit: str
    noise: float | None
    noise_words: str
    gains: list[tuple[str, list[Change]]]


@dataclass(frozen=True)
class Dot:
    """The elpd difference of a video: its place in per cent of the width, its height in pixels, and its words."""

    video: str
    x: float
    y: float
    is_worse: bool
    words: str


@dataclass(frozen=True)
class VideoFigure:
    """Elpd differences of videos, in rows or (`height` pixels high) in stacks."""

    axis: Axis
    zero: float
    dots: list[Dot]
    in_rows: bool
    height: float
    size: float
    label: str


def error_figure(gains: Sequence[tuple[str, Gain]]) -> ErrorFigure:
    """Held-out errors with and without what some gains are of, on one axis."""
    lengths = [length for _, gain in gains for length in (*_errors(gain), gain.noise) if _is_size(length)]
    factor, unit = length_unit(lengths)
    axis = size_axis(factor * length for length in lengths)
    noise = gains[-1][1].noise
    return ErrorFigure(
        axis,
        unit,
        axis.place(factor * noise) if _is_size(noise) and noise > 0 else None,
        f"{number(factor * noise)} {unit}",
        [(words, _changes(gain, axis, factor)) for words, gain in gains],
    )


def _errors(gain: Gain) -> Iterator[float]:
    for predicted in (gain.before, gain.after):
        yield from (error for name in STRETCHES if (error := getattr(predicted, name)) is not None)


def _is_size(length: float) -> bool:
    return math.isfinite(length) and length >= 0


def _changes(gain: Gain, axis: Axis, factor: float) -> list[Change]:
    changes = []
    for name, label in STRETCHES.items():
        before, after = getattr(gain.before, name), getattr(gain.after, name)
        if before is not None and after is not None:
            words = f"{number(factor * before)} → {number(factor * after)}"
            changes.append(Change(label, _place(axis, factor * before), _place(axis, factor * after), words))
    return changes


def _place(axis: Axis, value: float) -> float | None:
    return None if math.isnan(value) else axis.place(value)


def video_figure(gain: Gain) -> VideoFigure:
    """Elpd differences of the single videos: a row for each, the largest first, or stacks where there are many."""
    shown = sorted(gain.by_video.items(), key=lambda item: -item[1] if not math.isnan(item[1]) else math.inf)
    finite = {video: difference for video, difference in shown if math.isfinite(difference)}
    axis = linear_axis(finite.values())
    in_rows = len(shown) <= MOST_ROWS
    dots, size = _rows(dict(shown), axis) if in_rows else _stacks(finite, axis)
    better = sum(difference > 0 for _, difference in shown)
    return VideoFigure(
        axis,
        axis.place(0.0),
        dots,
        in_rows,
        max((dot.y for dot in dots), default=0.0) + DOT,
        size,
        f"{better} of {len(shown)} videos are predicted better",
    )


def _rows(differences: Mapping[str, float], axis: Axis) -> tuple[list[Dot], float]:
    finite = [abs(difference) for difference in differences.values() if math.isfinite(difference)]
    precision = max(finite, default=1.0) / 10
    return [
        Dot(video, _place(axis, difference) or 0.0, 0.0, not difference > 0, signed(difference, precision))
        for video, difference in differences.items()
    ], DOT


def _stacks(differences: Mapping[str, float], axis: Axis) -> tuple[list[Dot], float]:
    stack_of = {video: round(axis.place(value) * STACKS / 100) for video, value in differences.items()}
    size = min(DOT, HIGHEST / max(Counter(stack_of.values()).values(), default=1))
    height: Counter[int] = Counter()
    dots = []
    for video, stack in stack_of.items():
        words = f"{video}: {signed(differences[video])}"
        dots.append(Dot(video, 100 * stack / STACKS, size * height[stack], not differences[video] > 0, words))
        height[stack] += 1
    return dots, size

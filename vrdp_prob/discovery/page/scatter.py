"""Numbers with what chance makes of them: with bars, or beside the grey band of what noise alone leaves."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from vrdp_prob.discovery.normal import WITHIN_95
from vrdp_prob.discovery.page.plots import Plot, side_by_side
from vrdp_prob.discovery.page.seen import Seen
from vrdp_prob.report.axes import Axis, linear_axis

UNUSUAL = 3.0
"""Bars so many times as long as usual may end outside of the axes."""
ASIDE = 0.16
"""How far apart the numbers of two fits stand at one name."""
WIDTH = 360
"""Width in pixels of one of several plots beside each other."""
GREY = "grey: the middle 95 % of what noise leaves."


@dataclass(frozen=True)
class Points:
    """Numbers that are known with some standard deviation.

    Parameters
    ----------
    at
        Against what they are drawn.
    value, sd
        The numbers and their standard deviations; nothing is known of those where this is 0 or not finite.
    """

    at: Float[np.ndarray, "point"]
    value: Float[np.ndarray, "point"]
    sd: Float[np.ndarray, "point"]

    def __len__(self) -> int:
        return len(self.at)

    @property
    def known(self) -> "Points":
        """Those of which something is known."""
        keep = np.isfinite(self.at) & np.isfinite(self.value) & np.isfinite(self.sd) & (self.sd > 0)
        return Points(self.at[keep], self.value[keep], self.sd[keep])

    @property
    def usual(self) -> Bool[np.ndarray, "point"]:
        """Which are known about as well as most; others would stretch the axes."""
        return np.asarray(self.sd <= UNUSUAL * np.median(self.sd)) if len(self.sd) else np.zeros(0, dtype=bool)


def with_bars(
    seen: Sequence[Seen],
    plots: Mapping[str, Sequence[Points]],
    labels: tuple[str, str],
    words: str,
    *,
    level: float = 0.0,
    names: Sequence[str] = (),
) -> str:
    """Numbers of all fits with bars of one standard deviation, in plots beside each other that share their heights.

    Parameters
    ----------
    seen
        The fits.
    plots
        By the title of each plot, or by what it is against if that has a unit, the numbers of each fit.
    labels
        Against what, where titles do not say so, and what the numbers are, with units.
    words
        What the figure shows.
    level
        What the numbers would be if nothing were missing.
    names
        Names of 0, 1, 2... on the horizontal axis.

    Returns
    -------
    An SVG element; empty if there is nothing to draw.
    """
    known = {title: [one.known for one in points] for title, points in plots.items()}
    ends = [level]
    for points in known.values():
        for one in points:
            inside = one.usual
            ends += (one.value - one.sd)[inside].tolist() + (one.value + one.sd)[inside].tolist()
    if len(ends) == 1:
        return ""
    y = linear_axis(ends)
    drawn = []
    for title, points in known.items():
        x = _named_axis(names) if names else linear_axis(np.concatenate([one.at for one in points]).tolist())
        against = title if labels[0] == "" else labels[0]
        plot = Plot(x, y, against, labels[1], "" if against == title else title, width=WIDTH if len(plots) > 1 else 440)
        plot.x_names = dict(enumerate(names))
        plot.level(level)
        for place, (fit, mine) in enumerate(zip(seen, points, strict=True)):
            aside = ASIDE * (place - (len(seen) - 1) / 2) if names else 0.0
            for at, value, sd in zip(mine.at.tolist(), mine.value.tolist(), mine.sd.tolist(), strict=True):
                if y.low <= value <= y.high:
                    plot.point(at + aside, value, sd, fit.colour)
        drawn.append(plot)
    legend = [(one.name, one.colour) for one in seen]
    return side_by_side(drawn, f"{words} Bars: one standard deviation.", legend=legend)


def _named_axis(names: Sequence[str]) -> Axis:
    return Axis(-0.5, len(names) - 0.5, False, tuple(float(k) for k in range(len(names))))


@dataclass(frozen=True)
class Banded:
    """Numbers beside what noise alone leaves of them.

    Parameters
    ----------
    at, value
        Against what they are drawn, and the numbers.
    low, high
        Ends of the middle 95 % of what noise leaves.
    against
        Against what, in words with units, if each fit has its own.
    """

    at: Float[np.ndarray, "point"]
    value: Float[np.ndarray, "point"]
    low: Float[np.ndarray, "point"]
    high: Float[np.ndarray, "point"]
    against: str = ""

    @classmethod
    def about_nothing(
        cls,
        at: Float[np.ndarray, "point"],
        value: Float[np.ndarray, "point"],
        sd: Float[np.ndarray, "point"],
        against: str = "",
    ) -> "Banded":
        """Numbers that are 0 where nothing is wrong; without those that are known much worse than most."""
        keep = Points(at, value, sd).usual
        return cls(at[keep], value[keep], -WITHIN_95 * sd[keep], WITHIN_95 * sd[keep], against)


def with_bands(
    seen: Sequence[Seen],
    numbers: Sequence[Banded | None],
    labels: tuple[str, str],
    words: str,
    *,
    axes: tuple[Axis, Axis] | None = None,
    small: bool = False,
) -> str:
    """Numbers of each fit over the grey band of what noise leaves, side by side on the same axes.

    Parameters
    ----------
    seen
        The fits.
    numbers
        Those of each fit; None where it has none.
    labels
        Against what, and what the numbers are, with units.
    words
        What the figure shows.
    axes
        The axes; linear ones that hold everything where None.
    small
        Whether there are many numbers, so that dots have to be small.

    Returns
    -------
    An SVG element; empty if there is nothing to draw.
    """
    some = [(one, mine) for one, mine in zip(seen, numbers, strict=True) if mine is not None and len(mine.at)]
    if not some:
        return ""
    if axes is None:
        x = linear_axis(np.concatenate([mine.at for _, mine in some]).tolist())
        heights = [part for _, mine in some for part in (mine.value, mine.low, mine.high)]
        y = linear_axis(np.concatenate(heights).tolist())
        axes = x, y
    plots = []
    for one, mine in some:
        plot = Plot(*axes, mine.against or labels[0], labels[1], one.name, width=WIDTH)
        order = np.argsort(mine.at, kind="stable")
        plot.band(list(zip(*(part[order].tolist() for part in (mine.at, mine.low, mine.high)), strict=True)))
        plot.level(0.0)
        for at, value in zip(mine.at.tolist(), mine.value.tolist(), strict=True):
            plot.point(at, value, None, one.colour, small=small)
        plots.append(plot)
    return side_by_side(plots, f"{words} {GREY[0].upper()}{GREY[1:]}")

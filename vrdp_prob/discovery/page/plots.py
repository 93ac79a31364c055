"""Small plots as SVG elements in the colours of the page: axes, points with bars, lines, arrows."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape

from vrdp_prob.report.axes import Axis

LEFT, RIGHT, TOP, BOTTOM = 58, 12, 26, 40
"""Room around the axes in pixels."""
BEFORE, AFTER = "var(--c-ink2, #c45500)", "var(--c-ink1, #0072b2)"
"""Colours of the model that was given and of the extended one."""
INK, MUTED, LINE = "var(--ink, #1d2126)", "var(--muted, #5b6470)", "var(--line, #dde1e6)"
HEAD = 4.0
"""Length of an arrow's head in pixels."""


@dataclass
class Plot:
    """A pair of axes that is drawn on.

    Parameters
    ----------
    x, y
        The axes; places on them are percentages.
    x_label, y_label
        What they show, with units.
    title
        What stands above.
    width, height
        Size in pixels, with all labels.
    x_names
        Words that stand for ticks of the horizontal axis.
    """

    x: Axis
    y: Axis
    x_label: str
    y_label: str
    title: str = ""
    width: float = 440
    height: float = 250
    x_names: Mapping[float, str] = field(default_factory=dict)
    _marks: list[str] = field(default_factory=list)

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Pixels of a point."""
        across = LEFT + self.x.place(x) / 100 * (self.width - LEFT - RIGHT)
        down = self.height - BOTTOM - self.y.place(y) / 100 * (self.height - TOP - BOTTOM)
        return round(across, 1), round(down, 1)

    def point(
        self, x: float, y: float, sd: float | None, colour: str, *, faint: bool = False, small: bool = False
    ) -> None:
        """A dot, with a bar of one standard deviation to both sides."""
        u, v = self.at(x, y)
        opacity = 0.35 if faint else 1
        if sd is not None and math.isfinite(sd):
            low, high = self.at(x, y - sd)[1], self.at(x, y + sd)[1]
            self._marks.append(_line([(u, low), (u, high)], colour, 1.2, opacity))
        radius = 1.8 if faint or small else 3.2
        self._marks.append(f'<circle cx="{u}" cy="{v}" r="{radius}" style="fill:{colour};opacity:{opacity}"/>')

    def arrow(self, start: tuple[float, float], end: tuple[float, float], colour: str, *, faint: bool = False) -> None:
        """An arrow."""
        first, last = self.at(*start), self.at(*end)
        along = math.atan2(last[1] - first[1], last[0] - first[0])
        if math.dist(first, last) < 1:
            self._marks.append(f'<circle cx="{first[0]}" cy="{first[1]}" r="1.2" style="fill:{colour};opacity:0.6"/>')
            return
        wings = [
            (round(last[0] - HEAD * math.cos(along + turn), 1), round(last[1] - HEAD * math.sin(along + turn), 1))
            for turn in (0.5, -0.5)
        ]
        width, opacity = (1.0, 0.3) if faint else (1.8, 1.0)
        self._marks.append(
            _line([first, last], colour, width, opacity) + _line([wings[0], last, wings[1]], colour, width, opacity)
        )

    def level(self, y: float) -> None:
        """A thin line across at a height."""
        ends = [self.at(self.x.low, y), self.at(self.x.high, y)]
        self._marks.insert(0, _line(ends, MUTED, 1))

    def band(self, ends: Sequence[tuple[float, float, float]]) -> None:
        """A grey band between two heights, given at some places from left to right."""
        outline = [*((x, low) for x, low, _ in ends), *((x, high) for x, _, high in reversed(ends))]
        points = " ".join(f"{u:g},{v:g}" for u, v in (self.at(*point) for point in outline))
        self._marks.append(f'<polygon points="{points}" style="fill:{MUTED};opacity:0.2"/>')

    def note(self, x: float, y: float, text: str) -> None:
        """A few words."""
        u, v = self.at(x, y)
        self._marks.append(_text(u + 4, v + 4, text, MUTED))

    @property
    def element(self) -> str:
        """The group of SVG elements."""
        left, bottom, right = LEFT, self.height - BOTTOM, self.width - RIGHT
        parts = [_text(left, 14, self.title, INK, weight=600)] if self.title else []
        for tick in self.x.ticks:
            u, _ = self.at(tick, self.y.low)
            word = self.x_names.get(tick, f"{tick:g}")
            parts += [_line([(u, TOP), (u, bottom)], LINE, 1), _text(u, bottom + 14, word, MUTED, "middle")]
        for tick in self.y.ticks:
            _, v = self.at(self.x.low, tick)
            parts += [_line([(left, v), (right, v)], LINE, 1), _text(left - 5, v + 4, f"{tick:g}", MUTED, "end")]
        parts.append(_text((left + right) / 2, self.height - 8, self.x_label, INK, "middle"))
        middle = (TOP + bottom) / 2
        turned = f'transform="rotate(-90 12 {middle:g})"'
        parts.append(_text(12, middle, self.y_label, INK, "middle", more=turned))
        return "".join([*parts, *self._marks])


def side_by_side(plots: Sequence[Plot], words: str, *, legend: Sequence[tuple[str, str]] = ()) -> str:
    """Plots beside each other as one SVG element, which `words` describe; the legend names colours."""
    width = sum(plot.width for plot in plots)
    foot = 22 if legend else 0
    height = max(plot.height for plot in plots) + foot
    groups, start = [], 0.0
    for plot in plots:
        groups.append(f'<g transform="translate({start:g} 0)">{plot.element}</g>')
        start += plot.width
    place = float(LEFT)
    for name, colour in legend:
        groups.append(f'<circle cx="{place:g}" cy="{height - 9:g}" r="4" style="fill:{colour}"/>')
        groups.append(_text(place + 8, height - 5, name, INK))
        place += 30 + 6.2 * len(name)
    return (
        f'<svg class="themed" xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" '
        f'width="{width:g}" height="{height:g}" role="img" aria-label="{escape(words, quote=True)}" '
        f'font-family="system-ui, sans-serif" font-size="11">{"".join(groups)}</svg>'
    )


def _line(points: Sequence[tuple[float, float]], colour: str, width: float, opacity: float = 1) -> str:
    path = " ".join(f"{u:g},{v:g}" for u, v in points)
    return f'<polyline points="{path}" style="fill:none;stroke:{colour};stroke-width:{width};opacity:{opacity}"/>'


def _text(
    u: float, v: float, text: str, colour: str, anchor: str = "start", *, weight: int = 400, more: str = ""
) -> str:
    style = f"fill:{colour};font-weight:{weight}"
    return f'<text x="{u:g}" y="{v:g}" text-anchor="{anchor}" style="{style}" {more}>{escape(text)}</text>'

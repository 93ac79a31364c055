"""Tables and figures of the benchmark of the simulator."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator


class Race(NamedTuple):
    """Milliseconds per world of one peer, and the seconds that were needed to compile it, where that was measured."""

    name: str
    size: int
    peer: str
    milliseconds: float
    compile_seconds: float | None


class Cost(NamedTuple):
    """Milliseconds per world for one number of bodies or worlds."""

    varied: int
    contacts: float
    forward: float
    gradient: float


class Memory(NamedTuple):
    """MiB at the peak of one evaluation."""

    peer: str
    worlds: int
    discs: float | None
    mixed: float | None


class Gap(NamedTuple):
    """Distance in m between positions of the fixed-step and the event-driven simulator."""

    name: str
    scenes: int
    mean: float
    most: float


Costs = Mapping[str, Sequence[Cost]]


def number(value: object) -> str:
    """A number with three digits, or a dash."""
    if not isinstance(value, float):
        return "-" if value is None else str(value)
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"


def table(head: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """A table in Markdown with aligned columns."""
    cells = [list(head), *[[number(value) for value in row] for row in rows]]
    widths = [max(len(row[column]) for row in cells) for column in range(len(head))]
    lines = [
        "| " + " | ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) + " |" for row in cells
    ]
    return "\n".join([lines[0], "|" + "|".join("-" * (width + 2) for width in widths) + "|", *lines[1:]])


def page(
    *,
    races: Sequence[Race],
    by_bodies: Costs,
    by_worlds: Costs,
    memories: Sequence[Memory],
    gaps: Sequence[Gap],
    checks: Sequence[Mapping[str, object]],
) -> str:
    """All tables."""
    parts = ["### Log density and gradient, ms per world", _race_table(races), "### Goals", _check_table(checks)]
    for title, costs, varied in (
        ("### Cost against the number of bodies, 16 worlds", by_bodies, "bodies"),
        ("### Cost against the number of worlds, 5 bodies", by_worlds, "worlds"),
    ):
        parts += [title, _cost_table(costs, varied)]
    head = ("simulator", "worlds", "discs, MiB", "mixed shapes, MiB")
    parts += ["### Memory of one evaluation at its peak", table(head, memories)]
    head = ("scenes with at most one contact", "number", "mean difference, m", "largest, m")
    parts += ["### Fixed steps against events: positions", table(head, gaps)]
    return "\n\n".join(parts)


def _race_table(races: Sequence[Race]) -> str:
    rows = []
    for race in races:
        own = next(other for other in races if other[:2] == race[:2])
        rows.append(
            (
                race.name,
                race.size,
                race.peer,
                race.milliseconds,
                race.milliseconds / own.milliseconds,
                race.compile_seconds,
            )
        )
    return table(("scenes", "worlds", "simulator", "ms per world", "times ours", "compilation, s"), rows)


def _check_table(checks: Sequence[Mapping[str, object]]) -> str:
    rows = [(check["name"], check["value"], check["goal"], "yes" if check["ok"] else "no") for check in checks]
    return table(("check", "measured", "goal", "reached"), rows)


def _cost_table(costs: Costs, varied: str) -> str:
    head = [varied]
    for name in costs:
        head += [f"{name}: contacts per world", f"{name}: forward, ms", f"{name}: with gradient, ms"]
    rows = [
        [entries[0].varied, *(value for entry in entries for value in entry[1:])]
        for entries in zip(*costs.values(), strict=True)
    ]
    return table(head, rows)


COLOURS = {"discs": "#1b6ca8", "mixed shapes": "#c8553d"}


def figures(by_bodies: Costs, by_worlds: Costs, folder: Path) -> None:
    """Write `simulator-cost-bodies.png` and `simulator-cost-worlds.png`."""
    folder.mkdir(parents=True, exist_ok=True)
    figure, axes = plt.subplots(figsize=(6.4, 4.2), layout="constrained")
    _draw(axes, by_bodies)
    axes.set_xlabel("bodies, at constant density")
    figure.savefig(folder / "simulator-cost-bodies.png", dpi=144)
    plt.close(figure)
    figure, axes = plt.subplots(figsize=(6.4, 4.2), layout="constrained")
    _draw(axes, by_worlds)
    axes.set_xlabel("worlds in one call, 5 bodies each")
    figure.savefig(folder / "simulator-cost-worlds.png", dpi=144)
    plt.close(figure)


def _draw(axes: Axes, costs: Costs) -> None:
    for name, entries in costs.items():
        at = [entry.varied for entry in entries]
        axes.loglog(
            at, [entry.gradient for entry in entries], "o-", color=COLOURS[name], label=f"{name}, with gradient"
        )
        axes.loglog(
            at, [entry.forward for entry in entries], "o--", color=COLOURS[name], mfc="white", label=f"{name}, forward"
        )
    axes.set_xticks(at, [str(value) for value in at])
    axes.minorticks_off()
    axes.set_ylabel("ms per world (128 frames, one thread)")
    axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.yaxis.set_major_formatter("{x:g}")
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)

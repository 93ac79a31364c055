"""Missing accelerations window by window: over the plane, against speed and against time."""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float

from vrdp_prob.discovery.page.plots import Plot, side_by_side
from vrdp_prob.discovery.page.seen import Seen
from vrdp_prob.discovery.residuals.missing_acceleration import Windows
from vrdp_prob.discovery.words import number
from vrdp_prob.report.axes import Axis, linear_axis

BINS = 6
"""Groups of windows whose means are drawn."""
CELLS, FEWEST = 8, 3
"""Cells of the map along each side, and windows in a cell for its mean to be drawn."""
LONGEST_ARROW = 0.15
"""Length of the longest arrow as a share of the width of the map."""

Aspect = Callable[[Windows], Float[np.ndarray, "window"]]


def acceleration_map(seen: Sequence[Seen]) -> str:
    """Missing accelerations at places of the plane."""
    seen = [one for one in seen if len(one.windows.time)]
    if not seen:
        return ""
    places = np.concatenate([one.windows.position for one in seen])
    x, y = _square_axes(places)
    largest = max(float(np.quantile(np.linalg.norm(one.windows.acceleration, axis=1), 0.95)) for one in seen)
    scale = LONGEST_ARROW * (x.high - x.low) / largest if largest > 0 else 0.0
    plots = []
    for one in seen:
        plot = Plot(x, y, "x (m)", "y (m)", one.name, width=360, height=360 - 58 - 12 + 26 + 40)
        arrows = [(one.windows.position, one.windows.acceleration, True), (*_cell_means(one.windows, x, y), False)]
        for places, accelerations, faint in arrows:
            for (u, v), (along, up) in zip(places.tolist(), accelerations.tolist(), strict=True):
                plot.arrow((u, v), (u + scale * along, v + scale * up), one.colour, faint=faint)
        plots.append(plot)
    key = _round(largest)
    if key > 0:
        start, height = x.low + 0.03 * (x.high - x.low), y.low + 0.05 * (y.high - y.low)
        plots[0].arrow((start, height), (start + scale * key, height), "var(--ink, #1d2126)")
        plots[0].note(start + scale * key, height, f"{key:g} m/s²")
    sizes = ", ".join(f"{one.name}: {number(float(np.sqrt(2)) * one.windows.size)} m/s²" for one in seen)
    return side_by_side(plots, f"Missing acceleration at places of the plane (root mean square; {sizes}).")


def _cell_means(windows: Windows, x: Axis, y: Axis) -> tuple[Float[np.ndarray, "cell 2"], Float[np.ndarray, "cell 2"]]:
    """Mean places and accelerations of the windows in each cell of the plane that has some."""
    low, high = np.array([x.low, y.low]), np.array([x.high, y.high])
    cells = np.floor((windows.position - low) / (high - low) * CELLS) @ np.array([CELLS, 1])
    groups = [np.flatnonzero(cells == cell) for cell in np.unique(cells)]
    full = [group for group in groups if len(group) >= FEWEST]
    places, sizes = (
        np.array([values[group].mean(axis=0) for group in full]).reshape(-1, 2)
        for values in (windows.position, windows.acceleration)
    )
    return places, sizes


def acceleration_curves(seen: Sequence[Seen], label: str, values: Aspect) -> str:
    """Missing accelerations along and across the velocity, against something that `label` names with its unit."""
    seen = [one for one in seen if len(one.windows.time)]
    if not seen:
        return ""
    x = linear_axis(np.concatenate([values(one.windows) for one in seen]).tolist())
    parts: tuple[tuple[str, Aspect], ...] = (
        ("along the velocity", lambda windows: windows.along),
        ("to the left of the velocity", lambda windows: windows.across),
    )
    heights = np.concatenate([part(one.windows) for one in seen for _, part in parts])
    y = linear_axis([float(np.quantile(heights, 0.01)), float(np.quantile(heights, 0.99))])
    plots = []
    for name, part in parts:
        plot = Plot(x, y, label, "m/s²", name, width=360)
        plot.level(0.0)
        for one in seen:
            at, size = values(one.windows), part(one.windows)
            for k in range(len(at)):
                if y.low <= size[k] <= y.high:
                    plot.point(float(at[k]), float(size[k]), None, one.colour, faint=True)
        for one in seen:
            for group in np.array_split(np.argsort(values(one.windows)), min(BINS, len(one.windows.time))):
                mean, spread = float(part(one.windows)[group].mean()), float(part(one.windows)[group].std())
                plot.point(float(values(one.windows)[group].mean()), mean, spread / np.sqrt(len(group)), one.colour)
        plots.append(plot)
    words = f"Missing acceleration along and across the velocity against {label}: windows, and means of groups of them."
    return side_by_side(plots, words, legend=[(one.name, one.colour) for one in seen])


def _square_axes(places: Float[np.ndarray, "place 2"]) -> tuple[Axis, Axis]:
    """Axes of one scale that hold all places."""
    low, high = places.min(axis=0), places.max(axis=0)
    half = 0.6 * max(float((high - low).max()), 1e-3)
    axes = []
    for middle in ((low + high) / 2).tolist():
        ticks = linear_axis([middle - half, middle + half]).ticks
        shown = tuple(tick for tick in ticks if middle - half <= tick <= middle + half)
        axes.append(Axis(middle - half, middle + half, False, shown))
    return axes[0], axes[1]


def _round(value: float) -> float:
    """One significant figure."""
    return float(f"{value:.0e}") if value > 0 else 0.0

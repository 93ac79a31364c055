"""What a model misses, drawn: over the plane, against speed and time, and at contacts; before and after extension."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from vrdp_prob.discovery.checks.bodies import Rebounds
from vrdp_prob.discovery.checks.contacts import Rubbing, rubbing
from vrdp_prob.discovery.checks.measurement import roughness
from vrdp_prob.discovery.page.plots import AFTER, BEFORE, Plot, side_by_side
from vrdp_prob.discovery.page.residual_panels import Remainder, panels
from vrdp_prob.discovery.residuals.fitted_contacts import FittedContacts
from vrdp_prob.discovery.residuals.free_flight import FreeFlight
from vrdp_prob.discovery.residuals.missing_acceleration import Windows, missing_acceleration
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.discovery.words import number
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.report.axes import Axis, linear_axis

BINS = 6
"""Groups of windows whose means are drawn."""
CELLS, FEWEST = 8, 3
"""Cells of the map along each side, and windows in a cell for its mean to be drawn."""
UNUSUAL = 3.0
"""Bars so many times as long as usual may end outside of the axes."""
LONGEST_ARROW = 0.15
"""Length of the longest arrow as a share of the width of the map."""
NAMES = ("the model that was given", "the extended model")

Aspect = Callable[[Windows], Float[np.ndarray, "window"]]


@dataclass(frozen=True)
class _Seen:
    """What is drawn of one fit."""

    windows: Windows
    rebounds: Rebounds
    rubbing: Rubbing
    remainder: Remainder
    colour: str
    name: str

    @classmethod
    def of(cls, fit: SharedFit, colour: str, name: str) -> "_Seen":
        model = ResidualModel.of(fit)
        flight = FreeFlight.of(model)
        contacts = [FittedContacts.of(video.motion) for video in model.videos]
        windows = missing_acceleration(flight.model, roughness(model))
        rubbed = rubbing(model, flight, contacts)
        return cls(windows, Rebounds.of(fit, contacts), rubbed, Remainder(model, colour, name), colour, name)


def residual_figures(before: SharedFit, after: SharedFit | None, *, failing: Collection[str] = ()) -> dict[str, str]:
    """Figures of what a model misses, and of what is left when it is extended.

    Parameters
    ----------
    before
        Fit of the model that was given.
    after
        Fit of the extended model; None where nothing was added.
    failing
        Names of the checks that fail: some have a figure of their own.

    Returns
    -------
    SVG elements by their titles, in the colours of the page that they stand in.
    """
    fits = [(before, BEFORE, NAMES[0])] + ([(after, AFTER, NAMES[1])] if after is not None else [])
    seen = [_Seen.of(*one) for one in fits]
    figures = {}
    if all(len(one.windows.time) for one in seen):
        figures["Missing acceleration over the plane"] = _map(seen)
        figures["Missing acceleration against speed"] = _curves(seen, "speed (m/s)", lambda w: w.speed)
        figures["Missing acceleration against time"] = _curves(seen, "time (s)", lambda w: w.time)
    if all(len(one.rebounds.logarithm) > 1 for one in seen):
        figures["Restitution against approach speed"] = _restitution(seen)
    if all(len(one.rubbing.normal) > 1 for one in seen):
        figures["Tangential against normal impulse"] = _impulses(seen)
    return figures | panels([one.remainder for one in seen], failing)


def _map(seen: Sequence[_Seen]) -> str:
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


def _curves(seen: Sequence[_Seen], label: str, values: Aspect) -> str:
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
    return side_by_side(plots, words, legend=_legend(seen))


def _restitution(seen: Sequence[_Seen]) -> str:
    x = linear_axis(np.concatenate([one.rebounds.closing_speed for one in seen]).tolist())
    factors = [np.exp(one.rebounds.logarithm) for one in seen]
    spreads = [factor * np.sqrt(np.diag(one.rebounds.covariance)) for factor, one in zip(factors, seen, strict=True)]
    y = linear_axis([1.0, *np.concatenate([f + s for f, s in zip(factors, spreads, strict=True)]).tolist()])
    plot = Plot(x, y, "approach speed (m/s)", "restitution, r₁ r₂")
    plot.level(1.0)
    for one, factor, spread in zip(seen, factors, spreads, strict=True):
        for k in range(len(factor)):
            plot.point(float(one.rebounds.closing_speed[k]), float(factor[k]), float(spread[k]), one.colour)
    words = "Fitted restitution of pairs of bodies against the speed at which they met."
    return side_by_side([plot], words, legend=_legend(seen))


def _impulses(seen: Sequence[_Seen]) -> str:
    x = linear_axis(np.concatenate([one.rubbing.normal for one in seen]).tolist())
    tangential = [one.rubbing.normal * one.rubbing.ratio for one in seen]
    sds = [one.rubbing.normal * one.rubbing.sd for one in seen]
    reach = [(t - s, t + s) for t, s in zip(tangential, sds, strict=True)]
    usual = [np.tile(s < UNUSUAL * np.median(s), 2) for s in sds]
    ends = np.concatenate([np.concatenate(both)[mine] for both, mine in zip(reach, usual, strict=True)])
    y = linear_axis(ends.tolist())
    plot = Plot(x, y, "normal impulse (kg m/s)", "tangential (kg m/s)")
    plot.level(0.0)
    for one, impulse in zip(seen, tangential, strict=True):
        for k in range(len(impulse)):
            sd = float(one.rubbing.normal[k] * one.rubbing.sd[k])
            plot.point(float(one.rubbing.normal[k]), float(impulse[k]), sd, one.colour)
    words = "Tangential impulse that the model misses at each contact, to the left of the normal, against the normal."
    return side_by_side([plot], words, legend=_legend(seen))


def _legend(seen: Sequence[_Seen]) -> list[tuple[str, str]]:
    return [(one.name, one.colour) for one in seen]


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

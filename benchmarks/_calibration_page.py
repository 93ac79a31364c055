"""Tables, figures and checks of the calibration."""

from collections import Counter
from collections.abc import Mapping, Sequence
from functools import cache
from itertools import zip_longest
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from _page import write_between
from _resumable import Result
from scipy.stats import binomtest

from tests.inference.linear_posterior import linear_errors
from tests.inference.prior_scenes import prior_scene
from tests.inference.rank_statistics import shares, simultaneous_band, uniformity
from tests.inference.scene_ranks import KINDS, LEVELS

Results = Mapping[str, Sequence[Result]]

INTERVALS = (0.5, 0.8, 0.95)
ERROR_RATE = 0.05
"""Probability with which a sampler that is calibrated would miss a goal by chance, over all kinds together."""
FEWEST = 10
"""Scenes below which nothing is said of a kind."""


class Calibration(NamedTuple):
    """Ranks of one kind of quantity, one per scene, and the probability that uniform ones deviate as much.

    `squared_error` is the mean squared difference of the posterior's mean from the truth, in its standard deviations;
    `by_chance` that of the exact posterior to first order, for the same quantities of the same scenes.
    """

    kind: str
    ranks: np.ndarray
    below: np.ndarray
    squared_error: float
    by_chance: float | None
    probability: float

    @property
    def coverage(self) -> list[float]:
        """Share of the scenes whose truth lies in the middle 50, 80 and 95 %."""
        return [float(np.mean(np.abs(self.below - 0.5) <= interval / 2)) for interval in INTERVALS]

    @property
    def within_error(self) -> list[bool]:
        """Whether each share is one that binomial chance explains (95 %)."""
        hits = [round(share * len(self.below)) for share in self.coverage]
        return [
            binomtest(one, len(self.below), interval).pvalue >= ERROR_RATE
            for one, interval in zip(hits, INTERVALS, strict=True)
        ]


def answered(results: Sequence[Result]) -> list[Result]:
    """Scenes for which there is a posterior."""
    return [result for result in results if "refused" not in result]


def groups(results: Sequence[Result]) -> dict[str, list[Result]]:
    """Scenes whose sampler says that it converged, and the others."""
    known = answered(results)
    return {
        "converged": [result for result in known if result["converged"]],
        "not converged": [result for result in known if not result["converged"]],
    }


def calibrations(results: Sequence[Result]) -> list[Calibration]:
    """One quantity of each kind and scene, chosen by lot, so that all are independent."""
    found = []
    for kind in KINDS:
        drawn = {int(result["seed"]): _one(result, kind) for result in results}
        chosen = list(drawn.values())
        ranks = np.array([one["rank"] for one in chosen if one], dtype=int)
        below = np.array([one["below"] for one in chosen if one])
        errors = np.array([one["error"] for one in chosen if one and one["error"] is not None])
        if len(ranks) >= FEWEST:
            squared = float(np.mean(errors**2)) if len(errors) else float("nan")
            exact = [
                error
                for seed, one in drawn.items()
                if one and (error := _linear_errors(seed).get(one["name"])) is not None
            ]
            by_chance = float(np.mean(np.square(exact))) if exact else None
            found.append(Calibration(kind, ranks, below, squared, by_chance, uniformity(ranks, LEVELS)))
    return found


@cache
def _linear_errors(seed: int) -> dict[str, float]:
    scene = prior_scene(seed)
    return {} if scene is None else linear_errors(scene)


def _one(result: Result, kind: str) -> Result | None:
    candidates = [rank for rank in result["ranks"] if rank["kind"] == kind]
    if not candidates:
        return None
    return candidates[int(np.random.default_rng([result["seed"], KINDS.index(kind)]).integers(len(candidates)))]


def tables(results: Results) -> str:
    """Everything that was measured, in Markdown."""
    parts = [_table(("sampler", *_SUMMARY), [(name, *_summary(found)) for name, found in results.items()])]
    parts += [f"{name}: commit {', '.join(_versions(found))}." for name, found in results.items()]
    for name, found in results.items():
        for group, chosen in {**groups(found), "all": answered(found)}.items():
            kinds = calibrations(chosen)
            if not kinds:
                parts.append(f"### {name}, {group}: {len(chosen)} scenes")
                continue
            rows = [
                (
                    one.kind,
                    str(len(one.ranks)),
                    *_shown(one),
                    f"{one.squared_error:.2f}",
                    "-" if one.by_chance is None else f"{one.by_chance:.2f}",
                    f"{one.probability:.4f}",
                )
                for one in kinds
            ]
            shares_of = (f"{100 * interval:.0f} %" for interval in INTERVALS)
            head = ("kind", "scenes", *shares_of, "squared error", "by chance", "uniform ranks, p")
            parts.append(f"### {name}, {group}: {len(chosen)} scenes\n\n{_table(head, rows)}")
    return "\n\n".join(parts)


def _versions(results: Sequence[Result]) -> list[str]:
    """The commits that were measured, each with the number of its scenes where there are several."""
    count = Counter(str(result["version"]) for result in results)
    return [name if len(count) == 1 else f"{name} ({number} scenes)" for name, number in count.items()]


def _shown(calibration: Calibration) -> list[str]:
    """Coverage, marked where chance does not explain it."""
    pairs = zip(calibration.coverage, calibration.within_error, strict=True)
    return [f"{share:.2f}" if fine else f"**{share:.2f}**" for share, fine in pairs]


_SUMMARY = (
    "scenes",
    "converged",
    "no posterior",
    "collision missed (of these converged)",
    "collision invented",
    "misfit claimed",
    "moving body taken to rest",
    "seconds, median",
)


def _summary(results: Sequence[Result]) -> list[str]:
    known = answered(results)
    missed = [result for result in known if result["missed"]]
    claimed = [result for result in known if any("does not explain" in text for text in result["warnings"])]
    seconds = f"{np.median([result['seconds'] for result in known]):.1f}" if known else "-"
    return [
        str(len(results)),
        str(sum(result["converged"] for result in known)),
        str(len(results) - len(known)),
        f"{len(missed)} ({sum(result['converged'] for result in missed)})",
        str(sum(result["invented"] > 0 for result in known)),
        str(len(claimed)),
        _taken_to_rest([result for result in known if "moving" in result]),
        seconds,
    ]


def _taken_to_rest(counted: Sequence[Result]) -> str:
    """Of the bodies that move when they are released, how many are held at rest."""
    if not counted:
        return "not counted"
    return f"{sum(result['taken_to_rest'] for result in counted)} of {sum(result['moving'] for result in counted)}"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    cells = [list(head), *[list(row) for row in rows]]
    widths = [max(len(row[column]) for row in cells) for column in range(len(head))]
    lines = [
        "| " + " | ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) + " |" for row in cells
    ]
    return "\n".join([lines[0], "|" + "|".join("-" * (width + 2) for width in widths) + "|", *lines[1:]])


def page(results: Results, path: Path) -> None:
    """Write the tables and figures between the marks of a page."""
    pictures = [
        f"![Ranks of the truth, {name}](figures/calibration-{name}.svg)"
        for name, found in results.items()
        if _drawn(found)
    ]
    write_between(path, "\n\n".join([*pictures, tables(results)]))


def figures(results: Results, folder: Path) -> None:
    """Differences of the ranks' distribution from the uniform one, with the band that uniform ones keep to."""
    import matplotlib as mpl  # noqa: PLC0415 (only the figures need it)

    mpl.use("Agg")
    import matplotlib.pyplot as plt  # noqa: PLC0415 (after the backend is chosen)

    folder.mkdir(parents=True, exist_ok=True)
    mpl.rcParams.update({"svg.hashsalt": "calibration", "font.size": 9})
    for name, found in results.items():
        chosen = _drawn(found)
        if not chosen:
            continue
        kinds = [kind for kind in KINDS if any(kind in part for part in chosen.values())]
        rows = -(-len(kinds) // 3)
        figure, axes = plt.subplots(
            rows, 3, sharex=True, sharey=True, squeeze=False, figsize=(9, 1.8 * rows), layout="constrained"
        )
        for axis, kind in zip_longest(axes.ravel(), kinds):
            if kind is None:
                axis.set_axis_off()
                continue
            _draw(axis, kind, chosen)
        handles, labels = axes[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=4, frameon=False)
        figure.supxlabel("rank of the truth among the draws, as a share", fontsize=9)
        figure.supylabel("share of scenes at or below it, minus the rank", fontsize=9)
        figure.savefig(folder / f"calibration-{name}.svg", metadata={"Date": None})
        plt.close(figure)


def _drawn(results: Sequence[Result]) -> dict[str, dict[str, Calibration]]:
    """What is drawn of each group of scenes; nothing where there are too few."""
    chosen = {group: {one.kind: one for one in calibrations(part)} for group, part in groups(results).items()}
    return chosen if any(chosen.values()) else {}


_COLOURS = {"converged": "#1f5fa8", "not converged": "#d1670d"}


def _draw(axis: Any, kind: str, chosen: Mapping[str, Mapping[str, Calibration]]) -> None:
    """One kind: the band of the scenes that converged, and the lines of both groups."""
    grid = np.arange(1, LEVELS + 1) / (LEVELS + 1)
    for group, found in chosen.items():
        if kind not in found:
            continue
        ranks = found[kind].ranks
        if group == "converged" or kind not in chosen["converged"]:
            band = simultaneous_band(len(ranks), LEVELS)
            axis.fill_between(
                grid, band.lower - grid, band.upper - grid, color="0.85", lw=0, label="95 % of uniform ranks stay here"
            )
        axis.plot(grid, shares(ranks, LEVELS) - grid, color=_COLOURS[group], lw=1.4, label=f"says it {_SAYS[group]}")
    axis.axhline(0, color="0.5", lw=0.6)
    axis.set_title(kind, fontsize=9)
    axis.margins(x=0)


_SAYS = {"converged": "converged", "not converged": "has not converged"}


def checks(results: Results) -> list[dict[str, object]]:
    """Goals that a calibrated sampler misses by chance with probability 0.05 each."""
    entries: list[dict[str, object]] = []
    for name, found in results.items():
        _add(entries, f"{name}: scenes", len(found), 200, met=len(found) >= 200)
        kinds = calibrations(groups(found)["converged"])
        if not kinds:
            _add(entries, f"{name}: ranks of converged scenes are uniform", None, ERROR_RATE, met=False)
            continue
        least = min(one.probability for one in kinds) * len(kinds)
        title = f"{name}: smallest p of uniform ranks times the number of kinds, converged scenes"
        _add(entries, title, min(least, 1.0), ERROR_RATE, met=least >= ERROR_RATE)
        hits = [
            binomtest(round(share * len(one.below)), len(one.below), interval).pvalue
            for one in kinds
            for share, interval in zip(one.coverage, INTERVALS, strict=True)
        ]
        least = min(hits) * len(hits)
        title = f"{name}: smallest p of the coverage of 50, 80 and 95 % times their number, converged scenes"
        _add(entries, title, min(least, 1.0), ERROR_RATE, met=least >= ERROR_RATE)
        share = len(groups(found)["converged"]) / len(found)
        _add(entries, f"{name}: share of scenes converged", share, 0.9, met=share >= 0.9)
    return entries


def _add(entries: list[dict[str, object]], name: str, value: float | None, goal: float, *, met: bool) -> None:
    entries.append({"name": name, "value": value, "goal": goal, "ok": bool(met)})

"""Tables and checks of what discovery finds, and the page that holds them."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from _discovery_results import (
    NULLS,
    REACHED,
    SURE,
    Share,
    alarm,
    alone,
    answer,
    below,
    between,
    bounds,
    checks,
    clearly_gains,
    covered,
    hit,
    intervals,
    named,
    of,
    reached,
    right,
    sure,
    sure_hit,
    unknown,
)
from _discovery_tasks import SIZES, Kind
from _page import write_between
from _resumable import Result

from tests.discovery.causes import CATALOGUE
from tests.discovery.other_effects import ALL


def tables(results: Sequence[Result]) -> str:
    """Everything that was measured, in Markdown."""
    parts = {
        "In short": _summary(results),
        "Recall by cause and effect size": _recall(results),
        "Recall by number of videos and bodies": _recall_by_extent(results),
        "Confusion": _confusion(results),
        "False alarms": _nulls(results),
        "Two causes": _pairs(results),
        "Outside the catalogue": _outside(results),
        "Removed from the catalogue": _removed(results),
        "Gain in held-out videos": _gains(results),
        "Coverage of 95 % intervals": _coverage(results),
        "Upper bounds of what was hidden and not named": _limits(results),
        "What failed": _failures(results),
        "Of which code": _versions(results),
    }
    return "\n\n".join(f"### {title}\n\n{text}" for title, text in parts.items() if text)


def _summary(results: Sequence[Result]) -> str:
    rows = [
        (one["name"], _figure(one["value"]), one.get("counts", "-"), _figure(one["goal"]), _met(one))
        for one in checks(results)
    ]
    return _table(("", "measured", "counts (95 %)", "goal", "met"), rows)


def _met(check: Result) -> str:
    if check["value"] is None:
        return "not measured"
    return "yes" if check["ok"] else "**no**"


def _figure(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"


def _recall(results: Sequence[Result]) -> str:
    bounds = (*SIZES, np.inf)
    bins = list(pairwise(bounds))
    sizes = [f"from {low:g} noise sd" for low, _ in bins]
    head = ["hidden", *sizes, "gain > 2 standard errors, too", "and nothing else", "smaller"]
    rows = []
    ones = of(results, Kind.ONE)
    for way in [*dict.fromkeys(way for result in ones for way in result["ways"]), None]:
        mine = [result for result in ones if way in (None, *result["ways"])]
        seen = between(mine, SIZES[0], np.inf)
        shares = [str(Share(between(mine, *ends), hit)) for ends in bins]
        stricter = [str(Share(seen, one)) for one in (sure_hit, alone)]
        rows.append((way or "all", *shares, *stricter, str(len(mine) - len(seen))))
    return _table(head, rows) if ones else ""


def _recall_by_extent(results: Sequence[Result]) -> str:
    """How much of what is hidden is found in few videos of few bodies, and in more."""
    extents: dict[tuple[int, int], list[Result]] = {}
    for result in of(results, Kind.ONE):
        extents.setdefault((result["videos"], result["bodies"]), []).append(result)
    weak, strong, _ = SIZES
    rows = []
    for (videos, bodies), mine in sorted(extents.items(), reverse=True):
        strongly = between(mine, strong, np.inf)
        shares = Share(between(mine, weak, strong), hit), Share(strongly, hit), Share(strongly, alone)
        rows.append((f"{videos} videos of {bodies} bodies", *map(str, shares)))
    head = (
        "data",
        f"from {weak:g} to {strong:g} noise sd",
        f"{strong:g} noise sd and more",
        f"{strong:g} noise sd and more, and nothing else",
    )
    return _table(head, rows) if rows else ""


def _confusion(results: Sequence[Result]) -> str:
    rows: dict[str, Counter[str]] = {}
    for result in of(results, Kind.ONE, *NULLS, Kind.OUTSIDE):
        if result["kind"] == Kind.ONE and reached(result) < REACHED * SIZES[0]:
            continue
        title = ALL[result["ways"][0]].name if result["ways"] else result["kind"]
        rows.setdefault(title, Counter())[answer(result)] += 1
    causes = list(CATALOGUE)
    columns = [*causes, "none", "unknown", "failed"]
    head = ["hidden", *(str(k + 1) for k in range(len(causes))), "none", "unknown", "failed"]
    numbered = {name: f"{k + 1} {name}" for k, name in enumerate(causes)}
    order = [*causes, *(name for name in rows if name not in causes)]
    cells = [
        (numbered.get(name, name), *(str(rows[name][column] or "") for column in columns))
        for name in order
        if name in rows
    ]
    return _table(head, cells) if cells else ""


def _nulls(results: Sequence[Result]) -> str:
    rows = []
    for title, kinds in (*((kind, (kind,)) for kind in NULLS), ("all", NULLS)):
        mine = of(results, *kinds)
        called = Counter(name for result in mine for name in named(result))
        shown = ", ".join(f"{name} {count}" for name, count in called.most_common()) or "-"
        rows.append((str(title), str(Share(mine, alarm)), str(Share(mine, _named)), shown))
    return _table(("data", "verdict not `none`", "a cause is named", "which"), rows) if of(results, *NULLS) else ""


def _named(result: Result) -> bool:
    return bool(named(result))


def _pairs(results: Sequence[Result]) -> str:
    rows = [
        (
            " + ".join(ways),
            ", ".join(f"{reached(one):.1f}" for one in mine),
            str(Share(mine, hit)),
            str(Share(mine, sure_hit)),
            _list(", ".join(named(one)) or answer(one) for one in mine),
        )
        for ways, mine in _by_ways(of(results, Kind.TWO)).items()
    ]
    head = ("hidden", "smaller of their sizes", "both named", "gains > 2 standard errors, too", "answers")
    return _table(head, rows) if rows else ""


def _outside(results: Sequence[Result]) -> str:
    rows = [
        (" + ".join(ways), str(Share(mine, sure)), str(Share(mine, unknown)), _list(_probable(one) for one in mine))
        for ways, mine in _by_ways(of(results, Kind.OUTSIDE)).items()
    ]
    head = ("hidden", f"a cause with probability > {SURE}", "verdict `unknown`", "answers")
    return _table(head, rows) if rows else ""


def _removed(results: Sequence[Result]) -> str:
    rows = [
        (" + ".join(ways), str(Share(mine, unknown)), str(Share(mine, sure)), _list(_probable(one) for one in mine))
        for ways, mine in _by_ways(of(results, Kind.REMOVED)).items()
    ]
    head = ("hidden, and not looked for", "verdict `unknown`", f"a cause with probability > {SURE}", "answers")
    return _table(head, rows) if rows else ""


def _probable(result: Result) -> str:
    """The verdict, and causes with their probabilities."""
    causes = [
        f"{one['name']} {one['probability']:.2f}" for one in result.get("causes", ()) if one["name"] in named(result)
    ]
    return " ".join([f"`{result.get('verdict', 'failed')}`", *causes])


def _gains(results: Sequence[Result]) -> str:
    head = (
        "hidden",
        "data sets where it was named",
        "gain > 2 standard errors",
        "gain in nats, median",
        "error without it, mm",
        "with it, mm",
        "noise, mm",
    )
    rows = []
    for name, found in right(results, Kind.ONE).items():
        sure = sum(map(clearly_gains, found))
        errors = 1e3 * np.median([[*one["rmse"], one["noise"]] for one in found], axis=0)
        gain = np.median([one["gain"] for one in found])
        rows.append((name, str(len(found)), str(sure), f"{gain:.0f}", *(f"{error:.1f}" for error in errors)))
    return _table(head, rows) if rows else ""


def _coverage(results: Sequence[Result]) -> str:
    found = intervals(results)
    rows = [(name, str(Share(mine, covered))) for name, mine in found.items()]
    rows.append(("all", str(Share([one for mine in found.values() for one in mine], covered))))
    return _table(("parameter", "truth inside"), rows) if found else ""


def _limits(results: Sequence[Result]) -> str:
    found = bounds(results)
    rows = []
    for name, mine in (*found.items(), ("all", [one for several in found.values() for one in several])):
        stated = [one for one in mine if one["bound"] is not None]
        ratios = [one["bound"] / one["truth"] for one in stated if one["truth"] > 0]
        rows.append(
            (
                name,
                str(Share(stated, below)),
                f"{np.median(ratios):.1f}" if ratios else "-",
                str(len(mine) - len(stated)),
            )
        )
    head = ("parameter", "no more than the bound (95 %)", "bound over what was hidden, median", "no bound")
    return _table(head, rows) if found else ""


def _failures(results: Sequence[Result]) -> str:
    lines = [f"- {result['task']}: not drawn: {result['not_drawn']}" for result in results if "not_drawn" in result]
    lines += [
        f"- {result['task']}: {result['exception'].strip().splitlines()[-1]}"
        for result in results
        if "exception" in result
    ]
    return "\n".join(lines)


def _versions(results: Sequence[Result]) -> str:
    """Commits that data sets were searched with, and what a search took."""
    kinds: dict[tuple[str, int], list[Result]] = {}
    for result in results:
        kinds.setdefault((result["kind"], result["seed"] if result["ways"] else 0), []).append(result)
    rows = []
    for (kind, seed), mine in kinds.items():
        seconds = sorted(result["seconds"]["cpu"] for result in mine if "seconds" in result)
        times = f"{np.median(seconds):.0f}, {seconds[-1]:.0f}" if seconds else "-"
        commits = Counter(result["version"] for result in mine).most_common()
        told = ", ".join(f"{commit} ({count})" for commit, count in commits)
        rows.append((kind, str(seed) if seed else "any", str(len(mine)), times, told))
    return _table(("data", "seed", "sets", "processor seconds, median and most", "commits (sets)"), rows)


def _by_ways(results: Sequence[Result]) -> Mapping[tuple[str, ...], list[Result]]:
    found: dict[tuple[str, ...], list[Result]] = {}
    for result in results:
        found.setdefault(tuple(result["ways"]), []).append(result)
    return found


def _list(answers: Iterable[str]) -> str:
    return "; ".join(f"{text} ({count})" if count > 1 else text for text, count in Counter(answers).most_common())


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    cells = [list(head), *[list(row) for row in rows]]
    widths = [max(len(row[column]) for row in cells) for column in range(len(head))]
    lines = [
        "| " + " | ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) + " |" for row in cells
    ]
    return "\n".join([lines[0], "|" + "|".join("-" * (width + 2) for width in widths) + "|", *lines[1:]])


def page(results: Sequence[Result], path: Path) -> None:
    """Write the tables between the marks of a page."""
    write_between(path, tables(results))

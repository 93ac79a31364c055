"""What the results of `benchmarks/discovery.py` mean: hits, false alarms, shares with intervals, and the goals."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from _discovery_tasks import SIZES, Kind, Task
from _resumable import Result
from scipy.stats import binomtest

from vrdp_prob.discovery.selection.search import gain_needed
from vrdp_prob.inference import default_model
from vrdp_prob.models.model_file import known_effects

SURE, LIKELY = 0.9, 0.5
REACHED = 0.95
"""Share of an effect size from which it counts as reached: the search for a strength is no finer."""
NULLS = (Kind.NULL, Kind.ROUGH_NULL, Kind.GLIDING_NULL)
NEEDED = gain_needed(
    sum(effect.follows is None for effect in known_effects().values())
    - sum(effect.follows is None for effect in default_model().effects)
)
"""Gain (nats) without which the search names nothing, when it looks for all causes."""
CERTAIN = 0.95
"""Probability of the intervals of parameters."""
STRONG_RECALL, WEAK_RECALL, FALSE_ALARMS, BOTH = 0.95, 0.60, 0.05, 0.80
FEWEST_NULLS = 60


def of(results: Iterable[Result], *kinds: Kind) -> list[Result]:
    """Results of tasks of some kinds for which there were data."""
    return [result for result in results if result["kind"] in kinds and "not_drawn" not in result]


def named(result: Result) -> list[str]:
    """What discovery holds for likely, the most probable first; where that is nothing, the first of what it named."""
    causes = result.get("causes", [])
    likely = sorted((one for one in causes if one["probability"] >= LIKELY), key=lambda one: -float(one["probability"]))
    return [one["name"] for one in likely] or [one["name"] for one in causes if one["named"]][:1]


def answer(result: Result) -> str:
    """The first cause that was named; the verdict where none was, and `unknown` where that is the verdict."""
    verdict = str(result.get("verdict", "failed"))
    return verdict if verdict == "unknown" else next(iter(named(result)), verdict)


def rightly_named(result: Result) -> list[Result]:
    """Hidden causes that were named, with the verdict `named` and the gain in held-out videos that the search needs."""
    hidden, likely = {one["name"] for one in result["hidden"]}, set(named(result))
    found = [one for one in result.get("causes", []) if one["name"] in hidden & likely and one["gain"] >= NEEDED]
    return found if result.get("verdict") == "named" else []


def hit(result: Result) -> bool:
    """Whether everything hidden was rightly named."""
    return {one["name"] for one in result["hidden"]} == {one["name"] for one in rightly_named(result)}


def sure_hit(result: Result) -> bool:
    """Whether that is so with gains that are above 0 by two standard errors over videos, too."""
    return hit(result) and all(clearly_gains(one) for one in rightly_named(result))


def clearly_gains(cause: Result) -> bool:
    return bool(cause["gain"] > 2 * cause["gain_se"])


def alone(result: Result) -> bool:
    """Whether what is hidden was rightly named and nothing else was named."""
    return hit(result) and {one["name"] for one in result["hidden"]} == set(named(result))


def reached(result: Result) -> float:
    """Smallest effect size of what is hidden, in units of the noise."""
    return min(float(one["effect_size"]) for one in result["hidden"])


def between(results: Iterable[Result], low: float, high: float) -> list[Result]:
    """Results whose effect size lies from a size up to below another one."""
    return [result for result in results if REACHED * low <= reached(result) < REACHED * high]


class Share:
    """How many of some results have a property, with Wilson's 95 % interval of the share."""

    def __init__(self, results: Sequence[Result], has: Callable[[Result], bool]) -> None:
        self.hits, self.of = sum(map(has, results)), len(results)

    @property
    def value(self) -> float | None:
        """The share; None of nothing."""
        return self.hits / self.of if self.of else None

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's interval of the share of something."""
        low, high = binomtest(self.hits, self.of).proportion_ci(method="wilson")
        return float(low), float(high)

    def __str__(self) -> str:
        if not self.of:
            return "-"
        low, high = self.interval
        return f"{self.hits}/{self.of} ({100 * low:.0f}-{100 * high:.0f} %)"


def alarm(result: Result) -> bool:
    return result.get("verdict") != "none"


def sure(result: Result) -> bool:
    return any(one["probability"] > SURE for one in result.get("causes", ()))


def unknown(result: Result) -> bool:
    return result.get("verdict") == "unknown"


def right(results: Sequence[Result], *kinds: Kind) -> dict[str, list[Result]]:
    """What was found of causes that were named rightly in tasks of some kinds, by the cause."""
    found: dict[str, list[Result]] = {}
    for result in of(results, *kinds):
        if result["kind"] == Kind.ONE and reached(result) < REACHED * SIZES[0]:
            continue
        for cause in rightly_named(result):
            found.setdefault(cause["name"], []).append(cause)
    return found


def intervals(results: Sequence[Result]) -> dict[str, list[Result]]:
    """Estimates of which the truth is known, of single causes and of pairs, by the parameter without body and video."""
    found: dict[str, list[Result]] = {}
    for causes in right(results, Kind.ONE, Kind.TWO).values():
        for cause in causes:
            for name, estimate in cause["parameters"].items():
                if estimate["truth"] is not None:
                    found.setdefault(name.split("[")[0], []).append(estimate)
    return found


def covered(estimate: Result) -> bool:
    return bool(estimate["low"] <= estimate["truth"] <= estimate["high"])


def bounds(results: Sequence[Result]) -> dict[str, list[Result]]:
    """Upper bounds of what was hidden and is not told of, by the parameter; None where the data put none on it.

    Where something unknown is left, none is told.
    """
    found: dict[str, list[Result]] = {}
    for result in of(results, Kind.ONE, Kind.TWO):
        for bound in result.get("bounds", ()) if not unknown(result) else ():
            found.setdefault(bound["parameter"], []).append(bound)
    return found


def below(bound: Result) -> bool:
    """Whether there was no more of it than the bound says."""
    return bool(bound["truth"] <= bound["bound"])


def checks(results: Sequence[Result]) -> list[dict[str, Any]]:
    """Goals of discovery."""
    ones, nulls = of(results, Kind.ONE), of(results, *NULLS)
    strong, weak = between(ones, 3.0, np.inf), between(ones, 1.5, 3.0)
    usual = [one for one in strong if (one["videos"], one["bodies"]) == (Task.videos, Task.bodies)]
    values = [estimate for mine in intervals(results).values() for estimate in mine]
    removed = between(of(results, Kind.REMOVED), 3.0, np.inf)
    entries = [
        _at_least("recall from 3 noise sd", Share(strong, hit), STRONG_RECALL),
        _at_least(
            f"recall from 3 noise sd in {Task.videos} videos of {Task.bodies} bodies", Share(usual, hit), STRONG_RECALL
        ),
        _at_least("recall from 1.5 to 3 noise sd", Share(weak, hit), WEAK_RECALL),
        _at_most("false alarms", Share(nulls, alarm), FALSE_ALARMS),
        _at_least("nulls", len(nulls), FEWEST_NULLS),
        _at_least("two causes, both named", Share(of(results, Kind.TWO), hit), BOTH),
        _at_most(
            "outside the catalogue or taken out of it, called a cause of it with probability > 0.9",
            Share(of(results, Kind.OUTSIDE, Kind.REMOVED), sure),
            0.0,
        ),
        _at_least("removed from the catalogue, from 3 noise sd, verdict unknown", Share(removed, unknown), 1.0),
    ]
    if values:
        inside = Share(values, covered)
        low, high = inside.interval
        coverage = _measured("95 % intervals that hold the truth, within binomial error", inside)
        entries.append({**coverage, "goal": CERTAIN, "ok": low <= CERTAIN <= high})
    if limits := [bound for mine in bounds(results).values() for bound in mine if bound["bound"] is not None]:
        held = Share(limits, below)
        entry = _measured("95 % upper bounds that hold what was hidden and not named, within binomial error", held)
        entries.append({**entry, "goal": CERTAIN, "ok": held.interval[1] >= CERTAIN})
    return [*entries, _at_most("data sets on which discovery failed", sum("exception" in one for one in results), 0)]


def _at_least(name: str, figure: Share | float, goal: float) -> dict[str, Any]:
    entry = _measured(name, figure)
    return {**entry, "goal": goal, "ok": entry["value"] is not None and entry["value"] >= goal}


def _at_most(name: str, figure: Share | float, goal: float) -> dict[str, Any]:
    entry = _measured(name, figure)
    return {**entry, "goal": goal, "ok": entry["value"] is not None and entry["value"] <= goal}


def _measured(name: str, figure: Share | float) -> dict[str, Any]:
    """A figure by its name; of a share also the counts, with their 95 % interval."""
    if isinstance(figure, Share):
        return {"name": name, "value": figure.value, "counts": str(figure)}
    return {"name": name, "value": figure}

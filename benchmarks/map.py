"""How often the search for the most probable values finds them, on random synthetic videos with known truth.

    python benchmarks/map.py [--json FILE] [--scenes 300] [--plan default|lbfgs|...] [--docs DIR]

The videos come from an integrator of the tests' own (`tests/inference/random_scenes.py`). A fit succeeds if its log
posterior is at least that of the true values minus 0.5 nats, both under one likelihood that holds all unknowns, and no
model error whatever the fit found (`tests/inference/map_comparison.py`); fits with one are counted. Times are those of
the processor, on one core.
"""

import argparse
import json
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import _project  # noqa: F401  the generator belongs to the tests, which lie beside the package
import numpy as np
import torch

from tests.inference.map_comparison import compare
from tests.inference.random_scenes import random_truth
from vrdp_prob.inference import (
    ALL_AT_ONCE,
    CURRICULUM,
    FREE_FIRST,
    GROWING,
    FitPlan,
    Optimiser,
    default_model,
    fit_map,
)
from vrdp_prob.workers import local_workers

PLANS = {
    "default": FitPlan(),
    "lbfgs": FitPlan(Optimiser.LBFGS),
    "all-at-once": ALL_AT_ONCE,
    "free-first": FREE_FIRST,
    "curriculum": CURRICULUM,
    "growing": GROWING,
}
GOAL_RATE, GOAL_SECONDS = 0.99, 2.0


@dataclass(frozen=True)
class Outcome:
    """How one video went."""

    seed: int
    succeeded: bool
    seconds: float
    gain: float
    converged: bool
    agreed: bool
    model_error: bool
    modes: int
    strata: tuple[str, ...]
    cause: str

    @property
    def line(self) -> str:
        """The outcome in one line."""
        verdict = "ok" if self.succeeded else f"failed: {self.cause}"
        ended = ("" if self.converged else ", not converged") + ("" if self.agreed else ", searches did not agree")
        return (
            f"seed {self.seed:3d}  {self.seconds:5.1f} s  {self.gain:7.1f} nats  {self.modes} modes  {verdict}{ended}"
        )


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="file for the checks")
    parser.add_argument("--scenes", type=int, default=300, help="how many videos")
    parser.add_argument("--first", type=int, default=0, help="seed of the first video")
    parser.add_argument("--plan", choices=PLANS, default="default")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--docs", type=Path, help="folder for map-table.md, the tables as a page holds them")
    options = parser.parse_args(arguments)
    seeds = range(options.first, options.first + options.scenes)
    work = partial(outcome, plan=PLANS[options.plan])
    outcomes = []
    with local_workers(options.processes, tasks=len(seeds)) as workers:
        for one in workers.map(work, seeds):
            outcomes.append(one)
            print(one.line, flush=True)
    text = table(outcomes)
    print(text)
    if options.docs is not None:
        (options.docs / "map-table.md").write_text(text, encoding="utf-8")
    if options.json is not None:
        document = {"checks": checks(outcomes), "failed": [one.seed for one in outcomes if not one.succeeded]}
        options.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    return 0


def outcome(seed: int, plan: FitPlan) -> Outcome:
    """Fit the video of a seed and compare it with the truth."""
    torch.set_num_threads(1)
    truth = random_truth(seed)
    begin = time.process_time()
    fit = fit_map(truth.tracks, default_model(), np.random.default_rng(0), plan=plan)
    seconds = time.process_time() - begin
    comparison = compare(truth, fit)
    return Outcome(
        seed,
        comparison.succeeded,
        seconds,
        comparison.fitted - comparison.true,
        fit.converged,
        fit.search.agreed,
        fit.likelihood.model_error is not None,
        len(fit.modes),
        tuple(sorted(truth.strata)),
        "" if comparison.succeeded else comparison.cause,
    )


def table(outcomes: Sequence[Outcome]) -> str:
    """Rates by kind of scene as a markdown table, and the failures."""
    strata = sorted({name for one in outcomes for name in one.strata})
    rows = ["| videos | number | found | seconds, median | mean |", "|---|---|---|---|---|"]
    kinds = [("all", outcomes), *((name, [one for one in outcomes if name in one.strata]) for name in strata)]
    kinds += [
        ("none of these", [one for one in outcomes if not one.strata]),
        ("not converged", [one for one in outcomes if not one.converged]),
        ("searches did not agree", [one for one in outcomes if not one.agreed]),
        ("with a model error", [one for one in outcomes if one.model_error]),
    ]
    for name, chosen in kinds:
        if chosen:
            found = sum(one.succeeded for one in chosen)
            times = [one.seconds for one in chosen]
            rows.append(
                f"| {name} | {len(chosen)} | {found} ({found / len(chosen):.1%}) | {np.median(times):.1f} | "
                f"{np.mean(times):.1f} |"
            )
    failures = [
        f"- seed {one.seed} ({', '.join(one.strata) or 'plain'}): {one.gain:.1f} nats; {one.cause}"
        for one in outcomes
        if not one.succeeded
    ]
    return "\n".join([*rows, "", *(failures or ["No failure."])]) + "\n"


def checks(outcomes: Sequence[Outcome]) -> list[dict[str, object]]:
    """Rates and time against their goals."""

    def rate(chosen: Sequence[Outcome]) -> float | None:
        return float(np.mean([one.succeeded for one in chosen])) if chosen else None

    found, seconds = rate(outcomes) or 0.0, float(np.median([one.seconds for one in outcomes]))
    rows: list[dict[str, object]] = [
        {"name": "share of videos with the MAP", "value": found, "goal": GOAL_RATE, "ok": found >= GOAL_RATE},
        {"name": "seconds, median", "value": seconds, "goal": GOAL_SECONDS, "ok": seconds <= GOAL_SECONDS},
    ]
    for name in sorted({name for one in outcomes for name in one.strata}):
        share = rate([one for one in outcomes if name in one.strata]) or 0.0
        rows.append({"name": f"share, {name}", "value": share, "goal": GOAL_RATE, "ok": share >= GOAL_RATE})
    return rows


if __name__ == "__main__":
    sys.exit(main())

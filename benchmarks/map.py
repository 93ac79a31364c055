"""How often the search for the most probable values finds them, on random synthetic videos with known truth.

    python benchmarks/map.py [--json FILE] [--scenes 300] [--plan default|lbfgs|...] [--docs docs]

The videos come from an integrator of the tests' own (`tests/inference/random_scenes.py`). A fit succeeds if its log
posterior is at least that of the true values minus 0.5 nats, both under one likelihood that holds all unknowns, and no
model error whatever the fit found (`tests/inference/map_comparison.py`); fits with one are counted. Times are those of
the processor, on one core. Results are written to `--results` as they come, so that a run that was interrupted goes on;
`--docs` writes the tables into `map.md` there.
"""

import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import _project  # noqa: F401  the generator belongs to the tests, which lie beside the package
import numpy as np
import torch
from _page import page_parser, publish, table_row
from _resumable import Result, measured

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
from vrdp_prob.models.simulator.rollout import compile_model

PLANS = {
    "default": FitPlan(),
    "lbfgs": FitPlan(Optimiser.LBFGS),
    "all-at-once": ALL_AT_ONCE,
    "free-first": FREE_FIRST,
    "curriculum": CURRICULUM,
    "growing": GROWING,
}
GOAL_RATE, GOAL_SECONDS = 0.99, 2.0
RESULTS = Path("out") / "map.jsonl"


@dataclass(frozen=True)
class Video:
    """A video that is fitted in some way."""

    seed: int
    plan: str

    @property
    def key(self) -> str:
        """What tells its result apart."""
        return f"{self.plan} {self.seed}"


@dataclass(frozen=True)
class Outcome:
    """How one video went."""

    key: str
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
    version: str = ""


def main(arguments: Sequence[str] | None = None) -> int:
    parser = page_parser(__doc__, RESULTS, document="checks")
    parser.add_argument("--scenes", type=int, default=300, help="how many videos")
    parser.add_argument("--first", type=int, default=0, help="seed of the first video")
    parser.add_argument("--plan", choices=PLANS, default="default")
    parser.set_defaults(processes=1)
    options = parser.parse_args(arguments)
    if options.docs is not None and options.plan != "default":
        parser.error("the page holds the table of the default plan; leave --docs or --plan out")
    videos = [Video(seed, options.plan) for seed in range(options.first, options.first + options.scenes)]
    compile_model(default_model())
    results = measured(
        outcome,
        {one.key: one for one in videos},
        options.results,
        field="key",
        label="Videos",
        processes=options.processes,
    )
    outcomes = [Outcome(**one) for one in results]
    document = {"checks": checks(outcomes), "failed": [one.seed for one in outcomes if not one.succeeded]}
    publish(table(outcomes), "map.md", document, options)
    return 0


def outcome(video: Video) -> Result:
    """Fit a video and compare it with the truth."""
    torch.set_num_threads(1)
    truth = random_truth(video.seed)
    begin = time.process_time()
    fit = fit_map(truth.tracks, default_model(), np.random.default_rng(0), plan=PLANS[video.plan])
    seconds = time.process_time() - begin
    comparison = compare(truth, fit)
    return asdict(
        Outcome(
            video.key,
            video.seed,
            bool(comparison.succeeded),
            seconds,
            float(comparison.fitted - comparison.true),
            bool(fit.converged),
            bool(fit.search.agreed),
            fit.likelihood.model_error is not None,
            len(fit.modes),
            tuple(sorted(truth.strata)),
            "" if comparison.succeeded else comparison.cause,
        )
    )


def table(outcomes: Sequence[Outcome]) -> str:
    """Rates by kind of scene as a markdown table, and the failures."""
    strata = sorted({name for one in outcomes for name in one.strata})
    rows = [table_row("videos", "number", "found", "seconds, median", "mean"), "|---|---|---|---|---|"]
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
            share = f"{found} ({found / len(chosen):.1%})"
            rows.append(table_row(name, str(len(chosen)), share, f"{np.median(times):.1f}", f"{np.mean(times):.1f}"))
    failures = [
        table_row(f"seed {one.seed} ({', '.join(one.strata) or 'none of these'})", f"{-one.gain:.1f}", one.cause)
        for one in outcomes
        if not one.succeeded
    ]
    missed = (
        [table_row("missed", "by (nats)", "what is wrong"), "|---|---|---|", *failures] if failures else ["No miss."]
    )
    commits = ", ".join(sorted({one.version for one in outcomes}))
    return "\n".join([*rows, "", *missed, "", f"Of commit {commits}."])


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

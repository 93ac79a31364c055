"""How long a search for causes takes with all cores, beside the joint fit of the model that was given.

    python benchmarks/discovery_speed.py [--json FILE] [--causes a,b] [--size 3] [--videos 12] [--bodies 4] [--seed 1]

Each data set hides one cause (`none`: nothing) as those of `benchmarks/discovery.py` do. It is fitted, and then
searched, in as many processes as there are cores, so that nothing else should run beside. The fit is the reference: the
search contains one such fit, and refits of it with the causes that seem to act.
"""

import argparse
import json
import os
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from _clock import processor_seconds
from _discovery_tasks import handed_over
from _page import table_row

from tests.discovery.hidden import hide
from tests.discovery.scenes import Setting
from vrdp_prob.discovery.discover import discover
from vrdp_prob.files import write_atomically
from vrdp_prob.inference import default_model
from vrdp_prob.inference.runs.parallel import several_processes
from vrdp_prob.inference.several_videos.fitting import fit_together
from vrdp_prob.models.simulator.rollout import compile_model

NOTHING = "none"
CAUSES = (NOTHING, "surface_tilt", "linear_drag", "pair_force", "time_varying_friction", "clock_error")
GOAL, GOAL_OF = 180.0, (12, 4, 2)
"""Seconds that a search may take, and of how many videos of how many bodies on how many cores."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="file for the results")
    parser.add_argument("--causes", default=",".join(CAUSES), help="what is hidden, one in each data set")
    parser.add_argument("--size", type=float, default=3.0, help="effect size, in units of the noise")
    parser.add_argument("--videos", type=int, default=12)
    parser.add_argument("--bodies", type=int, default=4)
    parser.add_argument("--seed", type=int, default=1, help="of the data")
    options = parser.parse_args(arguments)
    compile_model(default_model())
    setting = Setting(videos=options.videos, bodies=options.bodies)
    print(table_row("hidden", "verdict", "joint fit, s", "search, s", "ratio", "of the processors, s"), flush=True)
    print("|---|---|---|---|---|---|", flush=True)
    rows = []
    for name in options.causes.split(","):
        rows.append(one(name, options.size, options.seed, setting))
        print(_row(rows[-1]), flush=True)
    slowest = max(row["seconds"] for row in rows)
    of_the_goal = (options.videos, options.bodies, os.cpu_count()) == GOAL_OF
    goal = f" (goal {GOAL:.0f})" if of_the_goal else ""
    print(f"\nThe slowest took {slowest:.0f} s{goal} on {os.cpu_count()} cores.")
    if options.json:
        check = {"name": "slowest search, s", "value": slowest, "goal": GOAL, "ok": slowest <= GOAL}
        checks = [check] if of_the_goal else []
        with write_atomically(options.json) as temporary:
            temporary.write_text(json.dumps({"checks": checks, "rows": rows}, indent=1) + "\n", encoding="utf-8")
    return 0


def one(name: str, size: float, seed: int, setting: Setting) -> dict[str, Any]:
    """Times of one data set, and what was found."""
    data = hide([] if name == NOTHING else [name], seed=seed, effect_size=size, setting=setting)
    videos = handed_over(data)

    def fit() -> None:
        with several_processes(None):
            fit_together(videos, model=default_model(), model_error=False)

    _, fit_seconds, _ = _timed(fit)
    finding, seconds, of_processors = _timed(lambda: discover(videos, seed=0))
    causes = [f"{cause.name} {cause.probability:.2f}" for cause in finding.named]
    return {
        "hidden": name,
        "verdict": str(finding.verdict),
        "causes": causes,
        "fit_seconds": fit_seconds,
        "seconds": seconds,
        "processor_seconds": of_processors,
    }


def _timed(task: Callable[[], Any]) -> tuple[Any, float, float]:
    wall, processors = time.perf_counter(), processor_seconds()
    found = task()
    return found, time.perf_counter() - wall, processor_seconds() - processors


def _row(row: dict[str, Any]) -> str:
    said = " ".join([f"`{row['verdict']}`", *row["causes"]])
    ratio = row["seconds"] / row["fit_seconds"]
    numbers = (row["fit_seconds"], row["seconds"], ratio, row["processor_seconds"])
    return table_row(row["hidden"], said, *(f"{number:.0f}" for number in numbers))


if __name__ == "__main__":
    sys.exit(main())

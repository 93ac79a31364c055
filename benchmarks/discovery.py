"""Whether discovery finds what is hidden in measured data: by cause and effect size, two at a time, and in nulls.

    python benchmarks/discovery.py [--json FILE] [--docs docs] [--causes a,b] [--sizes 1.5,3,6] [--seeds 3] [--nulls 60]

Each task draws videos with a hidden cause (`tests/discovery`: an integrator that is not the simulator), writes nothing
but their tracks, reads them back and calls `discover`. Each result is written to `--results` (a file) as it comes, so
that a run that was interrupted goes on; results of another version of the code are to be deleted by hand. `--causes`
may also name effects outside the catalogue. `--docs` writes the tables into `discovery-tests.md` there; `--show` only
reads the results there are. One process per core. `--length` and `--time` put the same motion on another scale,
`--frame-rate` and `--noise` film it otherwise; name another file of results for such, which tables would count alike.
"""

import argparse
import json
import os
import signal
import sys
import time
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import torch
from _discovery_page import page, tables
from _discovery_results import checks
from _discovery_tasks import SIZES, Kind, Table, Task, handed_over, measurement, setting, tasks
from _resumable import Result, measured, read

from tests.discovery.data_set import Truth
from tests.discovery.hidden import hide, true_values
from tests.discovery.other_effects import ALL
from tests.discovery.videos import UnendingMotionError
from vrdp_prob.discovery.discover import discover
from vrdp_prob.discovery.finding import Finding, FoundCause
from vrdp_prob.inference import default_model
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.model_file import known_effects
from vrdp_prob.models.simulator.rollout import compile_model

RESULTS = Path("out") / "discovery.jsonl"
KINDS = {kind.name.lower(): kind for kind in Kind}
LIMIT = 3600.0
"""Processor seconds after which a data set is broken off, and counts as missed."""
NOT_THROUGH = "not through"
"""What then stands in the place of the verdict."""


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="file for the checks")
    parser.add_argument("--docs", type=Path, help="folder of the documentation, whose page is written anew")
    parser.add_argument("--causes", help="what is hidden, separated by commas; everything by default")
    parser.add_argument(
        "--kinds", help=f"what is asked, separated by commas; everything by default: {', '.join(KINDS)}"
    )
    parser.add_argument(
        "--sizes", default=",".join(f"{size:g}" for size in SIZES), help="effect sizes of single causes"
    )
    parser.add_argument("--seeds", type=int, default=3, help="data sets of each cause and size")
    parser.add_argument("--nulls", type=int, default=60, help="data sets with nothing hidden, a third more that glide")
    parser.add_argument("--videos", type=int, default=12)
    parser.add_argument("--bodies", type=int, default=4)
    parser.add_argument("--length", type=float, default=1.0, help="factor of all lengths, the noise with them")
    parser.add_argument("--time", type=float, default=1.0, help="factor of all times")
    parser.add_argument(
        "--frame-rate", type=float, default=Table.frame_rate, help="frames per second, before that factor"
    )
    parser.add_argument("--noise", type=float, default=Table.noise, help="noise in m, before that factor")
    parser.add_argument("--results", type=Path, default=RESULTS, help="file of the results, which are gone on with")
    parser.add_argument("--show", action="store_true", help="compute nothing, show all results there are")
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    options = parser.parse_args(arguments)
    causes = options.causes.split(",") if options.causes else None
    for name in causes or ():
        if name not in ALL:
            parser.error(f"nothing is called {name}; there are {', '.join(ALL)}")
    kinds = options.kinds.split(",") if options.kinds else list(KINDS)
    for name in kinds:
        if name not in KINDS:
            parser.error(f"nothing is asked by the name {name}; there are {', '.join(KINDS)}")
    listed = tasks(
        causes=causes,
        sizes=[float(size) for size in options.sizes.split(",")],
        seeds=options.seeds,
        nulls=options.nulls,
        videos=options.videos,
        bodies=options.bodies,
        table=Table(options.length, options.time, options.frame_rate, options.noise),
    )
    listed = [task for task in listed if task.kind in {KINDS[name] for name in kinds}]
    if options.show:
        results = list({result["task"]: result for result in read(options.results)}.values())
    else:
        compile_model(default_model())
        asked = {task.name: task for task in listed}
        results = measured(
            one, asked, options.results, field="task", label="Hidden effects", processes=options.processes
        )
    print(tables(results))
    if options.docs:
        page(results, options.docs / "discovery-tests.md")
    if options.json:
        options.json.write_text(json.dumps({"checks": checks(results)}, indent=1) + "\n", encoding="utf-8")
    return 0


def one(task: Task) -> Result:
    """What discovery makes of a data set."""
    torch.set_num_threads(1)
    facts: dict[str, Any] = {"task": task.name, **asdict(task)}
    how = {"setting": setting(task), "measurement": measurement(task)}
    try:
        data = hide(task.ways, seed=task.seed, effect_size=task.effect_size, **how)
    except (UnendingMotionError, ValueError) as error:  # scenes in which this cause finds no room
        return {**facts, "not_drawn": str(error)}
    facts["hidden"] = [
        {
            "name": cause.name,
            "strength": cause.strength,
            "effect_size": cause.effect_size,
            "trace": cause.trace,
        }
        for cause in data.truth.causes
    ]
    videos = handed_over(data, task.table)
    wall, cpu = time.perf_counter(), time.process_time()
    try:
        with broken_off_after(LIMIT):
            finding = discover(videos, seed=0, catalogue=catalogue(task), processes=1)
    except TimeoutError:
        return {**facts, "verdict": NOT_THROUGH, "causes": []}
    except Exception:  # one failure is a result, and the others go on
        return {**facts, "exception": traceback.format_exc(limit=-4)}
    seconds = {"wall": time.perf_counter() - wall, "cpu": time.process_time() - cpu}
    return {**facts, **outcome(finding, data.truth, comparable=task.table.is_of_usual_scale), "seconds": seconds}


@contextmanager
def broken_off_after(limit: float) -> Iterator[None]:
    """What takes longer, in processor seconds of this process, ends as a `TimeoutError`."""

    def end(_signal: int, _frame: object) -> None:
        raise TimeoutError

    before = signal.signal(signal.SIGPROF, end)
    signal.setitimer(signal.ITIMER_PROF, limit)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def catalogue(task: Task) -> list[Effect] | None:
    """Causes that are looked for: all, or all but the hidden one."""
    if task.kind is not Kind.REMOVED:
        return None
    hidden = {ALL[way].name for way in task.ways}
    return [effect() for effect in known_effects().values() if effect.cause_name() not in hidden]


def outcome(finding: Finding, truth: Truth, *, comparable: bool) -> Result:
    """What was found, and the truth beside it where that is of the same scale."""
    return {
        "verdict": str(finding.verdict),
        "causes": [_cause(cause, truth, comparable=comparable) for cause in finding.causes],
        "failing_checks": [check.name for check in finding.checks if check.significant],
        "failing_checks_after": [check.name for check in finding.checks_after if check.significant],
        "bounds": list(_bounds(finding, truth)) if comparable else [],
        "notes": list(finding.notes),
    }


def _bounds(finding: Finding, truth: Truth) -> Iterator[Result]:
    """Upper bounds of strengths that were hidden and are not told of, each beside how much of it there was."""
    hidden = {cause.name for cause in truth.causes}
    for bound in (one for one in finding.upper_bounds if one.name in hidden and one.measure is None):
        asked = {bound.parameter: 0.0} | ({} if isinstance(bound.vanishes_at, float) else {bound.vanishes_at: 0.0})
        true = true_values(truth, asked)
        nothing = bound.vanishes_at if isinstance(bound.vanishes_at, float) else true.get(bound.vanishes_at)
        if bound.parameter in true and nothing is not None:
            strength = abs(true[bound.parameter] - nothing)
            yield {"name": bound.name, "parameter": bound.parameter, "bound": bound.bound, "truth": strength}


def _cause(cause: FoundCause, truth: Truth, *, comparable: bool) -> Result:
    right = {hidden.name for hidden in truth.causes}
    true = {}
    if comparable and cause.name in right:
        true = true_values(truth, {name: estimate.mean for name, estimate in cause.parameters.items()})
    gain = cause.gain
    return {
        "name": cause.name,
        "named": cause.named,
        "probability": cause.probability,
        "gain": gain.elpd_difference,
        "gain_se": gain.elpd_se,
        "rmse": [gain.before.rmse, gain.after.rmse],
        "noise": gain.noise,
        "parameters": {
            name: {"mean": one.mean, "low": one.q025, "high": one.q975, "truth": true.get(name)}
            for name, one in cause.parameters.items()
        },
    }


if __name__ == "__main__":
    sys.exit(main())

"""What discovery finds in measured data: tracks of gliders and pucks, as they are and with a known effect added.

    python benchmarks/measured.py [--json FILE] [--docs docs] [--only NAME,NAME] [--results FOLDER]

Runs what `vrdp-prob discover FOLDER` runs, on each set of ../shared/data that motion capture has measured: whole runs
are left out and predicted. Then an effect of known strength is added to the same tracks, so that noise and misfit are
real and the truth is known. `finding.html` of each run is kept in `--results`, as are its steps, so that a run that was
interrupted goes on (its seconds are then those since); delete that folder after a change of the code. `--docs` writes
the tables into `measured-data.md` there, and figures of tracks as they are beside it.
"""

import argparse
import os
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import torch
from _finding_figures import copy_figures, keep_figures
from _injected import injected
from _page import page_parser, publish, table_row
from _resumable import Result, measured

from vrdp_prob.datasets import load_all
from vrdp_prob.discovery.discover import discover
from vrdp_prob.discovery.finding import Finding
from vrdp_prob.discovery.page.document import to_document, write_finding
from vrdp_prob.inference import default_model
from vrdp_prob.models.simulator.rollout import compile_model

DATA = Path(__file__).parents[2] / "shared" / "data"
RESULTS = Path("out") / "measured"
FREE, GLIDERS, PUCKS = "glider_free_1d", "glider_collisions_1d_rubber", "puck_collisions_2d"
TRUE_PARAMETER = {"surface_tilt": "tilt_x", "linear_drag": "linear_drag", "lens_distortion": "distortion"}

ERRORS = ("rmse", "rmse_one_second", "rmse_end")
"""Errors of predicted positions that are told: over all frames, one second ahead, and at the end."""


@dataclass(frozen=True)
class Task:
    """A set of tracks (the first few videos of it, where a number is given), and what is added to it."""

    tracks: str
    way: str | None = None
    strength: float = 0.0
    first: int | None = None

    @property
    def name(self) -> str:
        """A name, also of the folder of its finding."""
        chosen = self.tracks if self.first is None else f"{self.tracks}-first-{self.first}"
        return chosen if self.way is None else f"{chosen}+{self.way}-{self.strength:g}"


TASKS = (
    Task(FREE),
    Task(FREE, "surface_tilt", 0.003),
    Task(FREE, "linear_drag", 0.05),
    Task(FREE, "linear_drag", 0.3),
    Task(FREE, "lens_distortion", 0.02),
    Task(FREE, "lens_distortion", 0.1),
    Task(GLIDERS),
    Task(GLIDERS, "lens_distortion", 0.1),
    Task(GLIDERS, first=8),
    Task(GLIDERS, "surface_tilt", 0.003, first=8),
    Task(PUCKS, first=8),
    Task(PUCKS, "surface_tilt", 0.003, first=8),
    Task(PUCKS, "lens_distortion", 0.2, first=8),
    Task(PUCKS),
    Task(PUCKS, "lens_distortion", 0.2),
)


def main(arguments: Sequence[str] | None = None) -> int:
    options = _parser().parse_args(arguments)
    tasks = {task.name: task for task in TASKS if (DATA / task.tracks).is_dir()}
    if options.only:
        tasks = {name: tasks[name] for name in options.only.split(",")}
    if not tasks:
        print(f"no data at {DATA}: nothing measured")
        return 0
    compile_model(default_model())

    results = measured(
        _Searched(options.results),
        tasks,
        options.results / "results.jsonl",
        field="name",
        label="Measured data",
        processes=options.processes,
    )
    text = "\n".join([*_findings(results, tasks), *_recovered(results, tasks)])
    publish(text, "measured-data.md", {"results": results}, options)
    if options.docs:
        for task in (one for one in tasks.values() if one.way is None):
            copy_figures(options.results / task.name, options.docs, f"measured-{task.name}")
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = page_parser(__doc__, RESULTS)
    parser.add_argument("--only", help=f"names, separated by commas; of {', '.join(task.name for task in TASKS)}")
    return parser


@dataclass(frozen=True)
class _Searched:
    """Discovery on a task, its finding written to a folder."""

    folder: Path

    def __call__(self, task: Task) -> Result:
        torch.set_num_threads(1)
        videos = load_all(DATA / task.tracks)[: task.first]
        if task.way is not None:
            videos = [injected(one, task.way, task.strength) for one in videos]
        begin = time.process_time()
        finding = discover(videos, seed=0, processes=1, checkpoint=self.folder / "steps" / task.name)
        seconds = time.process_time() - begin
        write_finding(finding, self.folder / task.name)
        keep_figures(finding, self.folder / task.name)
        return {"name": task.name, "videos": len(videos), "seconds": seconds, **_summary(finding)}


def _summary(finding: Finding) -> Result:
    document = to_document(finding)
    kept = ("verdict", "sentence", "causes", "predicted", "evidence", "evidence_after", "notes")
    return {key: document[key] for key in kept}


def _findings(results: Sequence[Result], tasks: Mapping[str, Task]) -> list[str]:
    """What was found in the tracks as they are."""
    head: tuple[str, ...] = ("set", "videos", "verdict", "causes", "gain, nats", "error, mm", "one second ahead")
    head += ("at the end", "90 % hold", "noise, mm", "checks that fail", "CPU min", "commit")
    lines = [table_row(*head), table_row(*["---"] * len(head))]
    return lines + [table_row(*_row(result)) for result in results if tasks[result["name"]].way is None]


def _row(result: Result) -> list[str]:
    named = [one for one in result["causes"] if one["named"]]
    cells = [f"`{result['name']}`", str(result["videos"]), result["verdict"]]
    cells.append(", ".join(f"`{one['name']}` {one['probability']:.2f}" for one in named) or "-")
    gains = [one["held_out_gain"] for one in named]
    cells.append(", ".join(map(_nats, gains)) or "-")
    if gains:
        cells += [", ".join(_errors(one)[k] for one in gains) for k in range(len(ERRORS))]
        cells += [", ".join(_covered(one) for one in gains), _mm(gains[0]["noise_sd"])]
    elif given := result.get("predicted"):
        cells += [_mm(given[key]) for key in ERRORS]
        cells += [f"{100 * given['coverage_90']:.0f} %", _mm(given["noise_sd"])]
    else:
        cells += ["-"] * (len(ERRORS) + 2)
    return [*cells, _failing(result), f"{result['seconds'] / 60:.0f}", f"`{result['version']}`"]


def _nats(gain: Result) -> str:
    return f"{gain['elpd_difference']:.0f} ± {gain['elpd_se']:.0f}"


def _errors(gain: Result) -> list[str]:
    """Errors of what is predicted of left-out videos, without and with a cause, in the order of `ERRORS`."""
    return [f"{_mm(gain['before'][key])} → {_mm(gain['after'][key])}" for key in ERRORS]


def _covered(gain: Result) -> str:
    """Share of the positions of left-out videos within 90 % of what is predicted, without and with a cause."""
    return " → ".join(f"{100 * gain[when]['coverage_90']:.0f} %" for when in ("before", "after"))


def _failing(result: Result) -> str:
    """Checks that fail under the model that was given and under the extended one, of so many."""
    before, after = (
        sum(check["significant"] for check in result[when] or ()) for when in ("evidence", "evidence_after")
    )
    extended = f" → {after}" if any(one["named"] for one in result["causes"]) else ""
    return f"{before}{extended} of {len(result['evidence'])}"


def _mm(value: float | None) -> str:
    return "-" if value is None else f"{1e3 * value:.3g}"


def _recovered(results: Sequence[Result], tasks: Mapping[str, Task]) -> list[str]:
    """What became of the effects that were added."""
    head: tuple[str, ...] = ("set", "added", "strength", "verdict", "its probability", "found (95 %)", "inside")
    head += ("gain, nats", "error, mm", "one second ahead", "at the end")
    head += ("checks that fail", "named beside it", "commit")
    lines = ["", table_row(*head), table_row(*["---"] * len(head))]
    for result in results:
        task = tasks[result["name"]]
        if task.way is None:
            continue
        cause = next((one for one in result["causes"] if one["name"] == task.way), None)
        others = [one["name"] for one in result["causes"] if one["named"] and one["name"] != task.way]
        cells = [f"`{result['name'].partition('+')[0]}`", f"`{task.way}`", f"{task.strength:g}", result["verdict"]]
        if cause is None:
            cells += ["-"] * (4 + len(ERRORS))
        else:
            found = cause["parameters"][TRUE_PARAMETER[task.way]]
            inside = "yes" if found["q025"] <= task.strength <= found["q975"] else "**no**"
            interval = f"{found['mean']:.3g} ({found['q025']:.3g} to {found['q975']:.3g})"
            gain = cause["held_out_gain"]
            cells += [f"{cause['probability']:.2f}", interval, inside, _nats(gain), *_errors(gain)]
        beside = ", ".join(f"`{one}`" for one in others) or "-"
        lines.append(table_row(*cells, _failing(result), beside, f"`{result['version']}`"))
    return lines


if __name__ == "__main__":
    sys.exit(main())

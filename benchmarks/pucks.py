"""Mass ratios of real discs from one collision each, against their weighed masses.

    python benchmarks/pucks.py [--json FILE] [--docs DIR] [--contacts frictionless,friction] [--sampler emcee]

Videos are those of ../shared/data/puck_mass_pairs_2d: two discs of known mass collide on an air table, filmed by motion
capture with a noise of about 15 micrometres. The masses and moments of inertia are withheld from the inference. The
physics is the default model, whose contacts are frictionless, and the same with friction in contacts; what it lacks
(air currents, a table that is not level) is left to the model error. Each result is written to `--results` (a folder)
as it comes, so that a run that was interrupted goes on. Without the data nothing is measured.
"""

import json
import os
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import torch
from _clock import processor_seconds
from _page import page_parser, publish, table_row
from _resumable import Result, measured

from vrdp_prob.datasets import load_all
from vrdp_prob.inference import default_model, infer
from vrdp_prob.models.effects.contact_friction import ContactFriction
from vrdp_prob.models.simulator.rollout import compile_model
from vrdp_prob.scene import Tracks

DATA = Path(__file__).parents[2] / "shared" / "data" / "puck_mass_pairs_2d"
RESULTS = Path("out") / "pucks"
LARGEST_MEDIAN, LEAST_COVERAGE = 0.03, 0.85
LEVELS = (0.5, 0.8, 0.9, 0.95)
SHOWN = 0.9
"""Probability of the intervals that the table tells of."""
CONTACTS = {"frictionless": default_model(), "friction": default_model().with_effect(ContactFriction())}
"""Models by what their contacts are like."""
Check = dict[str, object]


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print and write the tables."""
    parser = page_parser(__doc__, RESULTS, document="checks")
    parser.add_argument("--sampler", default="emcee")
    parser.add_argument("--contacts", default=",".join(CONTACTS), help="models, by what their contacts are like")
    options = parser.parse_args(arguments)
    chosen = options.contacts.split(",")
    if unknown := [name for name in chosen if name not in CONTACTS]:
        parser.error(f"no contacts are called {unknown[0]}; there are {', '.join(CONTACTS)}")
    if not DATA.is_dir():
        if options.json:
            options.json.write_text(json.dumps({"checks": checks({name: [] for name in chosen})}, indent=1) + "\n")
        print(f"no data at {DATA}: nothing measured")
        return 0
    videos = {tracks.video: tracks for tracks in load_all(DATA)}
    results = {}
    for name in chosen:
        compile_model(CONTACTS[name])
        asked = {video: (name, options.sampler, tracks) for video, tracks in videos.items()}
        path = options.results / f"{name}-{options.sampler}.jsonl"
        label = f"Pucks (contacts: {name})"
        results[name] = measured(one, asked, path, field="video", label=label, processes=options.processes)
    publish(tables(results), "pucks.md", {"checks": checks(results)}, options)
    return 0


def one(task: tuple[str, str, Tracks]) -> Result:
    """What a collision says about the mass ratio of a video whose masses are withheld."""
    contacts, sampler, tracks = task
    torch.set_num_threads(1)
    masses = [body.mass for body in tracks.bodies]
    bodies = tuple(replace(body, mass=None, inertia=None) for body in tracks.bodies)
    begin = processor_seconds()
    withheld = Tracks(tracks.video, bodies, tracks.data, tracks.walls)
    posterior = infer(withheld, model=CONTACTS[contacts], sampler=sampler)
    draws = posterior.data["posterior"].to_dataset()["mass"].values.reshape(-1, 2)
    log_ratio = np.log(draws[:, 0] / draws[:, 1])
    true = float(np.log((masses[0] or np.nan) / (masses[1] or np.nan)))
    estimate = float(np.median(log_ratio))
    return {
        "video": tracks.video,
        "true": float(np.exp(true)),
        "estimate": float(np.exp(estimate)),
        "error": float(np.expm1(estimate - true)),
        "relative_sd": float(log_ratio.std()),
        "inside": {str(level): _holds(log_ratio, level, true) for level in LEVELS},
        "acceleration": None if posterior.misfit is None else posterior.misfit.error_acceleration,
        "converged": posterior.convergence.converged,
        "seconds": processor_seconds() - begin,
    }


def _holds(draws: np.ndarray, level: float, true: float) -> bool:
    """Whether the central interval of some draws holds a value."""
    low, high = np.quantile(draws, [(1 - level) / 2, (1 + level) / 2])
    return bool(low <= true <= high)


def tables(results: dict[str, list[Result]]) -> str:
    """What all videos say together, and each of them, by the contacts."""
    summaries = [
        table_row("contacts", "runs", "median error", "largest", *_held(), "converged", "s of a processor, median"),
        "|---|---|---|---|" + "---|" * (len(LEVELS) + 2),
        *(summary(name, mine) for name, mine in results.items()),
    ]
    head = ("weighed ratio", "estimate", "error", "posterior sd", f"in {100 * SHOWN:.0f} % interval")
    parts = ["\n".join(summaries)]
    for name, mine in results.items():
        rows = [
            table_row("video", *head, "unknown acceleration, m/s^2", "converged"),
            "|---" * (len(head) + 3) + "|",
            *map(line, mine),
        ]
        parts += [f"### Contacts: {name}", "\n".join(rows)]
    commits = sorted({one["version"] for mine in results.values() for one in mine})
    return "\n\n".join([*parts, f"Of commit {', '.join(commits)}."])


def _held() -> list[str]:
    return [f"{100 * level:.0f} % intervals hold it" for level in LEVELS]


def line(result: Result) -> str:
    """A row of the table of a model."""
    strange = "-" if result["acceleration"] is None else f"{result['acceleration']:.3f}"
    return table_row(
        result["video"],
        f"{result['true']:.3f}",
        f"{result['estimate']:.3f}",
        f"{100 * result['error']:+.1f} %",
        f"{100 * result['relative_sd']:.1f} %",
        _yes(result["inside"][str(SHOWN)]),
        strange,
        _yes(result["converged"]),
    )


def _yes(true: bool) -> str:
    return "yes" if true else "no"


def summary(name: str, results: Sequence[Result]) -> str:
    """What all videos say together."""
    errors = np.array([abs(result["error"]) for result in results])
    inside = [sum(result["inside"][str(level)] for result in results) for level in LEVELS]
    return table_row(
        name,
        str(len(results)),
        f"{100 * np.median(errors):.1f} %",
        f"{100 * errors.max():.1f} %",
        *map(str, inside),
        str(sum(result["converged"] for result in results)),
        f"{np.median([result['seconds'] for result in results]):.0f}",
    )


def checks(results: dict[str, list[Result]]) -> list[Check]:
    """The goals; not met where nothing was measured."""
    entries: list[Check] = []
    for name, mine in results.items():
        median = float(np.median([abs(result["error"]) for result in mine])) if mine else None
        coverage = float(np.mean([result["inside"][str(SHOWN)] for result in mine])) if mine else None
        small = median is not None and median <= LARGEST_MEDIAN
        covers = coverage is not None and coverage >= LEAST_COVERAGE
        for title, value, goal, met in (
            ("median relative error", median, LARGEST_MEDIAN, small),
            (f"coverage of {100 * SHOWN:.0f} % intervals", coverage, LEAST_COVERAGE, covers),
        ):
            entries.append({"name": f"mass ratio, contacts: {name}: {title}", "value": value, "goal": goal, "ok": met})
    return entries


if __name__ == "__main__":
    sys.exit(main())

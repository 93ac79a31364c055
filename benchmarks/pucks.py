"""Mass ratios of real discs from one collision each, against their weighed masses.

    python benchmarks/pucks.py [--json FILE] [--docs DIR] [--sampler emcee] [--videos A:B] [--model FILE.toml]

Videos are those of ../shared/data/puck_mass_pairs_2d: two discs of known mass collide on an air table, filmed by motion
capture with a noise of about 15 micrometres. The masses and moments of inertia are withheld from the inference. The
physics is the default model, with frictionless contacts, or the one of a file; what it lacks (air currents, a table
that is not level, contact friction) is left to the model error. Without the data nothing is measured.
"""

import argparse
import json
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import torch

from vrdp_prob.datasets import load_all
from vrdp_prob.inference import default_model, infer
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.rollout import compile_model
from vrdp_prob.scene import Tracks

DATA = Path(__file__).parents[2] / "shared" / "data" / "puck_mass_pairs_2d"
LARGEST_MEDIAN, LEAST_COVERAGE = 0.03, 0.85
LEVELS = (0.5, 0.8, 0.9, 0.95)
Check = dict[str, object]


@dataclass(frozen=True)
class Result:
    """What one collision says about a mass ratio; numbers without units, the acceleration in m/s^2."""

    video: str
    true: float
    estimate: float
    relative_sd: float
    levels: dict[float, bool]
    acceleration: float | None
    converged: bool
    seconds: float

    @property
    def error(self) -> float:
        """Relative error of the median."""
        return self.estimate / self.true - 1


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="file for the checks")
    parser.add_argument("--docs", type=Path, help="folder of the documentation; its pucks.md gets the table")
    parser.add_argument("--sampler", default="emcee")
    parser.add_argument("--videos", default=":", help="videos to take, for example 0:5")
    parser.add_argument("--model", type=Path, help="physics, a TOML file; the default model otherwise")
    options = parser.parse_args(arguments)
    torch.set_num_threads(1)
    results: list[Result] = []
    if DATA.is_dir():
        model = default_model() if options.model is None else PhysicsModel.read(options.model)
        compile_model(model)
        begin, end = (int(part) if part else None for part in options.videos.split(":"))
        videos = load_all(DATA)[begin:end]
        with ThreadPoolExecutor(max_workers=2) as workers:
            for result in workers.map(partial(measured, sampler=options.sampler, model=model), videos):
                results.append(result)
                print(line(result), flush=True)
        print(*summary(results), sep="\n")
    else:
        print(f"no data at {DATA}: nothing measured")
    if options.docs and results:
        write_page(options.docs / "pucks.md", results)
    if options.json:
        options.json.write_text(json.dumps({"checks": checks(results)}, indent=1) + "\n", encoding="utf-8")
    return 0


def measured(tracks: Tracks, *, sampler: str, model: PhysicsModel) -> Result:
    """Infer the mass ratio of a video whose masses are withheld."""
    masses = [body.mass for body in tracks.bodies]
    bodies = tuple(replace(body, mass=None, inertia=None) for body in tracks.bodies)
    begin = time.perf_counter()
    posterior = infer(Tracks(tracks.video, bodies, tracks.data, tracks.walls), model=model, sampler=sampler)
    seconds = time.perf_counter() - begin
    draws = posterior.data["posterior"].to_dataset()["mass"].values.reshape(-1, 2)
    log_ratio = np.log(draws[:, 0] / draws[:, 1])
    true = float(np.log((masses[0] or np.nan) / (masses[1] or np.nan)))
    levels = {}
    for level in LEVELS:
        low, high = np.quantile(log_ratio, [(1 - level) / 2, (1 + level) / 2])
        levels[level] = bool(low <= true <= high)
    return Result(
        tracks.video,
        float(np.exp(true)),
        float(np.exp(np.median(log_ratio))),
        float(log_ratio.std()),
        levels,
        np.nan if posterior.misfit is None else posterior.misfit.error_acceleration,
        posterior.convergence.converged,
        seconds,
    )


def line(result: Result) -> str:
    """A row of the table."""
    inside = "yes" if result.levels[0.9] else "no"
    strange = "-" if result.acceleration is None else f"{result.acceleration:.3f}"
    return (
        f"| {result.video} | {result.true:.3f} | {result.estimate:.3f} | {100 * result.error:+.1f} % | "
        f"{100 * result.relative_sd:.1f} % | {inside} | {strange} | {'yes' if result.converged else 'no'} |"
    )


def summary(results: Sequence[Result]) -> list[str]:
    """What all videos say together."""
    errors = np.array([abs(result.error) for result in results])
    lines = [f"{len(results)} videos; median error {100 * np.median(errors):.1f} %, largest {100 * errors.max():.1f} %"]
    for level in LEVELS:
        inside = sum(result.levels[level] for result in results)
        lines.append(f"{100 * level:.0f} % intervals hold the weighed ratio in {inside} of {len(results)}")
    lines.append(f"median time {np.median([result.seconds for result in results]):.0f} s per video, two at once")
    return lines


def checks(results: Sequence[Result]) -> list[Check]:
    """The goals."""
    titles = ("mass ratio: median relative error", "mass ratio: coverage of 90 % intervals")
    if not results:
        goals = (LARGEST_MEDIAN, LEAST_COVERAGE)
        return [
            {"name": title, "value": None, "goal": goal, "ok": False} for title, goal in zip(titles, goals, strict=True)
        ]
    median = float(np.median([abs(result.error) for result in results]))
    coverage = float(np.mean([result.levels[0.9] for result in results]))
    return [
        {"name": titles[0], "value": median, "goal": LARGEST_MEDIAN, "ok": median <= LARGEST_MEDIAN},
        {"name": titles[1], "value": coverage, "goal": LEAST_COVERAGE, "ok": coverage >= LEAST_COVERAGE},
    ]


def write_page(page: Path, results: Sequence[Result]) -> None:
    """Put the table between the marks of a page."""
    text = page.read_text(encoding="utf-8")
    begin, end = "<!-- table -->", "<!-- end of table -->"
    head, tail = text.split(begin)[0], text.split(end)[1]
    heading = (
        "| video | weighed ratio | estimate | error | posterior sd | in 90 % interval | unknown acceleration, m/s^2 | "
        "converged |\n|---|---|---|---|---|---|---|---|"
    )
    rows = [*summary(results), "", heading, *map(line, results)]
    page.write_text(head + begin + "\n" + "\n".join(rows) + "\n" + end + tail, encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())

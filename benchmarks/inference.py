"""Time, effective sample size per second and gradient count of each sampler, and how well the MAP explains each video.

    python benchmarks/inference.py [--json FILE] [--scenes 0,3,10] [--samplers emcee,nuts,laplace] [--fits 0:60]

Videos are those of ../shared/data/clevrer_bullet (tracks); without them nothing is measured. Times are those of the
processor over all threads, so that they say the same on a busy machine; on two cores emcee takes about half of it.
"""

import argparse
import json
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch

from vrdp_prob.datasets import load_all
from vrdp_prob.inference import SAMPLERS, default_model
from vrdp_prob.inference.events import first_contacts
from vrdp_prob.inference.map_fit import MapFit, fit_map
from vrdp_prob.inference.proposals import proposals
from vrdp_prob.inference.samples import assess
from vrdp_prob.models.simulator.rollout import compile_model
from vrdp_prob.scene import Tracks

DATA = Path(__file__).parents[2] / "shared" / "data" / "clevrer_bullet"
GOALS = {"map": 5.0, "emcee": 60.0, "nuts": 60.0, "laplace": 10.0}
"""Seconds."""
DRAWS = 1000
Check = dict[str, object]


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="file for the checks")
    parser.add_argument("--scenes", default="0,3,10", help="scenes to sample, for example 0,3,10")
    parser.add_argument("--samplers", default="emcee,nuts,laplace")
    parser.add_argument("--fits", default="", help="scenes to fit and compare with the annotation, for example 0:60")
    options = parser.parse_args(arguments)
    torch.set_num_threads(1)
    checks: list[Check] = []
    if DATA.is_dir():
        videos = {tracks.video: tracks for tracks in load_all(DATA)}
        compile_model(default_model())
        checks += fits([videos[name(scene)] for scene in numbers(options.fits)])
        checks += samplers([videos[name(scene)] for scene in numbers(options.scenes)], options.samplers.split(","))
    else:
        print(f"no data at {DATA}: nothing measured")
        checks = [check(f"{key}: processor seconds, median", None, goal, met=False) for key, goal in GOALS.items()]
    if options.json:
        options.json.write_text(json.dumps({"checks": checks}, indent=1) + "\n", encoding="utf-8")
    return 0


def name(scene: int) -> str:
    return f"video_{scene:05d}"


def numbers(text: str) -> list[int]:
    """Scenes of `0,3,10:12` (the end is left out)."""
    found: list[int] = []
    for part in filter(None, text.split(",")):
        begin, _, end = part.partition(":")
        found += range(int(begin), int(end)) if end else [int(begin)]
    return found


def check(title: str, value: float | str | None, goal: float | str, *, met: bool) -> Check:
    return {"name": title, "value": value, "goal": goal, "ok": met}


def fits(videos: Sequence[Tracks]) -> list[Check]:
    """Fit videos and compare the collisions of the best fit with the annotated ones."""
    if not videos:
        return []
    print("video          seconds  worlds  error of fit  noise   worst body  collisions: found missed invented")
    times, found, missed, invented, errors = [], 0, 0, 0, []
    for tracks in videos:
        begin = time.process_time()
        fit = fit_map(tracks, default_model(), np.random.default_rng(0))
        times.append(time.process_time() - begin)
        true, fitted = annotated(tracks), collisions(fit)
        counts = len(true & fitted), len(true - fitted), len(fitted - true)
        found, missed, invented = found + counts[0], missed + counts[1], invented + counts[2]
        errors.append(fit.misfit.residual_sd)
        print(
            f"{tracks.video}  {times[-1]:6.1f}  {fit.evaluations:6d}   {fit.misfit.residual_sd:8.4f} m  "
            f"{fit.noise:.4f}  {fit.misfit.worst_sd:8.4f} m             {counts[0]:3d} {counts[1]:5d} {counts[2]:6d}"
        )
    median = float(np.median(times))
    share = found / max(found + missed, 1)
    print(f"all: {median:.1f} s and {np.median(errors):.4f} m in the median; {found=} {missed=} {invented=}")
    return [
        check("map: processor seconds, median", median, GOALS["map"], met=median <= GOALS["map"]),
        check("map: share of annotated collisions in the best fit", share, 0.95, met=share >= 0.95),
    ]


def annotated(tracks: Tracks) -> set[frozenset[str]]:
    """Pairs of the annotation's collisions; for scoring alone."""
    file = DATA / "annotations" / f"annotation_{tracks.video[-5:]}.json"
    document = json.loads(file.read_text(encoding="utf-8"))
    return {frozenset(str(number) for number in event["object_ids"]) for event in document["collision"]}


def collisions(fit: MapFit) -> set[frozenset[str]]:
    with torch.no_grad():
        rollout = fit.likelihood.rollout(torch.from_numpy(fit.point[None]))
    bodies = fit.likelihood.tracks.bodies
    return {frozenset((bodies[i].id, bodies[j].id)) for i, j in first_contacts(rollout, 0)}


def samplers(videos: Sequence[Tracks], names: Sequence[str]) -> list[Check]:
    """Run every sampler from the same MAP."""
    results: dict[str, list[tuple[float, float]]] = {key: [] for key in names}
    print("video        unknowns  sampler  seconds  draws' ESS  ESS/s  densities  gradients  converged")
    for tracks in videos:
        fit = fit_map(tracks, default_model(), np.random.default_rng(0))
        for key in names:
            begin = time.process_time()
            samples = SAMPLERS[key](
                fit.likelihood.log_density,
                proposals(fit.modes, fit.likelihood.residuals),
                draws=DRAWS,
                generator=np.random.default_rng(1),
            )
            seconds = time.process_time() - begin
            convergence = assess(key, samples)
            ess = convergence.ess_bulk or 0.0
            results[key].append((seconds, ess / seconds))
            print(
                f"{tracks.video}  {len(fit.point):8d}  {key:7s}  {seconds:7.1f}  {ess:10.0f}  {ess / seconds:5.1f}  "
                f"{samples.evaluations:9d}  {samples.gradients:9d}  {convergence.converged}",
                flush=True,
            )
    return _sampler_checks(results)


def _sampler_checks(results: dict[str, list[tuple[float, float]]]) -> list[Check]:
    checks, rates = [], {}
    for key, values in ((key, values) for key, values in results.items() if values):
        seconds, rate = (float(np.median(column)) for column in zip(*values, strict=True))
        checks.append(check(f"{key}: processor seconds, median", seconds, GOALS[key], met=seconds <= GOALS[key]))
        if key != "laplace":
            rates[key] = rate
    if rates:
        best = max(rates, key=lambda key: rates[key])
        print(f"default sampler: {best} ({', '.join(f'{key} {rate:.1f} ESS/s' for key, rate in rates.items())})")
        checks.append(check("default sampler", best, "the one with more ESS per second", met=best == "emcee"))
    return checks


if __name__ == "__main__":
    sys.exit(main())

"""Time, effective sample size per second and gradient count of each sampler.

    python benchmarks/inference.py [--json FILE] [--scenes 0,2,3] [--samplers emcee,nuts,laplace] [--peer GRADIENTS]

Videos are those of ../shared/data/clevrer_bullet (tracks); without them no sampler is timed. Times are those of the
processor over all threads and processes, so that they say the same on a busy machine; on two cores emcee and NUTS take
about half of it. The peer is Pyro's NUTS on the fixed-step simulator in torch, on three discs: it is stopped after so
many gradients, since it takes hours to converge, and its time to 400 effective draws is that of its gradients times as
many as NUTS needs on our simulator for the same posterior. Whether samplers agree is asked by `agreement.py`.
"""

import argparse
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import torch

sys.path.insert(0, str(Path(__file__).parents[1]))  # the scenes of the tests

from _clock import processor_seconds
from _fixed_step_posterior import FixedStepPosterior

from tests.inference.generator import observe, random_scene
from vrdp_prob.datasets import load_all
from vrdp_prob.inference import SAMPLERS, default_model
from vrdp_prob.inference.draws.diagnostics import Reported
from vrdp_prob.inference.draws.samples import ESS_GOAL, assess
from vrdp_prob.inference.infer import sampled
from vrdp_prob.inference.map_fit import fit_map
from vrdp_prob.inference.samplers.nuts_chain import Task, make
from vrdp_prob.inference.samplers.proposals import proposals
from vrdp_prob.inference.samplers.straightening import Rates
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.rollout import compile_model
from vrdp_prob.scene import Tracks

DATA = Path(__file__).parents[2] / "shared" / "data" / "clevrer_bullet"
GOALS = {"emcee": 120.0, "nuts": 120.0, "laplace": 20.0}
"""Processor seconds: twice the seconds on two cores."""
DRAWS = 1000
Check = dict[str, object]


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="file for the checks")
    parser.add_argument("--scenes", default="0,2,3", help="practice videos to sample, for example 0,2,3")
    parser.add_argument("--samplers", default="emcee,nuts,laplace")
    parser.add_argument("--peer", type=int, default=300, metavar="GRADIENTS", help="gradients of the peer; 0: no peer")
    options = parser.parse_args(arguments)
    torch.set_num_threads(1)
    compile_model(default_model())
    checks: list[Check] = []
    if DATA.is_dir():
        videos = {tracks.video: tracks for tracks in load_all(DATA)}
        chosen = [videos[f"video_{int(scene):05d}"] for scene in filter(None, options.scenes.split(","))]
        checks += samplers(chosen, options.samplers.split(","))
    else:
        print(f"no data at {DATA}: no sampler timed")
        checks += [check(f"{key}: processor seconds, median", None, goal, met=False) for key, goal in GOALS.items()]
    if options.peer:
        checks += peer(options.peer)
    if options.json:
        options.json.write_text(json.dumps({"checks": checks}, indent=1) + "\n", encoding="utf-8")
    return 0


def check(title: str, value: float | str | None, goal: float | str, *, met: bool) -> Check:
    return {"name": title, "value": value, "goal": goal, "ok": met}


def samplers(videos: Sequence[Tracks], names: Sequence[str]) -> list[Check]:
    """Run every sampler from the same modes."""
    results: dict[str, list[tuple[float, float, bool]]] = {key: [] for key in names}
    print("video        unknowns  sampler  cpu s  ESS bulk  tail  ESS/s  densities  gradients  converged")
    for tracks in videos:
        fit = fit_map(tracks, default_model(), np.random.default_rng(0))
        reported = Reported.of(fit.likelihood.coordinates, fit.contacts, fit.likelihood.tracks.bodies)
        for key in names:
            begin = processor_seconds()
            samples = sampled(fit, key, draws=DRAWS, generator=np.random.default_rng(1), reported=reported)
            seconds = processor_seconds() - begin
            convergence = assess(key, samples, reported)
            bulk, tail = convergence.ess_bulk or 0.0, convergence.ess_tail or 0.0
            results[key].append((seconds, min(bulk, tail) / seconds, convergence.converged))
            handed = "" if convergence.sampler == key else f", by {convergence.sampler}"
            print(
                f"{tracks.video}  {len(fit.point):8d}  {key:7s}  {seconds:5.1f}  {bulk:8.0f}  {tail:4.0f}  "
                f"{min(bulk, tail) / seconds:5.1f}  {samples.evaluations:9d}  {samples.gradients:9d}  "
                f"{convergence.converged}{handed}",
                flush=True,
            )
    return _sampler_checks(results)


def _sampler_checks(results: dict[str, list[tuple[float, float, bool]]]) -> list[Check]:
    checks, rates = [], {}
    for key, values in ((key, values) for key, values in results.items() if values):
        each_seconds, each_rate, each_converged = zip(*values, strict=True)
        seconds, rate = float(np.median(each_seconds)), float(np.median(each_rate))
        converged = float(np.mean(each_converged))
        checks.append(check(f"{key}: processor seconds, median", seconds, GOALS[key], met=seconds <= GOALS[key]))
        checks.append(check(f"{key}: share of videos converged", converged, 1.0, met=converged == 1.0))
        if key != "laplace":
            rates[key] = rate
    if rates:
        best = max(rates, key=lambda key: rates[key])
        print(f"default sampler: {best} ({', '.join(f'{key} {rate:.1f} ESS/s' for key, rate in rates.items())})")
        checks.append(check("default sampler", best, "the one with more ESS per second", met=best == "emcee"))
    return checks


def peer(most_gradients: int) -> list[Check]:
    """Pyro's NUTS on our simulator and on the fixed-step one, for the same tracks of three discs."""
    scene = random_scene(np.random.default_rng(500), bodies=3, squares=False)
    fit = fit_map(observe(scene, noise=0.01, seed=0), PhysicsModel.base(), np.random.default_rng(0))
    reported = Reported.of(fit.likelihood.coordinates, fit.contacts, fit.likelihood.tracks.bodies)
    start = proposals(fit.modes, fit.likelihood.residuals, Rates.of(fit.likelihood.tracks, fit.likelihood.coordinates))
    begin = processor_seconds()
    generator = np.random.default_rng(1)
    samples = SAMPLERS["nuts"](
        fit.likelihood.log_density, start, draws=DRAWS, generator=generator, reported=reported, processes=1
    )
    ours = (processor_seconds() - begin) / max(samples.gradients, 1)
    found = assess("nuts", samples, reported)
    effective = min(found.ess_bulk or 0.0, found.ess_tail or 0.0)
    needed = samples.gradients * ESS_GOAL / max(effective, 1.0)
    slow, place = FixedStepPosterior(fit.likelihood), np.zeros((1, len(fit.point)))
    task = Task(slow, start.components[0], place, np.array([0.3]), transitions=1, seeds=(0,))
    begin, gradients = processor_seconds(), 0
    while gradients < most_gradients:
        piece = make(task)
        gradients += piece.gradients
    theirs = (processor_seconds() - begin) / gradients
    print("NUTS on three discs      ms per gradient  seconds to 400 effective draws")
    print(f"event-driven             {1e3 * ours:15.2f}  {ours * needed:10.0f}  (measured, {effective:.0f} effective)")
    print(f"fixed steps in torch     {1e3 * theirs:15.1f}  {theirs * needed:10.0f}  (from {gradients} gradients)")
    ratio = theirs / ours
    return [check("NUTS: fixed-step over event-driven seconds per gradient", ratio, 10.0, met=ratio >= 10)]


if __name__ == "__main__":
    sys.exit(main())

"""Whether posteriors are calibrated: ranks and coverage of true values over scenes from the prior, by sampler.

    python benchmarks/calibration.py [--json FILE] [--docs docs] [--scenes 200] [--samplers laplace,emcee] [--show]

`laplace-alone` is `laplace` without emcee, on to which it hands what it cannot be trusted with.
Scenes come from the prior that the inference believes in, their motion from an integrator that is not the simulator
(`tests/inference/prior_scenes.py`). Each scene's result is written to `--results` (a folder) as it comes, so that a run
that was interrupted goes on; results of another version of the code are to be deleted by hand. `--show` only reads the
results there are. `--docs` writes the tables into `calibration.md` there, and the figures beside it. One process per
core; the figures need matplotlib.
"""

import argparse
import json
import os
import sys
from collections.abc import Iterator, Sequence
from itertools import count, islice
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))  # the scenes are those of the tests
os.environ.setdefault("OMP_NUM_THREADS", "1")

import torch
from _calibration_page import checks, figures, page, tables
from _clock import processor_seconds
from _resumable import Result, measured, read

from tests.inference.prior_scenes import PriorScene, prior_scene
from tests.inference.scene_ranks import ranks
from vrdp_prob.errors import InputError
from vrdp_prob.inference import SAMPLERS, Posterior, default_model, infer
from vrdp_prob.models.simulator.rollout import compile_model

DRAWS = 1000
ALONE = "laplace-alone"
"""The fast way where it does not hand on to emcee."""
RESULTS = Path("out") / "calibration"


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="file for the checks")
    parser.add_argument(
        "--docs", type=Path, help="folder of the documentation, whose page and figures are written anew"
    )
    parser.add_argument("--scenes", type=int, default=200, help="scenes per sampler")
    parser.add_argument("--samplers", default="laplace-alone,laplace,emcee,nuts")
    parser.add_argument("--results", type=Path, default=RESULTS, help="folder of the results, which are gone on with")
    parser.add_argument("--show", action="store_true", help="compute nothing, show all results there are")
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    options = parser.parse_args(arguments)
    names = options.samplers.split(",")
    unknown = [name for name in names if name not in (*SAMPLERS, ALONE)]
    if unknown:
        parser.error(f"no sampler {unknown[0]}; there are {', '.join(SAMPLERS)} and {ALONE}")
    if options.show:
        results = {name: read(results_of(name, options.results)) for name in names}
    else:
        compile_model(default_model())
        seeds = list(islice(accepted(), options.scenes))
        results = {name: measure(name, seeds, options.results, options.processes) for name in names}
    print(tables(results))
    if options.docs:
        figures(results, options.docs / "figures")
        page(results, options.docs / "calibration.md")
    if options.json:
        options.json.write_text(json.dumps({"checks": checks(results)}, indent=1) + "\n", encoding="utf-8")
    return 0


def measure(sampler: str, seeds: Sequence[int], folder: Path, processes: int) -> list[Result]:
    """Results of some scenes, those that are not there yet computed and written one by one."""
    asked = {seed: (sampler, seed) for seed in seeds}
    label = f"Calibration ({sampler})"
    return measured(one, asked, results_of(sampler, folder), field="seed", label=label, processes=processes)


def results_of(sampler: str, folder: Path) -> Path:
    """File of the results of a sampler."""
    return folder / f"{sampler}.jsonl"


def accepted() -> Iterator[int]:
    """Seeds whose scenes are of the kind that is looked at."""
    return (seed for seed in count() if prior_scene(seed) is not None)


def one(task: tuple[str, int]) -> Result:
    """What a sampler makes of a scene."""
    sampler, seed = task
    torch.set_num_threads(1)
    scene = prior_scene(seed)
    assert scene is not None
    begin = processor_seconds()
    try:
        name, hand_on = ("laplace", False) if sampler == ALONE else (sampler, True)
        posterior = infer(scene.tracks, sampler=name, seed=seed, draws=DRAWS, hand_on=hand_on)
    except InputError as error:
        return {**facts(scene), "sampler": sampler, "refused": str(error)}
    return {**facts(scene), "sampler": sampler, **outcome(scene, posterior), "seconds": processor_seconds() - begin}


def facts(scene: PriorScene) -> Result:
    """What is true of a scene."""
    shapes = [str(shape) for shape in scene.scene.shapes]
    return {
        "seed": scene.seed,
        "shapes": shapes,
        "resting": int((scene.scene.velocity == 0).all(axis=1).sum()),
        "late": bool(scene.scene.release.any()),
        "noise": scene.noise,
        "contacts": len(scene.scene.contacts),
        "pairs": sorted(sorted(pair) for pair in scene.pairs),
    }


def outcome(scene: PriorScene, posterior: Posterior) -> Result:
    """What the posterior says, and where the truth lies in it."""
    found = {frozenset(pair) for pair in posterior.pairs}
    return {
        "converged": posterior.convergence.converged,
        "sentence": posterior.convergence.sentence,
        "pareto_k": posterior.convergence.pareto_k,
        "missed": len(scene.pairs - found),
        "invented": len(found - scene.pairs),
        "taken_to_rest": taken_to_rest(scene, posterior),
        "moving": int((scene.scene.velocity != 0).any(axis=1).sum()),
        "warnings": list(posterior.warnings),
        "ranks": [rank.to_document() for rank in ranks(scene, posterior)],
    }


def taken_to_rest(scene: PriorScene, posterior: Posterior) -> int:
    """Bodies that move when they are released and are held at rest in every draw."""
    velocity = posterior.data["posterior"]["velocity"].transpose("chain", "draw", "body", ...).values
    held = (velocity == 0).all(axis=(0, 1, 3))
    return int((held & (scene.scene.velocity != 0).any(axis=1)).sum())


if __name__ == "__main__":
    sys.exit(main())

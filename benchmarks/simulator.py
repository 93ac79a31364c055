"""Time, memory and accuracy of the simulator: `python benchmarks/simulator.py [--json FILE]`.

Prints a table and writes `{checks: [{name, value, goal, ok}]}`. Times are processor times of one thread, medians of
several runs after the first; the log density is that of independent normal errors of all positions.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.rollout import simulate
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.scene import Shape

FRAMES = torch.arange(128, dtype=torch.float64) * 0.04
DISCS = (Shape.CYLINDER, Shape.SPHERE, Shape.CYLINDER, Shape.SPHERE, Shape.CYLINDER)
MIXED = (Shape.CUBE, Shape.SPHERE, Shape.CYLINDER, Shape.CUBE, Shape.SPHERE)
NOISE = 0.01
UNMEASURED = (
    "speed against batched torch with fixed steps, discs, 1 world (goal 150x)",
    "speed against batched torch with fixed steps, mixed shapes, 1 world (goal 60x)",
    "speed against a compiled JAX scan with fixed steps, 256 worlds (goal 15x)",
)


def scenes(count: int, shapes: tuple[Shape, ...], seed: int = 0) -> Worlds:
    """Bodies around a centre that they move to."""
    generator = np.random.default_rng(seed)
    bodies = len(shapes)
    side = 1.8 * np.sqrt(bodies / 5)
    position = np.zeros((count, bodies, 2))
    for world in range(count):
        placed = 0
        while placed < bodies:
            candidate = generator.uniform(-side, side, 2)
            if all(np.hypot(*(candidate - other)) > 0.6 for other in position[world, :placed]):
                position[world, placed] = candidate
                placed += 1
    tensor = torch.from_numpy
    return Worlds(
        shapes=shapes,
        position=tensor(position),
        velocity=tensor(-position * generator.uniform(0.4, 1.2, (count, bodies, 1)))
        + tensor(generator.normal(0, 0.4, (count, bodies, 2))),
        angle=tensor(generator.uniform(0, 6, (count, bodies))),
        spin=tensor(generator.normal(0, 1, (count, bodies))),
        release_time=torch.zeros(count, bodies, dtype=torch.float64),
        mass=tensor(generator.lognormal(0, 0.5, (count, bodies))),
        restitution=tensor(generator.uniform(0.6, 1, (count, bodies))),
        radius=torch.full((count, bodies), 0.2, dtype=torch.float64),
        present=torch.ones(count, bodies, dtype=torch.bool),
        parameters={
            name: torch.full((count,), value, dtype=torch.float64)
            for name, value in {
                "sliding_friction": 0.1,
                "rolling_resistance": 0.03,
                "air_drag": 0.02,
                "angular_drag": 1.0,
            }.items()
        },
    )


def density_and_gradient(worlds: Worlds, model: PhysicsModel) -> Callable[[], None]:
    """One evaluation of log density and gradient for all worlds."""
    seen = simulate(worlds, FRAMES, model).trajectory[..., :2]
    names = ("position", "velocity", "mass", "restitution")

    def evaluate() -> None:
        leaves = {name: getattr(worlds, name).clone().requires_grad_() for name in names}
        predicted = simulate(replace(worlds, **leaves), FRAMES, model).trajectory[..., :2]
        (-0.5 * ((predicted - seen) / NOISE) ** 2).sum().backward()

    return evaluate


def seconds(function: Callable[[], None], repeats: int) -> float:
    """Median processor time of one call."""
    function()
    times = []
    for _ in range(repeats):
        start = time.process_time()
        function()
        times.append(time.process_time() - start)
    return float(np.median(times))


def compile_seconds() -> float:
    """Processor time to compile forward and backward on a machine that never did."""
    code = (
        "import time, torch; from benchmarks.simulator import *; w = scenes(1, MIXED); m = PhysicsModel.base();"
        "s = time.process_time(); density_and_gradient(w, m)(); print(time.process_time() - s)"
    )
    with tempfile.TemporaryDirectory() as folder:
        root = Path(__file__).resolve().parents[1]
        environment = {**os.environ, "VRDP_PROB_CACHE": folder, "PYTHONPATH": str(root)}
        done = subprocess.run(
            [sys.executable, "-c", code], env=environment, cwd=root, capture_output=True, text=True, check=True
        )
    return float(done.stdout)


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    torch.set_num_threads(1)
    model = PhysicsModel.base()
    checks: list[dict[str, object]] = []

    def check(name: str, value: float, goal: float) -> None:
        checks.append({"name": name, "value": value, "goal": goal, "ok": value <= goal})

    check("compile forward and backward, s", compile_seconds(), 20.0)
    for name, shapes in (("discs", DISCS), ("mixed shapes", MIXED)):
        one = seconds(density_and_gradient(scenes(1, shapes), model), 50)
        check(f"log density and gradient, 5 {name}, 1 world, ms", 1e3 * one, 1.0)
        many = seconds(density_and_gradient(scenes(256, shapes), model), 5) / 256
        check(f"the same per world at 256 worlds, {name}, ms", 1e3 * many, 0.2)
    checks += [{"name": name, "value": None, "goal": None, "ok": False} for name in UNMEASURED]
    for entry in checks:
        value = "not measured" if entry["value"] is None else f"{entry['value']:.3g} (goal {entry['goal']:g})"
        print(f"{'ok  ' if entry['ok'] else 'MISS'} {entry['name']}: {value}")
    for bodies in (2, 4, 8, 16, 32, 64):
        cost = seconds(density_and_gradient(scenes(4, (DISCS * 13)[:bodies]), model), 3) / 4
        print(f"     {bodies:4d} discs: {1e3 * cost:8.3f} ms per world")
    if options.json:
        options.json.write_text(json.dumps({"checks": checks}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

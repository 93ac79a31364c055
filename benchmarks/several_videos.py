"""What several videos say together: width and coverage of the shared friction, time and memory against their number.

    python benchmarks/several_videos.py [--json FILE] [--videos 1,3,10] [--short 30,100] [--sets 8]
    python benchmarks/several_videos.py --optimisers 3,10 [--json FILE] [--sets 8]

Videos are of the tests' own generator: three cylinders that hit one another (60 frames), and for many videos single
cylinders that slide (30 frames). All have the same friction and drag. Coverage is over several sets of fresh videos,
drawn by importance sampling and by chains; time is that of the processor over all threads. `--optimisers` draws
nothing and compares the joint fit by L-BFGS alone with that by Gauss-Newton.
"""

import argparse
import json
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from tests.inference.generator import Scene, integrate, observe  # noqa: E402 - needs the path above
from vrdp_prob.inference import FitPlan, Optimiser, SharedPosterior, fit_together, sample_together  # noqa: E402
from vrdp_prob.models.parameters import GRAVITY  # noqa: E402
from vrdp_prob.models.physics import PhysicsModel  # noqa: E402
from vrdp_prob.models.simulator.rollout import compile_model  # noqa: E402
from vrdp_prob.scene import Shape, Tracks  # noqa: E402

FRICTION, DRAG, NOISE = 0.05, 0.05, 0.005
LEVEL = 0.9
NEAR, SHARE = 0.5, 0.9
"""Nats by which L-BFGS may end below Gauss-Newton, and the share of sets in which it has to end no lower than that.
Single videos are fitted otherwise, too, so that a gap may come from these."""
LARGEST_MEMORY = 1000.0
"""MiB by which the resident memory may rise."""
STATUS = Path("/proc/self/status")
Check = dict[str, object]
Maker = Callable[[int], Tracks]


@dataclass
class Row:
    """One line of the table."""

    kind: str
    videos: int
    sampler: str
    sd: float
    covered: tuple[int, int]
    fit_seconds: float
    sample_seconds: float
    memory: float | None
    converged: int


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="file for the checks")
    parser.add_argument("--videos", default="1,3,10", help="numbers of videos with collisions")
    parser.add_argument("--short", default="30,100", help="numbers of short videos without")
    parser.add_argument("--sets", type=int, default=8, help="sets of fresh videos for the coverage, for each number")
    parser.add_argument("--gibbs", default="1,3,10", help="numbers of videos that chains are run for as well")
    parser.add_argument("--optimisers", help="numbers of videos with collisions that are fitted by both optimisers")
    options = parser.parse_args(arguments)
    torch.set_num_threads(1)
    compile_model(PhysicsModel.base())
    if options.optimisers:
        checks = [compared(count, options.sets) for count in numbers(options.optimisers)]
        if options.json:
            options.json.write_text(json.dumps({"checks": checks}, indent=1) + "\n", encoding="utf-8")
        return 0
    rows: list[Row] = []
    chained = numbers(options.gibbs)
    print("videos           sampler   sd of log friction  90 % covers  fit s  sampling s  memory MiB  converged")
    for kind, counts, maker in (
        ("three bodies", numbers(options.videos), colliding),
        ("one body", numbers(options.short), sliding),
    ):
        for count in counts:
            sets = options.sets if count <= 10 else max(1, options.sets // 6)
            rows.append(measured(kind, count, maker, "laplace", sets))
            if count in chained:
                rows.append(measured(kind, count, maker, "gibbs", sets))
    checks = judged(rows)
    if options.json:
        options.json.write_text(json.dumps({"checks": checks}, indent=1) + "\n", encoding="utf-8")
    return 0


def numbers(text: str) -> list[int]:
    """Numbers separated by commas."""
    return [int(part) for part in text.split(",") if part]


def measured(kind: str, count: int, maker: Maker, sampler: str, sets: int) -> Row:
    """Fit and draw for some sets of videos, and print what came out."""
    fitting, sampling, sds, inside, converged, memory = [], [], [], 0, 0, None
    for number in range(sets):
        videos = [maker(1000 * number + index) for index in range(count)]
        before = reset_peak()
        begin = time.process_time()
        fit = fit_together(videos, model=PhysicsModel.base(), seed=number)
        middle = time.process_time()
        posterior = sample_together(fit, sampler=sampler, seed=number, hand_on=False)
        fitting.append(middle - begin)
        sampling.append(time.process_time() - middle)
        if before is not None:
            memory = max(memory or 0.0, status("VmHWM") - before)
        low, high, sd = friction(posterior)
        inside += low <= FRICTION <= high
        sds.append(sd)
        converged += posterior.convergence.converged
    row = Row(
        kind,
        count,
        sampler,
        float(np.mean(sds)),
        (inside, sets),
        float(np.mean(fitting)),
        float(np.mean(sampling)),
        memory,
        converged,
    )
    shown = "-" if memory is None else f"{memory:.0f}"
    print(
        f"{count:3d} {kind:12s} {sampler:8s}  {row.sd:12.5f}       {inside:4d} of {sets:2d}  {row.fit_seconds:6.1f}"
        f"  {row.sample_seconds:9.1f}  {shown:>10s}  {converged:3d} of {sets}",
        flush=True,
    )
    return row


def compared(count: int, sets: int) -> Check:
    """Fit some sets of videos by both optimisers, and print how far L-BFGS ends from Gauss-Newton."""
    gains, seconds, converged = [], dict.fromkeys(Optimiser, 0.0), dict.fromkeys(Optimiser, 0)
    for number in range(sets):
        videos = [colliding(1000 * number + index) for index in range(count)]
        found = {}
        for optimiser in Optimiser:
            begin = time.process_time()
            found[optimiser] = fit_together(
                videos, model=PhysicsModel.base(), seed=number, model_error=False, plan=FitPlan(optimiser)
            )
            seconds[optimiser] += (time.process_time() - begin) / sets
            converged[optimiser] += found[optimiser].joint.converged
        gains.append(found[Optimiser.LBFGS].joint.log_density - found[Optimiser.GAUSS_NEWTON].joint.log_density)
        print(f"{count:3d} videos, set {number}: L-BFGS ends {gains[-1]:+.2f} nats from Gauss-Newton", flush=True)
    for optimiser in Optimiser:
        print(f"{count:3d} videos, {optimiser}: {converged[optimiser]} of {sets} converged, {seconds[optimiser]:.1f} s")
    reached = float(np.mean([gain > -NEAR for gain in gains]))
    return check(f"{count} videos: share in which L-BFGS ends within {NEAR} nats of Gauss-Newton", reached, SHARE)


def friction(posterior: SharedPosterior) -> tuple[float, float, float]:
    """Ends of the interval of the sliding friction, and the standard deviation of its logarithm."""
    draws = posterior.shared["sliding_friction"].values
    low, high = np.quantile(draws, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    return float(low), float(high), float(np.log(draws).std())


def judged(rows: Sequence[Row]) -> list[Check]:
    """The checks: width against number, coverage, memory, convergence."""
    checks: list[Check] = []
    by_weight = [row for row in rows if row.sampler == "laplace"]
    collisions = {row.videos: row.sd for row in by_weight if row.kind == "three bodies"}
    if len(collisions) > 1:
        few, many = min(collisions), max(collisions)
        ratio = collisions[few] / collisions[many] / (many / few) ** 0.5
        checks.append(check(f"narrowing from {few} to {many} videos over the root of their ratio", ratio, 0.7))
    for sampler in dict.fromkeys(row.sampler for row in rows):
        covered = [row.covered for row in rows if row.sampler == sampler]
        total = sum(sets for _, sets in covered)
        slack = 2 * (LEVEL * (1 - LEVEL) / total) ** 0.5
        share = sum(inside for inside, _ in covered) / total
        checks.append(check(f"{sampler}: share of {total} intervals of 90 % that cover", share, LEVEL - slack))
    for row in rows:
        title = f"{row.videos} videos of {row.kind}, {row.sampler}"
        room = None if row.memory is None else LARGEST_MEMORY - row.memory
        checks.append(check(f"{title}: MiB left of {LARGEST_MEMORY:.0f}", room, 0.0))
        checks.append(check(f"{title}: share converged", row.converged / row.covered[1], 0.8))
    return checks


def check(title: str, value: float | None, goal: float) -> Check:
    """One line of the checks; the value must reach the goal."""
    return {"name": title, "value": value, "goal": goal, "ok": value is not None and value >= goal}


def status(field: str) -> float:
    """A memory figure of this process in MiB."""
    line = next(line for line in STATUS.read_text(encoding="ascii").splitlines() if line.startswith(field))
    return int(line.split()[1]) / 1024


def reset_peak() -> float | None:
    """Resident memory in MiB from which on its peak counts; None where the system does not tell."""
    if not STATUS.is_file():
        return None
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    return status("VmRSS")


def colliding(seed: int) -> Tracks:
    """Three cylinders, of which two are aimed at the one before."""
    generator = np.random.default_rng([seed, 3])
    while True:
        position = generator.uniform(-1.5, 1.5, (3, 2))
        if (np.linalg.norm(position[:, None] - position[None], axis=-1) + 9 * np.eye(3)).min() < 0.6:
            continue
        velocity = np.zeros((3, 2))
        for body in (1, 2):
            way = position[body - 1] + 0.1 * generator.standard_normal(2) - position[body]
            velocity[body] = generator.uniform(0.8, 2.0) * way / np.linalg.norm(way)
        mass, restitution = np.exp(0.4 * generator.standard_normal(3)), generator.uniform(0.6, 0.95, 3)
        scene = cylinders(position, velocity, mass, restitution)
        integrate(scene, np.arange(60) / 25)
        if scene.contacts:
            return named(scene, seed, 60)


def sliding(seed: int) -> Tracks:
    """One cylinder."""
    generator = np.random.default_rng([seed, 1])
    angle, speed = generator.uniform(0, 2 * np.pi), generator.uniform(0.8, 2.0)
    velocity = speed * np.array([[np.cos(angle), np.sin(angle)]])
    return named(cylinders(generator.uniform(-1, 1, (1, 2)), velocity, np.ones(1), np.ones(1)), seed, 30)


def cylinders(position: np.ndarray, velocity: np.ndarray, mass: np.ndarray, restitution: np.ndarray) -> Scene:
    """Cylinders that all slide alike."""
    count = len(position)
    slowing = np.full(count, GRAVITY * FRICTION)
    radius = np.full(count, 0.2)
    return Scene((Shape.CYLINDER,) * count, position, velocity, mass, restitution, radius, slowing, drag=DRAG)


def named(scene: Scene, seed: int, frames: int) -> Tracks:
    """What is seen of a scene, under a name of its own."""
    return replace(observe(scene, noise=NOISE, frames=frames, seed=seed), video=f"video {seed}")


if __name__ == "__main__":
    sys.exit(main())

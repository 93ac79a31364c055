"""Time and memory of the simulator beside its peers: `python benchmarks/simulator.py [--json FILE] [--docs docs]`.

Prints tables and writes `{checks: [{name, value, goal, ok}]}`; a check that was missed or not measured is `ok: false`.
What is measured is the log density of 5 bodies in 128 frames (independent normal errors of all positions) with its
gradient by positions, velocities, masses and restitutions, in processor time of one thread, medians of calls that take
turns with the peers'. The peers simulate the same scenes by the same laws with fixed steps of 0.004 s. `--docs` writes
the tables into `simulator-speed.md` there, and the figures beside it; `--quick` measures less.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import torch
from _clock import interleaved
from _clock import seconds as seconds_of
from _fixed_step_torch import FORMULATIONS, positions
from _memory import peak
from _page import write_between
from _peers import COMPILED, HAS_JAX, JAX, OURS, TORCH, laws_of, peers
from _scenes import (
    BASE,
    DISCS,
    EXTENDED,
    FRAMES,
    MIXED,
    contacts_per_world,
    crowd,
    gradient_of,
    positions_of,
    scenes,
)
from _speed_page import Cost, Gap, Memory, Race, figures, page

from vrdp_prob.models.effects.time_varying_friction import TimeVaryingFriction
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.scene import Shape

KINDS: dict[str, tuple[Shape, ...]] = {"discs": DISCS, "mixed shapes": MIXED}
MORE_LAWS = "mixed shapes with contact_friction, slip_to_roll and linear_drag"
MANY = 256
SINGLE = 4
"""Scenes that are simulated alone, one after the other; they are the first of the many."""


@dataclass
class Checks:
    """What is compared with a goal."""

    entries: list[dict[str, object]] = field(default_factory=list)

    def at_most(self, name: str, value: float | None, goal: float) -> None:
        """Add a value that should be small."""
        self.entries.append(
            {"name": name, "value": value, "goal": goal, "ok": value is not None and bool(value <= goal)}
        )

    def at_least(self, name: str, value: float | None, goal: float) -> None:
        """Add a value that should be large."""
        self.entries.append(
            {"name": name, "value": value, "goal": goal, "ok": value is not None and bool(value >= goal)}
        )


def compile_seconds() -> float:
    """Time to compile forward and backward on a machine that never did (two processes share the work)."""
    code = (
        "import time; from _scenes import *; w = scenes(1, MIXED); s = time.perf_counter();"
        "gradient_of(w, positions_of(), torch.zeros(1, 128, 5, 2)); print(time.perf_counter() - s)"
    )
    with tempfile.TemporaryDirectory() as folder:
        here = str(Path(__file__).resolve().parent)
        environment = {**os.environ, "VRDP_PROB_CACHE": folder, "PYTHONPATH": here}
        done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    return float(done.stdout)


def compile_another() -> float:
    """Processor time to compile the laws of one more set of effects."""
    begin = time.process_time()
    assert BASE.with_effect(TimeVaryingFriction()).kernel is not None
    return time.process_time() - begin


def race(
    name: str, shapes: Sequence[Shape], model: PhysicsModel, entrants: Sequence[str], *, quick: bool
) -> list[Race]:
    """Milliseconds per world of all peers, one world at a time and all at once."""
    worlds = scenes(MANY, shapes, model)
    sizes = {1: [worlds.select([index]) for index in range(SINGLE)]}
    if model == BASE:
        sizes[MANY] = [worlds]
    races = []
    for size, batches in sizes.items():
        functions, taken = peers(tuple(entrants), batches, model)
        if COMPILED in functions:
            taken[COMPILED] = seconds_of(functions[COMPILED])  # compiles when first called
        times = interleaved(functions, 0.2 if quick else 2.0)
        count = size * len(batches)
        races += [Race(name, size, peer, 1e3 * seconds / count, taken.get(peer)) for peer, seconds in times.items()]
    return races


def cost(varied: int, worlds: Worlds, size: int, quick: bool) -> Cost:
    """Cost per world, forward and with gradient, where `size` worlds are simulated in one call."""
    batches = [worlds.select(slice(begin, begin + size)) for begin in range(0, len(worlds), size)]
    targets = [positions_of()(batch).detach() for batch in batches]

    def forward() -> None:
        for batch in batches:
            positions_of()(batch)

    def gradient() -> None:
        for batch, target in zip(batches, targets, strict=True):
            gradient_of(batch, positions_of(), target)

    times = interleaved({"forward": forward, "gradient": gradient}, 0.1 if quick else 1.0)
    per_world = {name: 1e3 * seconds / len(worlds) for name, seconds in times.items()}
    return Cost(varied, contacts_per_world(worlds), per_world["forward"], per_world["gradient"])


def gaps() -> list[Gap]:
    """How far the fixed-step simulators are from the event-driven one where few contacts happen."""
    found = []
    base = [(name, shapes, BASE) for name, shapes in KINDS.items()]
    for name, shapes, model in (*base, (MORE_LAWS, MIXED, EXTENDED)):
        worlds = scenes(64, shapes, model)
        calm = [index for index in range(len(worlds)) if contacts_per_world(worlds.select([index]), model) <= 1]
        chosen = worlds.select(calm)
        with torch.no_grad():
            difference = (_fixed_steps(chosen, model) - positions_of(model)(chosen)).norm(dim=-1)
        found.append(Gap(name, len(calm), float(difference.mean()), float(difference.max())))
    return found


def _fixed_steps(worlds: Worlds, model: PhysicsModel) -> torch.Tensor:
    return positions(worlds, len(FRAMES), laws_of(model), FORMULATIONS["all pairs"])


def memory(quick: bool) -> list[Memory]:
    """Peak memory of one evaluation in a fresh process."""
    wanted = [(OURS, worlds) for worlds in (1, MANY, 4096)]
    if not quick:
        wanted += [(peer, MANY) for peer in (*TORCH, *([JAX] if HAS_JAX else []))]
    return [Memory(peer, worlds, peak(peer, "discs", worlds), peak(peer, "mixed", worlds)) for peer, worlds in wanted]


def value_of(races: Sequence[Race], name: str, size: int, entrants: Sequence[str]) -> float | None:
    """Milliseconds per world of the fastest of some peers."""
    found = [race.milliseconds for race in races if (race.name, race.size) == (name, size) and race.peer in entrants]
    return min(found, default=None)


def ratio(races: Sequence[Race], name: str, size: int, entrants: Sequence[str]) -> float | None:
    """How many times faster the event-driven simulator is than the fastest of some peers."""
    peer, own = value_of(races, name, size, entrants), value_of(races, name, size, [OURS])
    return None if peer is None or own is None else peer / own


def check(races: Sequence[Race], compiling: float | None) -> Checks:
    """Compare with the goals."""
    checks = Checks()
    checks.at_most("compile forward and backward, s", compiling, 20.0)
    checks.at_most("compile one more set of effects, s", compile_another(), 1.0)
    checks.at_most("log density and gradient of 5 discs, 1 world, ms", value_of(races, "discs", 1, [OURS]), 1.0)
    for name, size, goal in (
        ("discs", 1, 150.0),
        ("mixed shapes", 1, 60.0),
        ("discs", MANY, 60.0),
        ("mixed shapes", MANY, 30.0),
    ):
        value = ratio(races, name, size, TORCH)
        checks.at_least(f"times faster than torch with fixed steps, {name}, worlds: {size}", value, goal)
    for name in KINDS:
        for size, goal in ((1, 1.0), (MANY, 15.0)):
            value = ratio(races, name, size, [JAX])
            checks.at_least(f"times faster than JAX with fixed steps, {name}, worlds: {size}", value, goal)
    value = ratio(races, MORE_LAWS, 1, TORCH)
    checks.at_least(f"times faster than torch with fixed steps, {MORE_LAWS}, worlds: 1", value, 25.0)
    return checks


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path, help="write the checks to this file")
    parser.add_argument("--docs", type=Path, help="write tables and figures into this folder")
    parser.add_argument("--quick", action="store_true", help="measure fewer sizes, shorter")
    options = parser.parse_args()
    torch.set_num_threads(1)
    entrants = (OURS, *TORCH, *([JAX] if HAS_JAX else []))
    races: list[Race] = []
    races += race("discs", DISCS, BASE, entrants if options.quick else (*entrants, COMPILED), quick=options.quick)
    if not options.quick:
        races += race("mixed shapes", MIXED, BASE, entrants, quick=False)
        races += race(MORE_LAWS, MIXED, EXTENDED, (OURS, *TORCH), quick=False)
    bodies = (2, 4, 8, 16) if options.quick else (2, 4, 8, 16, 32, 64)
    worlds = (1, 4, 16, 64) if options.quick else (1, 4, 16, 64, 256, 1024, 4096)
    by_bodies, by_worlds = {}, {}
    for name, shapes in KINDS.items():
        by_bodies[name] = [cost(count, crowd(16, (shapes * 13)[:count]), 16, options.quick) for count in bodies]
        batch = scenes(max(worlds), shapes)
        # Few worlds at a time take the same 64 scenes in turn, so that the sizes are comparable.
        by_worlds[name] = [cost(size, batch.select(slice(max(size, 64))), size, options.quick) for size in worlds]
    checks = check(races, None if options.quick else compile_seconds())
    text = page(
        races=races,
        by_bodies=by_bodies,
        by_worlds=by_worlds,
        memories=memory(options.quick),
        gaps=gaps(),
        checks=checks.entries,
    )
    print(text)
    if options.json:
        options.json.write_text(json.dumps({"checks": checks.entries}, indent=1) + "\n", encoding="utf-8")
    if options.docs:
        figures(by_bodies, by_worlds, options.docs / "figures")
        write_between(options.docs / "simulator-speed.md", text)


if __name__ == "__main__":
    main()

"""Whether place and speed decide how strongly a puck is braked after its collision, without any model.

    python benchmarks/puck_braking.py [--json FILE]

Tracks of ../shared/data/puck_collisions_2d: one collision of two pucks on an air table per run. The acceleration
against the velocity is that of a parabola through 13 frames (0.12 s) after the collision. A patch of the table or a law
of friction would brake runs alike that cross the same place as fast: for each square of 2 cm that three or more runs
cross at speeds within a factor of 1.5, the table compares the least and the most braked of them. Without the data
nothing is measured.
"""

import argparse
import json
import sys
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from _page import table_row
from jaxtyping import Float

from vrdp_prob.datasets import load_all
from vrdp_prob.files import write_atomically
from vrdp_prob.scene import Tracks

DATA = Path(__file__).parents[2] / "shared" / "data" / "puck_collisions_2d"
HALF = 6
"""Frames on either side of the one at which an acceleration is told."""
SLOWEST = 0.05
"""Speed in m/s below which a direction of motion tells nothing."""
SQUARE, BAND, FEWEST = 0.02, 1.5, 3
"""Side of a square in m, factor between the speeds of a band, and runs that have to cross a square in the same band."""
Braked = tuple[str, Float[np.ndarray, "2"], float, float]
"""A run, where a puck is, its speed in m/s, and its acceleration in m/s^2 against its velocity."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="file for the results")
    options = parser.parse_args(arguments)
    if not DATA.is_dir():
        print(f"no data at {DATA}: nothing measured")
        return 0
    videos = load_all(DATA)
    pucks = [body.id for body in videos[0].bodies]
    results = {
        puck: summary([one for video in videos for one in braked(video, place)]) for place, puck in enumerate(pucks)
    }
    head = ("puck", "frames", "braking, m/s²", "5 to 95 %", "squares", "least braked run", "most braked run")
    print("\n".join([table_row(*head), "|---" * len(head) + "|", *(line(*one) for one in results.items())]))
    if options.json:
        with write_atomically(options.json) as temporary:
            temporary.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    return 0


def braked(video: Tracks, puck: int) -> Iterator[Braked]:
    """How strongly a puck is braked in each frame after the collision, wherever it moves."""
    times, places = video.times, video.positions
    met = int(np.nanargmin(np.linalg.norm(places[:, 0] - places[:, 1], axis=1)))
    for frame in range(met + HALF + 2, len(times) - HALF):
        chosen = slice(frame - HALF, frame + HALF + 1)
        since = times[chosen] - times[frame]
        parabola = np.stack([np.ones_like(since), since, since**2 / 2], axis=1)
        _, velocity, acceleration = np.linalg.lstsq(parabola, places[chosen, puck], rcond=None)[0]
        speed = float(np.linalg.norm(velocity))
        if speed > SLOWEST:
            yield video.video, places[frame, puck], speed, -float(acceleration @ velocity) / speed


def summary(frames: Sequence[Braked]) -> dict[str, float]:
    """How strongly a puck is braked, and how much that differs between runs at the same place and speed."""
    squares: dict[tuple[int, ...], dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    for run, place, speed, braking in frames:
        band = int(np.log(speed) // np.log(BAND))
        squares[*(place // SQUARE).astype(int).tolist(), band][run].append(braking)
    crossed = [[float(np.mean(one)) for one in runs.values()] for runs in squares.values() if len(runs) >= FEWEST]
    low, middle, high = np.quantile([braking for *_, braking in frames], [0.05, 0.5, 0.95]).tolist()
    return {
        "frames": len(frames),
        "median": middle,
        "low": low,
        "high": high,
        "squares": len(crossed),
        "least": float(np.median([min(runs) for runs in crossed])),
        "most": float(np.median([max(runs) for runs in crossed])),
    }


def line(puck: str, found: dict[str, float]) -> str:
    """A row of the table."""
    return table_row(
        puck,
        str(found["frames"]),
        f"{found['median']:.3f}",
        f"{found['low']:.3f} to {found['high']:.3f}",
        str(found["squares"]),
        f"{found['least']:.3f}",
        f"{found['most']:.3f}",
    )


if __name__ == "__main__":
    sys.exit(main())

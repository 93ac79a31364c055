"""Whether filming on lowers the entropy of answers as their explanations say, on the practice scenes.

    python benchmarks/explanation.py [--scenes A:B] [--draws N] [--json FILE]

Every scene is cut off after 68, 88 and 108 frames. For each pair that may or may not collide in the 58 frames after
that, the explanation says what filming 20 more frames would be worth; then they are filmed, and the same is asked of
the longer video. Masses and restitutions come from the truth files, so that only explanations are measured.
"""

import argparse
import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from _true_posterior import TruePosterior

from vrdp_prob.datasets import load
from vrdp_prob.files import write_atomically
from vrdp_prob.reasoning import PosteriorWorlds, ask
from vrdp_prob.reasoning.entropy import entropy
from vrdp_prob.reasoning.explanation.motions import FILMED_FRAMES
from vrdp_prob.reasoning.future import FUTURE_FRAMES
from vrdp_prob.scene import Body, Tracks

DATA = Path(__file__).parents[2] / "shared" / "data" / "clevrer_bullet"
CUTS = (68, 88, 108)
OPEN = 0.05
"""A collision is open whose probability is this far from 0 and 1."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", default="0:60", help="A:B, scenes A to B-1")
    parser.add_argument("--draws", type=int, default=300)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    begin, end = (int(part) for part in arguments.scenes.split(":"))
    rows: list[tuple[float, float, float]] = []
    if DATA.is_dir():
        for scene in range(begin, end):
            rows += _scene(load(DATA, video=f"video_{scene:05d}"), arguments.draws)
    else:
        print(f"no data at {DATA}: nothing measured")
    check = {"name": "entropy found after filming above the one told, in standard errors", "goal": 2}
    excess: float | None = None
    if len(rows) > 1:
        before, told, found = np.array(rows).T
        error = float(np.std(found - told, ddof=1) / np.sqrt(len(rows)))
        print(f"{len(rows)} open collisions: entropy {before.mean():.3f} nats, after {FILMED_FRAMES} more frames")
        print(f"told {told.mean():.3f}, found {found.mean():.3f} ± {error:.3f}")
        excess = float((found - told).mean()) / error
    checks = [{**check, "value": excess, "ok": excess is not None and excess <= 2}]
    if arguments.json is not None:
        with write_atomically(arguments.json) as temporary:
            temporary.write_text(json.dumps({"checks": checks}, indent=1) + "\n", encoding="utf-8")


def _scene(tracks: Tracks, draws: int) -> Iterator[tuple[float, float, float]]:
    """Entropy before, told and found after filming, of each open collision that a film would settle."""
    for cut in CUTS:
        if cut + FILMED_FRAMES > len(tracks.times):
            continue
        short, longer = (tracks.until(float(tracks.times[frame - 1])) for frame in (cut, cut + FILMED_FRAMES))
        now = PosteriorWorlds(TruePosterior(short, DATA / "truth"), draws=draws)
        then = PosteriorWorlds(TruePosterior(longer, DATA / "truth"), draws=draws)
        limit = float(short.times[-1]) + FUTURE_FRAMES / short.frame_rate
        universe = now.seen.universe
        for place, (first, second) in enumerate(universe.pairs):
            if not OPEN < now.future.events.happens[:, place].mean() < 1 - OPEN:
                continue
            bodies = short.bodies[first], short.bodies[second]
            explanation = ask(now, ["unseen_events", "belong_to"], choices=[_collision(*bodies)]).explain()
            for part in explanation.parts:
                worth = [one for one in part.observations if one.words.startswith("filming")]
                if worth:
                    share = _share(then, bodies, limit)
                    yield part.entropy, worth[0].entropy, entropy(np.array([share, 1 - share]))


def _share(worlds: PosteriorWorlds, bodies: tuple[Body, Body], limit: float) -> float:
    """Share of the draws in which two bodies collide, in the video or after it, up to a time in s."""
    tracks = worlds.posterior.tracks
    place = worlds.seen.universe.collision(*(tracks.index(body.id) for body in bodies))
    later = worlds.future.events
    in_time = later.happens[:, place] & (np.nan_to_num(later.time[:, place], nan=np.inf) <= limit)
    return float((worlds.events().happens[:, place] | in_time).mean())


def _collision(first: Body, second: Body) -> list[str]:
    """The program of a choice: the collision of two objects."""
    looks = "filter_color {} filter_material {} filter_shape unique filter_collision"
    words = [f"objects {body.color} {looks.format(body.material, body.shape)}" for body in (first, second)]
    return f"all_events {words[0]} {words[1]} unique".split()


if __name__ == "__main__":
    main()

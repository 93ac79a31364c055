"""What the stages of the search for the most probable values are worth: success, trajectories, answers.

    python benchmarks/ablation.py [--json FILE] [--scenes 40] [--questions 8] [--docs DIR]

Random synthetic videos with known truth (see `benchmarks/map.py`) give success and errors of trajectories, inside the
video and 1 s after its end; practice scenes of ../shared/data give the accuracy of answers from the MAP alone. Every
row starts from the same local fits of the tracks. Answers about what comes next always refit the last frames.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import _project  # noqa: F401  the generator belongs to the tests, which lie beside the package
import numpy as np
import torch
from _page import table_row
from map import PLANS

from tests.inference.generator import states
from tests.inference.map_comparison import compare
from tests.inference.random_scenes import TIMES, Truth, random_truth
from vrdp_prob.datasets import load, read_questions
from vrdp_prob.evaluation.judgement import judge
from vrdp_prob.inference import Posterior, default_model
from vrdp_prob.inference.assembly import posterior_from
from vrdp_prob.inference.draws.samples import Convergence, Samples
from vrdp_prob.inference.map_fit import MapFit, fit_map
from vrdp_prob.inference.search.plan import FitPlan
from vrdp_prob.models.simulator.rollout import simulate
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.reasoning import PosteriorWorlds
from vrdp_prob.scene import Question, Tracks

DATA = Path(__file__).parents[2] / "shared" / "data" / "clevrer_bullet"
ROWS = {
    "all at once": "all-at-once",
    "collision-independent first": "free-first",
    "curriculum (40, 80, all frames)": "curriculum",
    "windows that grow by 8 frames": "growing",
    "and alternatives": "default",
}
LATER = 1.0
"""Time (s) after the video at which a prediction is judged."""
DRAWS = 100


@dataclass
class Row:
    """Figures of one way to search."""

    found: list[bool] = field(default_factory=list)
    inside: list[float] = field(default_factory=list)
    later: list[float] = field(default_factory=list)
    later_reoptimised: list[float] = field(default_factory=list)
    right: list[bool] = field(default_factory=list)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="file for the checks")
    parser.add_argument("--scenes", type=int, default=40, help="how many synthetic videos")
    parser.add_argument("--questions", type=int, default=8, help="how many practice scenes")
    parser.add_argument("--docs", type=Path, help="folder for ablation-table.md, the table as a page holds it")
    options = parser.parse_args(arguments)
    torch.set_num_threads(1)
    rows: dict[str, Row] = {}
    for title, name in ROWS.items():
        rows[title] = row(PLANS[name], options.scenes, options.questions)
        print(table(rows), flush=True)
    text = table(rows)
    if options.docs is not None:
        (options.docs / "ablation-table.md").write_text(text, encoding="utf-8")
    if options.json is not None:
        shares = {title: float(np.mean(one.found)) for title, one in rows.items()}
        best = shares["and alternatives"] >= max(shares.values())
        check = {"name": "all stages together succeed most often", "value": shares, "goal": "the last", "ok": best}
        options.json.write_text(json.dumps({"checks": [check]}, indent=1) + "\n", encoding="utf-8")
    return 0


def row(plan: FitPlan, scenes: int, practice: int) -> Row:
    """Measure one way to search."""
    result = Row()
    for seed in range(scenes):
        truth = random_truth(seed)
        fit = fit_map(truth.tracks, default_model(), np.random.default_rng(0), plan=plan)
        result.found.append(compare(truth, fit).succeeded)
        posterior = map_posterior(fit)
        worlds = posterior.map_worlds()
        seen = truth.tracks.seen
        difference = positions(fit, worlds, TIMES) - truth.states[:, :, :2]
        result.inside.append(float(np.sqrt((difference[seen] ** 2).sum(axis=1).mean())))
        end = float(TIMES[-1])
        result.later.append(later_error(truth, positions(fit, worlds, np.array([end, end + LATER]))[-1]))
        future = PosteriorWorlds(posterior, draws=DRAWS).future
        frame = int(np.abs(future.times - (end + LATER)).argmin())
        result.later_reoptimised.append(later_error(truth, future.trajectory[:, frame, :, :2].mean(axis=0)))
    if DATA.is_dir():
        asked = read_questions(DATA / "questions.json")
        for video in (f"video_{scene:05d}" for scene in range(practice)):
            result.right += answers(load(DATA, video=video), asked[video], plan)
    return result


def positions(fit: MapFit, worlds: Worlds, times: np.ndarray) -> np.ndarray:
    """Positions (m) of a single world at some times (time, body, 2)."""
    with torch.no_grad():
        return simulate(worlds, torch.from_numpy(times), fit.likelihood.model).trajectory[0, :, :, :2].numpy()


def later_error(truth: Truth, predicted: np.ndarray) -> float:
    """Error (m) of predicted places (body, 2) some time after the video, root mean square over the bodies."""
    true = states(replace(truth.scene, contacts=[]), np.array([*TIMES, TIMES[-1] + LATER]))[-1, :, :2]
    return float(np.sqrt(((predicted - true) ** 2).sum(axis=1).mean()))


def answers(tracks: Tracks, asked: Sequence[Question], plan: FitPlan) -> list[bool]:
    """Whether each question about a practice scene is answered rightly from its MAP."""
    fit = fit_map(tracks, default_model(), np.random.default_rng(0), plan=plan)
    facts = PosteriorWorlds(map_posterior(fit), draws=DRAWS)
    return [judge(tracks.video, facts, question).right for question in asked]


def map_posterior(fit: MapFit) -> Posterior:
    """A posterior of which every draw is the MAP."""
    points = np.tile(fit.point, (1, DRAWS, 1))
    samples = Samples(points, np.full((1, DRAWS), fit.log_density))
    convergence = Convergence("laplace", True, None, None, None, None)
    return posterior_from(fit, samples, convergence, seed=0, generator=np.random.default_rng(0))


def table(rows: dict[str, Row]) -> str:
    """The rows as a markdown table; errors are medians, with means in brackets."""
    lines = [
        "| stages | found | error inside (m) | 1 s after the end (m) | re-optimised (m) | answers right |",
        "|---|---|---|---|---|---|",
    ]
    for title, one in rows.items():
        errors = [f"{np.median(part):.4f} ({np.mean(part):.3f})" for part in (one.inside, one.later)]
        again = f"{np.median(one.later_reoptimised):.4f} ({np.mean(one.later_reoptimised):.3f})"
        asked = f"{np.mean(one.right):.1%}" if one.right else "not asked"
        cells = [title, f"{np.mean(one.found):.0%}", *errors, again, asked]
        lines.append(table_row(*cells))
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.exit(main())

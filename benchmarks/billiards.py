"""What discovery finds on a billiard table, and how much better the extended model predicts shots it has not seen.

    python benchmarks/billiards.py [--json FILE] [--docs docs] [--train 62] [--searched 12]
        [--results FOLDER]

Tracks of ../shared/data/billiards_three_cushion, as in the real-world table of VRDP (Ding et al., NeurIPS 2021): the
model and what all shots share are learned on frames 0 to 39 of the training videos; of each test video frames 0 to 19
are seen, frames 20 to 39 are predicted, and questions ask what happens there. Positions are those of the best fit,
as in the paper, probabilities those of the posterior. Constant velocity is what a person without a simulator would
say. The finding, the learned models and each test video's errors are kept in `--results` as
they come, so that a run that was interrupted goes on; delete that folder after a change of the code. `--docs` writes
the tables into `billiards.md` there, and figures of the finding beside it.
"""

import argparse
import json
import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import torch
from _extension import forecast, learned_base, learned_extension
from _finding_figures import copy_figures
from _page import page_parser, publish, table_row
from _resumable import Result, measured
from jaxtyping import Float

from vrdp_prob.datasets import load_all
from vrdp_prob.evaluation.scores import calibration_error
from vrdp_prob.inference import default_model, infer
from vrdp_prob.inference.several_videos.learned import with_learned_walls
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.events import RolloutEventKind
from vrdp_prob.models.simulator.rollout import compile_model, simulate
from vrdp_prob.scene import Tracks

DATA = Path(__file__).parents[2] / "shared" / "data" / "billiards_three_cushion"
RESULTS = Path("out") / "billiards"
SEEN, ASKED = 20, 40
"""Frames that are seen, and frames up to which is predicted."""
DRAWS = 400
BASE, EXTENDED, STRAIGHT = "base model", "extended model", "constant velocity"


@dataclass(frozen=True)
class Task:
    """A test video, under one of the learned models."""

    tracks: Tracks
    questions: tuple[Mapping[str, object], ...]
    name: str
    model: PhysicsModel | None

    @property
    def key(self) -> str:
        """By which its result is found again."""
        return f"{self.tracks.video}, {self.name}"


def main(arguments: Sequence[str] | None = None) -> int:
    options = _parser().parse_args(arguments)
    if not DATA.is_dir():
        print(f"no data at {DATA}: nothing measured")
        return 0
    asked = json.loads((DATA / "questions.json").read_text(encoding="utf-8"))
    names = {part: [_video(one) for one in asked if one["split"] == part] for part in ("train", "test")}
    training = [_up_to(ASKED, tracks) for tracks in load_all(DATA, videos=names["train"][: options.train])]
    compile_model(default_model())
    found = {
        BASE: learned_base(training, options.results),
        EXTENDED: learned_extension(training, options.results / "finding", searched=options.searched),
    }
    questions = {_video(one): tuple(one["questions"]) for one in asked}
    tasks = [
        Task(with_learned_walls(learned.fit, tracks), questions[tracks.video], name, learned.model)
        for tracks in load_all(DATA, videos=names["test"])
        for name, learned in found.items()
    ]
    tasks += [Task(one.tracks, one.questions, STRAIGHT, None) for one in tasks if one.name == BASE]
    results = measured(
        answered,
        {task.key: task for task in tasks},
        options.results / "test.jsonl",
        field="key",
        label="Test videos",
        processes=options.processes,
    )
    text = "\n".join(_table(results, len(training)))
    publish(text, "billiards.md", {"results": results}, options)
    if options.docs:
        copy_figures(options.results / "finding", options.docs, "billiards")
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = page_parser(__doc__, RESULTS)
    parser.add_argument("--train", type=int, default=62, help="how many of the training videos, from the first")
    parser.add_argument("--searched", type=int, help="how many of these are searched for causes; all by default")
    return parser


def _video(entry: Mapping[str, str]) -> str:
    return Path(entry["video_filename"]).stem


def _up_to(frames: int, tracks: Tracks) -> Tracks:
    return replace(tracks, data=tracks.data.isel(time=slice(frames)))


def answered(task: Task) -> Result:
    """Errors (m, squared and averaged over frames and balls) and probabilities of the asked events in a test video."""
    torch.set_num_threads(1)
    if task.model is None:
        positions, happened = _straight(task.tracks)
    else:
        positions, happened = _simulated(task.tracks, task.model)
    squares = ((positions - task.tracks.positions[:ASKED]) ** 2).sum(axis=-1)
    return {
        "key": task.key,
        "model": task.name,
        "squares": [float(np.nanmean(squares[:SEEN])), float(np.nanmean(squares[SEEN:]))],
        "forecasts": [happened[_event(one)] for one in task.questions],
        "outcomes": [one["answer"] == "yes" for one in task.questions],
    }


def _event(question: Mapping[str, object]) -> frozenset[str]:
    """What is asked: the balls that meet, a single one where it meets a cushion."""
    event = question["event"]
    assert isinstance(event, dict)
    return frozenset(event["objects"])


def _simulated(
    tracks: Tracks, model: PhysicsModel
) -> tuple[Float[np.ndarray, "time body 2"], dict[frozenset[str], float]]:
    """Positions of the best fit, and the posterior probability of each event, from the first frames alone."""
    seen = _up_to(SEEN, tracks)
    best = forecast(seen, _up_to(ASKED, tracks), model)
    posterior = infer(seen, sampler="laplace", model=model, seed=0, draws=DRAWS)
    drawn = simulate(posterior.worlds(DRAWS), torch.tensor(tracks.times[:ASKED]), model)
    events, names = drawn.events, [body.id for body in tracks.bodies]
    asked = (events.time > tracks.times[SEEN - 1]) & (events.time <= tracks.times[ASKED - 1])
    found: dict[frozenset[str], float] = {}
    for first, name in enumerate(names):
        by_wall = asked & (events.kind == RolloutEventKind.WALL) & (events.first == first)
        found[frozenset([name])] = len(set(events.world[by_wall])) / len(drawn.outcome)
        for second in range(first + 1, len(names)):
            meet = asked & (events.kind == RolloutEventKind.COLLISION)
            meet &= (events.first == first) & (events.second == second)
            found[frozenset([name, names[second]])] = len(set(events.world[meet])) / len(drawn.outcome)
    return best, found


def _straight(tracks: Tracks) -> tuple[Float[np.ndarray, "time body 2"], dict[frozenset[str], float]]:
    """Positions at the mean velocity of the first frames, and whether balls then touch, or reach a cushion."""
    times = tracks.times[:ASKED]
    radius = [body.radius or 0.0 for body in tracks.bodies]
    lines = np.polyfit(times[:SEEN], tracks.positions[:SEEN].reshape(SEEN, -1), 1)
    positions = (times[:, None] * lines[0] + lines[1]).reshape(ASKED, -1, 2)
    late, names = positions[SEEN:], [body.id for body in tracks.bodies]
    edges = np.array([(max(abs(wall.x1), abs(wall.x2)), max(abs(wall.y1), abs(wall.y2))) for wall in tracks.walls])
    found: dict[frozenset[str], float] = {}
    for first, name in enumerate(names):
        found[frozenset([name])] = float((np.abs(late[:, first]) > edges.max(axis=0) - radius[first]).any())
        for second in range(first + 1, len(names)):
            distance = np.linalg.norm(late[:, first] - late[:, second], axis=-1)
            found[frozenset([name, names[second]])] = float((distance < radius[first] + radius[second]).any())
    return positions, found


def _table(results: Sequence[Result], training: int) -> list[str]:
    head = ("", "S1, 1e-3 m²", "S2, 1e-3 m²", "S1, RMS in mm", "S2, RMS in mm", "questions right", "Brier", "ECE")
    lines = [f"Learned on {training} shots, five test shots with six questions each.", ""]
    lines += [table_row(*head), table_row(*["---"] * len(head))]
    for name in (STRAIGHT, BASE, EXTENDED):
        mine = [one for one in results if one["model"] == name]
        squares = np.array([one["squares"] for one in mine]).mean(axis=0)
        forecast = np.concatenate([one["forecasts"] for one in mine])
        outcome = np.concatenate([one["outcomes"] for one in mine]).astype(bool)
        right = float(((forecast > 0.5) == outcome).mean())
        brier = float(((forecast - outcome) ** 2).mean())
        cells = [f"{1e3 * value:.3f}" for value in squares] + [f"{1e3 * value:.1f}" for value in np.sqrt(squares)]
        ece = calibration_error(forecast, outcome)
        lines.append(table_row(name, *cells, f"{100 * right:.1f} %", f"{brier:.3f}", f"{ece:.3f}"))
    return lines


if __name__ == "__main__":
    sys.exit(main())

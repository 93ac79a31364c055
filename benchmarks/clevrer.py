"""What the planar model misses in scenes of a 3D engine, and whether the model that discovery extends answers better.

    python benchmarks/clevrer.py [--json FILE] [--docs docs] [--train 30] [--searched 6] [--test 30]
        [--results FOLDER]

Tracks of ../shared/data/clevrer_bullet. Discovery, and what the scenes share, see the even scenes; the odd ones are
never seen by either. Of each of these the first 60 % of the frames are fitted and the positions in the rest are
predicted by the best fit; its questions are answered from the whole video by posterior draws. The finding, the learned
models (`base.toml`, `finding/model.toml`) and each scene's results are kept in `--results` as they come, so that a run
that was interrupted goes on; delete that folder after a change of the code. `--docs` writes the tables into
`clevrer.md` there, and figures beside it.
"""

import argparse
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import torch
from _answer_goals import GOALS, title
from _extension import base_model, extended_model, first_part, forecast
from _finding_figures import copy_figures
from _page import page_parser, publish, table_row
from _resumable import Result, measured
from _score_cells import gain, number, percent

from vrdp_prob.datasets import load_all, read_questions
from vrdp_prob.evaluation.judgement import Judgement, judge
from vrdp_prob.evaluation.scores import Scores, bootstrap, brier_gain
from vrdp_prob.inference import default_model, infer
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.rollout import compile_model
from vrdp_prob.reasoning import PosteriorWorlds
from vrdp_prob.scene import Tracks

DATA = Path(__file__).parents[2] / "shared" / "data" / "clevrer_bullet"
RESULTS = Path("out") / "clevrer"
SCENES = 60
SEEN_SHARE = 0.6
AHEAD = 1.0
"""Time in s after the last frame that is fitted, up to which the nearer error counts."""
DRAWS = 100
PLAIN, BASE, EXTENDED = "base model, nothing learned", "base model", "extended model"


@dataclass(frozen=True)
class Task:
    """A test scene under one of the models."""

    tracks: Tracks
    name: str
    model: PhysicsModel

    @property
    def key(self) -> str:
        """By which its result is found again."""
        return f"{self.tracks.video}, {self.name}"


def main(arguments: Sequence[str] | None = None) -> int:
    options = _parser().parse_args(arguments)
    if not DATA.is_dir():
        print(f"no data at {DATA}: nothing measured")
        return 0
    names = [f"video_{scene:05d}" for scene in range(SCENES)]
    training = load_all(DATA, videos=names[0::2][: options.train])
    compile_model(default_model())
    models = {
        PLAIN: default_model(),
        BASE: base_model(training, options.results),
        EXTENDED: extended_model(training, options.results / "finding", searched=options.searched),
    }
    compile_model(models[EXTENDED])
    tasks = [
        Task(tracks, name, model)
        for tracks in load_all(DATA, videos=names[1::2][: options.test])
        for name, model in models.items()
    ]
    results = measured(
        scored,
        {task.key: task for task in tasks},
        options.results / "test.jsonl",
        field="key",
        label="Test scenes",
        processes=options.processes,
    )
    text = "\n".join([*_errors(results, len(training)), "", *_answers(results)])
    publish(text, "clevrer.md", {"results": results}, options)
    if options.docs:
        copy_figures(options.results / "finding", options.docs, "clevrer")
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = page_parser(__doc__, RESULTS)
    parser.add_argument("--train", type=int, default=30, help="how many of the even scenes, from the first")
    parser.add_argument("--searched", type=int, help="how many of these are searched for causes; all by default")
    parser.add_argument("--test", type=int, default=30, help="how many of the odd scenes, from the first")
    return parser


def scored(task: Task) -> Result:
    """Errors (m^2 per axis) and judgements of a test scene under a model."""
    torch.set_num_threads(1)
    posterior = infer(task.tracks, sampler="laplace", model=task.model, seed=0, hand_on=False)
    worlds = PosteriorWorlds(posterior, draws=DRAWS)
    questions = read_questions(DATA / "questions.json")[task.tracks.video]
    return {
        "key": task.key,
        "scene": task.tracks.video,
        "model": task.name,
        **_forecast_errors(task),
        "judgements": [judge(task.tracks.video, worlds, one).to_document() for one in questions],
    }


def _forecast_errors(task: Task) -> dict[str, float]:
    """Mean squared error per axis in m^2: of the frames that are fitted, of the second after them, and of all later."""
    seen, longer = first_part(task.tracks, SEEN_SHARE)
    times, last = longer.times, seen.times[-1]
    squares = ((forecast(seen, longer, task.model) - longer.positions) ** 2).mean(axis=-1)
    parts = {"fitted": times <= last, "next": (times > last) & (times <= last + AHEAD), "later": times > last}
    return {name: float(np.nanmean(squares[part])) for name, part in parts.items()}


def _errors(results: Sequence[Result], training: int) -> list[str]:
    """Errors in the scene in the middle, and in how many scenes the extended model is nearer."""
    head = ("error, mm", "frames that are fitted", "the next second", "all that is left", "nearer than the base model")
    lines = [f"Learned on {training} scenes, tested on {len(_of(results, BASE))} others.", ""]
    lines += [table_row(*head), table_row(*["---"] * len(head))]
    for name in (PLAIN, BASE, EXTENDED):
        mine = _of(results, name)
        middle = [1e3 * np.median(np.sqrt([one[part] for one in mine])) for part in ("fitted", "next", "later")]
        pairs = zip(mine, _of(results, BASE), strict=True)
        nearer = f"{sum(ours['later'] < base['later'] for ours, base in pairs)} of {len(mine)}" if name != BASE else ""
        lines.append(table_row(name, *(f"{value:.1f}" for value in middle), nearer))
    return [*lines, "", _ratio(results)]


def _ratio(results: Sequence[Result]) -> str:
    """How the extended model's errors compare with the base model's; the middle 95 % when scenes are drawn anew."""
    logarithms = [
        (ours["scene"], [float(np.log(ours["later"] / base["later"])) / 2])
        for ours, base in zip(_of(results, EXTENDED), _of(results, BASE), strict=True)
    ]
    mean = float(np.mean([value for _, values in logarithms for value in values]))
    interval = bootstrap(logarithms, np.random.default_rng(0))
    said = "" if interval is None else f" (95 %: {np.exp(interval.low):.2f} to {np.exp(interval.high):.2f})"
    return f"Errors of all that is left are {np.exp(mean):.2f} times those of the base model{said}, geometric mean."


def _of(results: Sequence[Result], name: str) -> list[Result]:
    return [one for one in results if one["model"] == name]


def _answers(results: Sequence[Result]) -> list[str]:
    head = ("questions", "model", "right, per question", "per option", "Brier", "lower than the base model's by")
    lines = [table_row(*head), table_row(*["---"] * len(head))]
    rows = {name: _judgements(_of(results, name)) for name in (PLAIN, BASE, EXTENDED)}
    for kind in GOALS:
        base = [one for one in rows[BASE] if one.kind is kind]
        for name, made in rows.items():
            mine = [one for one in made if one.kind is kind]
            score = Scores.of(mine)
            shares = [percent(score.accuracy_per_question), percent(score.accuracy_per_option)]
            lower = "" if name == BASE else gain(*brier_gain(mine, base))
            lines.append(table_row(f"{title(kind)} ({score.questions})", name, *shares, number(score.brier), lower))
    return lines


def _judgements(results: Sequence[Result]) -> list[Judgement]:
    return [Judgement.of_document(one) for result in results for one in result["judgements"]]


if __name__ == "__main__":
    sys.exit(main())

"""Answers about all practice scenes, what each part of the reasoning adds to them, and what bounds them.

    python benchmarks/practice.py [--json FILE] [--docs docs] [--scenes 60] [--thinned 60]
                                  [--model FILE.toml] [--extended FILE.toml]

Tracks of ../shared/data/clevrer_bullet. Two-fold cross-fitting: how much motion deviates from the model is learned on
the odd scenes for the even ones, and the other way round. Fits (Laplace draws) and judgements are written to
`--results` as they come, so that a run that was interrupted goes on; delete that folder after a change of the code.
`--extended` names the model file of the row `extended model` (`contact_friction_and_slip.toml` beside this script),
whose fits take a minute a scene; without it the row is left out. What each half of the scenes says of it (WAIC) is
printed: a half may be answered with the model that the other half prefers. `--docs` writes the tables into
`practice.md` there.
"""

import argparse
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import torch
from _answer_goals import GOALS, title
from _page import page_parser, publish, table_row
from _released_worlds import ReleasedWorlds
from _resumable import Result, measured
from _score_cells import gain, number, percent
from _true_posterior import TruePosterior
from _wrong_answers import wrong_answers
from scipy.special import logsumexp

from vrdp_prob.datasets import load, read_questions
from vrdp_prob.evaluation.judgement import Judgement, judge
from vrdp_prob.evaluation.scores import Scores, brier_gain
from vrdp_prob.files import write_atomically
from vrdp_prob.inference import default_model, infer
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.rollout import compile_model
from vrdp_prob.reasoning import AskablePosterior, PosteriorWorlds
from vrdp_prob.reasoning.deviations import DeviationModel, turns
from vrdp_prob.reasoning.entropy import entropy
from vrdp_prob.reasoning.facts import Facts
from vrdp_prob.reasoning.plug_in import plug_in_worlds
from vrdp_prob.reasoning.scales import ScalePrior
from vrdp_prob.scene import Question, Tracks

DATA = Path(__file__).parents[2] / "shared" / "data" / "clevrer_bullet"
RESULTS = Path("out") / "practice"
DRAWS = 100
FEWER_FRAMES = (40, 80, 128)
FULL, BEST_FIT, TRUE, EXTENDED = "everything", "best fit (VRDP's way)", "true masses and restitutions", "extended model"
EXTENDED_BEST_FIT = "extended model, best fit"
CALIBRATION = ("ECE", "95 % quantile if calibrated")


@dataclass(frozen=True)
class Task:
    """One scene, with how much motion deviates as the other half of the scenes has it."""

    scene: int
    model: PhysicsModel
    extended: PhysicsModel | None
    folder: Path
    deviating: DeviationModel | None = None

    @property
    def video(self) -> str:
        """Name of its video."""
        return f"video_{self.scene:05d}"

    @property
    def models(self) -> dict[str, PhysicsModel]:
        """The models that it is inferred with, by the name of the folder of their posteriors."""
        return {"base": self.model} | ({} if self.extended is None else {"extended": self.extended})


def main(arguments: Sequence[str] | None = None) -> int:
    options = _parser().parse_args(arguments)
    if not DATA.is_dir():
        print(f"no data at {DATA}: nothing measured")
        return 0
    model = PhysicsModel.read(options.model) if options.model else default_model()
    extended = PhysicsModel.read(options.extended) if options.extended else None
    for one in filter(None, (model, extended)):
        compile_model(one)
    tasks = {scene: Task(scene, model, extended, options.results) for scene in range(options.scenes)}
    told = _measured(deviations, tasks, options, "deviations", "How motion deviates")
    halves = [_learned([told[scene] for scene in tasks if scene % 2 == half]) for half in (0, 1)]
    for half, learned in enumerate(halves):
        print(f"learned on {('even', 'odd')[half]} scenes: {learned}")
    tasks = {k: Task(k, model, extended, options.results, halves[1 - k % 2]) for k in tasks}
    judged = _measured(judgements, tasks, options, "judgements", "Answers")
    few = {scene: task for scene, task in tasks.items() if scene < options.thinned}
    fewer = _measured(with_fewer_frames, few, options, "fewer", "With fewer frames")
    rows = _rows(list(judged.values()))
    preferred: list[str] = []
    if extended is not None:
        preferred = _preference(_measured(preference, tasks, options, "models", "Comparing models"))
    best, others = (EXTENDED, (FULL, TRUE)) if EXTENDED in rows else (FULL, (TRUE,))
    wrong = wrong_answers(rows[best], {name: rows[name] for name in others}, DATA / "sensitivity.json")
    text = "\n".join([*_tables(rows), *preferred, "", *_fewer_table(_rows(list(fewer.values()))), "", *wrong])
    publish(text, "practice.md", {"checks": _checks(rows)}, options)
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = page_parser(__doc__, RESULTS, document="checks")
    parser.add_argument("--scenes", type=int, default=60, help="how many of the scenes, from the first")
    parser.add_argument("--thinned", type=int, default=60, help="how many of them are seen with fewer frames, too")
    parser.add_argument("--model", type=Path, help="model file of all rows but one; the default model where not given")
    parser.add_argument("--extended", type=Path, help="model file of the row 'extended model'")
    return parser


def _measured(
    work: Callable[[Task], Result], tasks: Mapping[int, Task], options: argparse.Namespace, name: str, label: str
) -> dict[int, Result]:
    path = options.results / f"{name}.jsonl"
    found = measured(work, tasks, path, field="scene", label=label, processes=options.processes)
    return dict(zip(tasks, found, strict=True))


def posterior_of(task: Task, tracks: Tracks, name: str, model: PhysicsModel) -> AskablePosterior:
    """The posterior of tracks, from its file where there is one."""
    torch.set_num_threads(1)
    path = task.folder / "posteriors" / name / f"{task.video}.nc"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        posterior = infer(tracks, sampler="laplace", model=model, seed=0, hand_on=False)
        with write_atomically(path) as temporary:
            posterior.write(temporary)
    return AskablePosterior.read(path)


def deviations(task: Task) -> Result:
    """What a scene says of how motion deviates from the model, and the same under the extended one."""
    told = {}
    for name, model in task.models.items():
        posterior = posterior_of(task, load(DATA, video=task.video), name, model)
        batch = PosteriorWorlds(posterior, draws=DRAWS).batches[0]
        told[name] = {"impulse": turns(batch.deviations), "acceleration": list(batch.wandering)}
    return {"scene": task.scene, **told}


def _learned(told: Sequence[Result]) -> DeviationModel:
    impulse, acceleration = (
        ScalePrior.learned([one["base"][name] for one in told]) for name in ("impulse", "acceleration")
    )
    return DeviationModel(impulse, acceleration)


def judgements(task: Task) -> Result:
    """Judgements of all answers about a scene, by the name of the row."""
    tracks = load(DATA, video=task.video)
    asked = read_questions(DATA / "questions.json")[task.video]
    rows = {name: [_judged(task, facts, one) for one in asked] for name, facts in _worlds(task, tracks).items()}
    return {"scene": task.scene, "rows": rows}


def _judged(task: Task, facts: Facts, question: Question) -> dict[str, object]:
    return judge(task.video, facts, question).to_document()


def _worlds(task: Task, tracks: Tracks) -> dict[str, Facts]:
    """The worlds of a scene, with and without each part."""
    posterior, deviating = posterior_of(task, tracks, "base", task.model), task.deviating
    assert deviating is not None
    worlds: dict[str, Facts] = {
        FULL: PosteriorWorlds(posterior, draws=DRAWS, deviating=deviating),
        BEST_FIT: plug_in_worlds(posterior),
        "defaults from the prior": PosteriorWorlds(posterior, draws=DRAWS, deviating=deviating, defaults="prior"),
        "no deviations": PosteriorWorlds(posterior, draws=DRAWS, deviating=None),
        "seen deviations not reused": PosteriorWorlds(
            posterior, draws=DRAWS, deviating=DeviationModel(deviating.impulse, deviating.acceleration, reused=False)
        ),
        "no draw on its own course": PosteriorWorlds(posterior, draws=DRAWS, deviating=deviating, own_courses=False),
        "nothing kept: all simulated from the release": ReleasedWorlds(posterior, DRAWS),
        TRUE: PosteriorWorlds(TruePosterior(tracks, DATA / "truth"), draws=DRAWS, deviating=deviating),
    }
    if task.extended is not None:
        extended = posterior_of(task, tracks, "extended", task.extended)
        worlds[EXTENDED] = PosteriorWorlds(extended, draws=DRAWS, deviating=deviating)
        worlds[EXTENDED_BEST_FIT] = plug_in_worlds(extended)
    return worlds


def preference(task: Task) -> Result:
    """How much better than the base model the extended one is expected to predict new positions of a scene, in nats."""
    tracks = load(DATA, video=task.video)
    waic = {name: expected_log_density(posterior_of(task, tracks, name, model)) for name, model in task.models.items()}
    return {"scene": task.scene, "gain": waic["extended"] - waic["base"]}


def expected_log_density(posterior: AskablePosterior) -> float:
    """Expected log density in nats of new positions (WAIC; Watanabe, JMLR 11, 2010, equation 6, without its sign)."""
    position = posterior.data["log_likelihood"]["position"]
    values = position.stack(sample=("chain", "draw")).transpose("sample", ...).values
    log_mean = logsumexp(values, axis=0) - np.log(len(values))
    return float((log_mean - values.var(axis=0)).sum())


def _preference(found: Mapping[int, Result]) -> list[str]:
    """What each half of the scenes says of the extended model."""
    told = []
    for half, name in enumerate(("even", "odd")):
        gains = np.array([one["gain"] for scene, one in found.items() if scene % 2 == half])
        error = gains.std(ddof=1) * np.sqrt(len(gains))
        told.append(
            f"{gains.sum():.0f} ± {error:.0f} nats on the {name} scenes (better in {(gains > 0).sum()} of {len(gains)})"
        )
    return ["", f"Expected log density of new positions (WAIC), extended model less base model: {' and '.join(told)}."]


def with_fewer_frames(task: Task) -> Result:
    """Judgements of all answers where some of the frames were seen, evenly spaced, by their number."""
    tracks = load(DATA, video=task.video)
    asked, rows = read_questions(DATA / "questions.json")[task.video], {}
    for frames in FEWER_FRAMES:
        name = "base" if frames >= len(tracks.times) else f"frames-{frames}"
        posterior = posterior_of(task, thinned(tracks, frames), name, task.model)
        worlds = PosteriorWorlds(posterior, draws=DRAWS, deviating=task.deviating)
        rows[str(frames)] = [_judged(task, worlds, one) for one in asked]
    return {"scene": task.scene, "rows": rows}


def thinned(tracks: Tracks, frames: int) -> Tracks:
    """Some of the frames, evenly spaced, the first and the last among them; objects not seen twice are left out."""
    chosen = np.linspace(0, len(tracks.times) - 1, min(frames, len(tracks.times))).round().astype(int)
    data = tracks.data.isel(time=chosen)
    kept = np.isfinite(data["x"].values).sum(axis=0) >= 2
    bodies = tuple(body for body, there in zip(tracks.bodies, kept, strict=True) if there)
    return Tracks(tracks.video, bodies, data.isel(body=kept), tracks.walls, tracks.camera)


def _rows(results: Sequence[Result]) -> dict[str, list[Judgement]]:
    rows: dict[str, list[Judgement]] = {}
    for result in results:
        for name, made in result["rows"].items():
            rows.setdefault(name, []).extend(Judgement.of_document(one) for one in made)
    return rows


def _tables(rows: Mapping[str, Sequence[Judgement]]) -> list[str]:
    lines = _scores(rows, FULL, BEST_FIT)
    if EXTENDED in rows:
        lines += [
            "",
            "With the extended model, beside its own best fit:",
            "",
            *_scores(rows, EXTENDED, EXTENDED_BEST_FIT),
        ]
    lines += ["", table_row("right per question, Brier", *map(title, GOALS)), table_row(*["---"] * (len(GOALS) + 1))]
    for name, made in rows.items():
        scores = [Scores.of([one for one in made if one.kind is kind]) for kind in GOALS]
        lines.append(table_row(name, *(f"{percent(one.accuracy_per_question)}, {number(one.brier)}" for one in scores)))
    return lines


def _scores(rows: Mapping[str, Sequence[Judgement]], name: str, best_fit: str) -> list[str]:
    """Scores of a row by kind, beside those of a best fit."""
    head = ("questions", "right, per question", "per option", "Brier", "lower than the best fit's by", *CALIBRATION)
    lines = [table_row(*head), table_row(*["---"] * len(head))]
    for kind in GOALS:
        ours, plain = ([one for one in rows[row] if one.kind is kind] for row in (name, best_fit))
        score, lower = Scores.of(ours), gain(*brier_gain(ours, plain))
        shares = [_with_interval(score, f"accuracy_per_{unit}") for unit in ("question", "option")]
        lines.append(table_row(f"{title(kind)} ({score.questions})", *shares, number(score.brier), lower, *_ece(score)))
    return lines


def _fewer_table(rows: Mapping[str, Sequence[Judgement]]) -> list[str]:
    head = ("frames seen", "questions", "options", "right, per question", "per option", "Brier", "entropy, nats")
    lines = [table_row(*head, *CALIBRATION), table_row(*["---"] * (len(head) + len(CALIBRATION)))]
    for kind in GOALS:
        for frames in FEWER_FRAMES:
            made = [one for one in rows[str(frames)] if one.kind is kind]
            score = Scores.of(made)
            doubts = [p for one in made for p in _forecasts(one)]
            doubt = np.mean([entropy(np.array([p, 1 - p])) for p in doubts])
            shares = [percent(score.accuracy_per_question), percent(score.accuracy_per_option)]
            counts = str(score.questions), str(score.options)
            cells = (f"{title(kind)}, {frames}", *counts, *shares, number(score.brier), f"{doubt:.3f}")
            lines.append(table_row(*cells, *_ece(score)))
    return lines


def _forecasts(one: Judgement) -> list[float]:
    """Probabilities of the options, or of the answer to an open question."""
    return [p for p, _ in one.choices] or [one.confidence]


def _with_interval(score: Scores, name: str) -> str:
    value, interval = getattr(score, name), score.intervals.get(name)
    if value is None or interval is None:
        return ""
    return f"{percent(value)} ({percent(interval.low)} to {percent(interval.high)})"


def _ece(score: Scores) -> tuple[str, str]:
    return number(score.ece), number(score.ece_if_calibrated_q95)


def _checks(rows: Mapping[str, Sequence[Judgement]]) -> list[dict[str, object]]:
    checks: list[dict[str, object]] = []
    for kind, goals in GOALS.items():
        ours, plain = ([one for one in rows[name] if one.kind is kind] for name in (FULL, BEST_FIT))
        score = Scores.of(ours)
        reached = (score.accuracy_per_option, score.accuracy_per_question)
        for goal, unit, value in zip(goals, ("option", "question"), reached, strict=True):
            if goal is not None:
                checks.append(_check(f"{kind}, per {unit}", value, goal, ok=value is not None and value >= goal))
        limit = score.ece_if_calibrated_q95 or 0.0
        checks.append(_check(f"{kind}, calibration error", score.ece, limit, ok=(score.ece or 0.0) <= limit))
        gain = brier_gain(ours, plain)[0]
        checks.append(_check(f"{kind}, Brier score below the best fit's by", gain, 0.0, ok=gain > 0))
    return checks


def _check(name: str, value: float | None, goal: float, *, ok: bool) -> dict[str, object]:
    return {"name": name, "value": value, "goal": goal, "ok": ok}


if __name__ == "__main__":
    sys.exit(main())

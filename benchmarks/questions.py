"""Accuracy and Brier score of answers on the practice scenes, by type of question.

    python benchmarks/questions.py [--scenes A:B] [--input tracks|videos|truth] [--parameters inferred|true]
                                   [--sampler laplace|emcee|nuts] [--defaults fixed|prior]
                                   [--draws N] [--english] [--misses] [--json FILE]

`--input truth` fills the event tables from the truth files: programs, operations and language without any physics.
`--parameters true` takes masses and restitutions from the truth files: the ceiling of what better inference can reach.
"""

import argparse
import json
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from _clevrer_truth import true_facts
from _true_posterior import TruePosterior

from vrdp_prob.datasets import load, read_questions
from vrdp_prob.errors import InputError
from vrdp_prob.files import write_atomically
from vrdp_prob.reasoning import PosteriorWorlds, ask, infer
from vrdp_prob.reasoning.answer import Answer
from vrdp_prob.reasoning.facts import Facts
from vrdp_prob.scene import Question

DATA = Path(__file__).parents[2] / "shared" / "data" / "clevrer_bullet"
MASS = "counterfactual, mass"
REMOVAL = "counterfactual, removal"
GOALS = {
    "descriptive": (None, 0.97),
    "explanatory": (None, 0.95),
    "predictive": (0.92, 0.90),
    REMOVAL: (0.92, 0.84),
    MASS: (0.88, 0.76),
}
"""Wanted accuracy per option and per question."""


@dataclass
class Score:
    """What was answered right in one type of question."""

    questions: list[bool] = field(default_factory=list)
    options: list[bool] = field(default_factory=list)
    squared_errors: list[float] = field(default_factory=list)

    @property
    def per_question(self) -> float:
        """Share of questions answered right in full."""
        return float(np.mean(self.questions)) if self.questions else float("nan")

    @property
    def per_option(self) -> float:
        """Share of options judged right."""
        return float(np.mean(self.options)) if self.options else float("nan")

    @property
    def brier(self) -> float:
        """Mean squared error of the probability of each option, or of the right open answer."""
        return float(np.mean(self.squared_errors)) if self.squared_errors else float("nan")


def main() -> None:
    arguments = _arguments()
    begin, end = (int(part) for part in arguments.scenes.split(":"))
    scores: dict[str, Score] = defaultdict(Score)
    if DATA.is_dir():
        questions = read_questions(DATA / "questions.json")
    else:
        print(f"no data at {DATA}: nothing measured")
        questions, end = {}, begin
    started = time.monotonic()
    for scene in range(begin, end):
        facts = _facts(scene, arguments)
        for question in questions[f"video_{scene:05d}"]:
            asked = _without_programs(question) if arguments.english else question
            for miss in _judge(scores[_kind(question)], facts, question, asked):
                if arguments.misses:
                    print(f"scene {scene}, question {question.question_id}: {question.text} {miss}", file=sys.stderr)
    seconds = (time.monotonic() - started) / max(end - begin, 1)
    if scores:
        _print_table(scores, seconds)
    if arguments.json is not None:
        document = {"checks": _checks(scores), "seconds_per_scene": seconds, "scenes": [begin, end]}
        with write_atomically(arguments.json) as temporary:
            temporary.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", default="0:60", help="A:B, scenes A to B-1")
    parser.add_argument("--input", choices=("tracks", "videos", "truth"), default="tracks")
    parser.add_argument("--parameters", choices=("inferred", "true"), default="inferred")
    parser.add_argument("--sampler", choices=("laplace", "emcee", "nuts"), default="laplace")
    parser.add_argument("--defaults", choices=("fixed", "prior"), default="fixed", help="objects that never collided")
    parser.add_argument("--draws", type=int, default=400)
    parser.add_argument(
        "--english", action="store_true", help="parse the English, leave the programs of the file aside"
    )
    parser.add_argument("--misses", action="store_true", help="print every wrong answer to standard error")
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    if arguments.parameters == "true" and arguments.input == "videos":
        parser.error("--parameters true needs --input tracks: objects found in a video have names of their own")
    return arguments


def _facts(scene: int, arguments: argparse.Namespace) -> Facts:
    name = f"video_{scene:05d}"
    if arguments.input == "truth":
        return true_facts(DATA, scene)
    tracks = load(DATA / "videos" / f"{name}.mp4") if arguments.input == "videos" else load(DATA, video=name)
    if arguments.parameters == "true":
        return PosteriorWorlds(TruePosterior(tracks, DATA / "truth"), draws=arguments.draws)
    posterior = infer(tracks, sampler=arguments.sampler, hand_on=False)
    return PosteriorWorlds(posterior, draws=arguments.draws, defaults=arguments.defaults)


def _kind(question: Question) -> str:
    kind = str(question.question_type)
    if kind != "counterfactual":
        return kind
    return MASS if question.labels and "mass" in question.labels["question_subtype"] else REMOVAL


def _without_programs(question: Question) -> Question:
    choices = tuple(replace(choice, program=None) for choice in question.choices)
    return replace(question, program=None, question_type=None, choices=choices)


def _judge(score: Score, facts: Facts, question: Question, asked: Question) -> Iterator[str]:
    """Score one question; gives what is wrong with its answer. What cannot be answered counts as wrong."""
    try:
        answer: Answer | None = ask(facts, asked)
    except InputError as error:
        answer = None
        yield str(error)
    if not question.choices:
        right = answer is not None and str(answer.answer) == question.answer
        probability = 0.0 if answer is None else answer.distribution.get(str(question.answer), 0.0)
        score.questions.append(right)
        score.squared_errors.append((1 - probability) ** 2)
        if answer is not None and not right:
            yield f"answered {dict(answer.distribution)}, is {question.answer}"
        return
    judged = []
    for place, choice in enumerate(question.choices):
        truth = choice.answer == "correct"
        probability = 0.5 if answer is None else answer.choices[place].probability
        judged.append(answer is not None and (probability > 0.5) == truth)
        score.squared_errors.append((probability - truth) ** 2)
        if answer is not None and not judged[-1]:
            yield f"| {choice.text}: {probability:.2f}, is {choice.answer}"
    score.options += judged
    score.questions.append(all(judged))


def _checks(scores: dict[str, Score]) -> list[dict[str, object]]:
    checks = []
    for kind, goals in GOALS.items():
        for goal, unit, value in zip(
            goals, ("option", "question"), (scores[kind].per_option, scores[kind].per_question), strict=True
        ):
            if goal is not None:
                known = None if np.isnan(value) else value
                ok = known is not None and known >= goal
                checks.append({"name": f"{kind}, per {unit}", "value": known, "goal": goal, "ok": ok})
    return checks


def _print_table(scores: dict[str, Score], seconds: float) -> None:
    print(f"{'type':<26}{'questions':>10}{'per question':>14}{'per option':>12}{'Brier':>9}")
    for kind in GOALS:
        score = scores[kind]
        option = "" if not score.options else f"{score.per_option:.3f}"
        print(f"{kind:<26}{len(score.questions):>10}{score.per_question:>14.3f}{option:>12}{score.brier:>9.4f}")
    print(f"{seconds:.1f} s per scene")


if __name__ == "__main__":
    main()

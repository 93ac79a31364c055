"""What bounds the answers on the practice scenes: each part replaced by the truth in turn.

    python benchmarks/questions.py [--scenes A:B] [--input tracks|videos|truth] [--parameters inferred|true]
                                   [--defaults fixed|prior] [--draws N] [--english] [--misses] [--json FILE]

`vrdp-prob evaluate` scores the whole system; here `--parameters true` takes masses and restitutions from the truth
files (the ceiling of what better inference can reach), and `--input truth` fills the event tables from them: programs,
operations and language without any physics.
"""

import argparse
import json
import sys
import time
from dataclasses import replace
from pathlib import Path

from _answer_goals import GOALS
from _clevrer_truth import true_facts
from _true_posterior import TruePosterior

from vrdp_prob.datasets import load, read_questions
from vrdp_prob.evaluation.judgement import Judgement, Kind, judge
from vrdp_prob.evaluation.scores import Scores
from vrdp_prob.files import write_atomically
from vrdp_prob.reasoning import PosteriorWorlds, infer
from vrdp_prob.reasoning.facts import Facts
from vrdp_prob.scene import Question

DATA = Path(__file__).parents[2] / "shared" / "data" / "clevrer_bullet"


def main() -> None:
    arguments = _arguments()
    begin, end = (int(part) for part in arguments.scenes.split(":"))
    judgements: list[Judgement] = []
    if DATA.is_dir():
        questions = read_questions(DATA / "questions.json")
    else:
        print(f"no data at {DATA}: nothing measured")
        questions, end = {}, begin
    started = time.monotonic()
    for scene in range(begin, end):
        name = f"video_{scene:05d}"
        facts = _facts(name, scene, arguments)
        for question in questions[name]:
            asked = _without_programs(question) if arguments.english else question
            judged = judge(name, facts, asked)
            judgements.append(judged)
            if arguments.misses and not judged.right:
                print(_miss(judged), file=sys.stderr)
    seconds = (time.monotonic() - started) / max(end - begin, 1)
    scores = {kind: Scores.of([one for one in judgements if one.kind is kind]) for kind in Kind}
    if judgements:
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


def _facts(name: str, scene: int, arguments: argparse.Namespace) -> Facts:
    if arguments.input == "truth":
        return true_facts(DATA, scene)
    tracks = load(DATA / "videos" / f"{name}.mp4") if arguments.input == "videos" else load(DATA, video=name)
    if arguments.parameters == "true":
        return PosteriorWorlds(TruePosterior(tracks, DATA / "truth"), draws=arguments.draws)
    posterior = infer(tracks, sampler="laplace", hand_on=False)
    return PosteriorWorlds(posterior, draws=arguments.draws, defaults=arguments.defaults)


def _without_programs(question: Question) -> Question:
    choices = tuple(replace(choice, program=None) for choice in question.choices)
    return replace(question, program=None, question_type=None, choices=choices)


def _miss(judged: Judgement) -> str:
    options = ", ".join(f"{share:.2f} ({'right' if right else 'wrong'})" for share, right in judged.choices)
    given = judged.refused or f"answered '{judged.answer}' with {judged.confidence:.2f}, is '{judged.truth}'"
    return (
        f"{judged.scene}, question {judged.question_id}: {judged.question} {given}{options and '; options '}{options}"
    )


def _checks(scores: dict[Kind, Scores]) -> list[dict[str, object]]:
    checks: list[dict[str, object]] = []
    for kind, goals in GOALS.items():
        reached = (scores[kind].accuracy_per_option, scores[kind].accuracy_per_question)
        for goal, unit, value in zip(goals, ("option", "question"), reached, strict=True):
            if goal is not None:
                ok = value is not None and value >= goal
                checks.append({"name": f"{kind}, per {unit}", "value": value, "goal": goal, "ok": ok})
    return checks


def _print_table(scores: dict[Kind, Scores], seconds: float) -> None:
    print(f"{'type':<26}{'questions':>10}{'per question':>14}{'per option':>12}{'Brier':>9}")
    for kind, score in scores.items():
        question, option = (
            "" if value is None else f"{value:.3f}"
            for value in (score.accuracy_per_question, score.accuracy_per_option)
        )
        brier = "" if score.brier is None else f"{score.brier:.4f}"
        print(f"{kind:<26}{score.questions:>10}{question:>14}{option:>12}{brier:>9}")
    print(f"{seconds:.1f} s per scene")


if __name__ == "__main__":
    main()

"""Concepts learned from questions and answers, against the rules of perception and against the truth.

    python benchmarks/concepts.py [--json FILE] [--docs DIR] [--sizes 5,10,20,40] [--keep DIR]

Concepts are learned from the first videos of scenes 4 to 43 of ../shared/data/clevrer_bullet and tested on scenes 0 to
3 (another renderer) and 44 to 59. Three variants: the rules of perception; learned attributes, with events and motion
as the tracks tell them; learned attributes, events and motion. Truth is for scoring alone. What was seen and learned is
kept (`--keep`), so that the same call, after an interruption, goes on from there. Without the data nothing is measured.
"""

import argparse
import json
import sys
from pathlib import Path

import torch
from _concepts_page import draw, table, write_page
from _concepts_scores import Case, Score, add_video, tracks_facts

from vrdp_prob.concepts.perceived.concepts import Concepts
from vrdp_prob.concepts.perceived.from_files import facts, films, look_at
from vrdp_prob.concepts.perceived.learning import learn
from vrdp_prob.datasets import read_questions
from vrdp_prob.inference.runs.checkpoint import Checkpoint
from vrdp_prob.perception import see_video
from vrdp_prob.progress import progress_display
from vrdp_prob.scene import Camera, QuestionType

DATA = Path(__file__).parents[2] / "shared" / "data" / "clevrer_bullet"
FIRST = 4
TEST = (0, 1, 2, 3, *range(44, 60))
GOALS = {"color": 0.97, "shape": 0.97, "material": 0.85}
MOST_LOST = 0.02
"""Descriptive questions that learned attributes may answer worse than the rules."""
ASKED = (QuestionType.DESCRIPTIVE, QuestionType.EXPLANATORY)
ALONE = "learned events too"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="file for the checks")
    parser.add_argument("--docs", type=Path, help="folder of the documentation; its page gets the table and the figure")
    parser.add_argument("--sizes", default="5,10,20,40", help="numbers of videos to learn from")
    parser.add_argument("--keep", type=Path, default=Path("out/concepts"), help="folder that keeps what was done")
    options = parser.parse_args()
    torch.set_num_threads(1)
    sizes = [int(size) for size in options.sizes.split(",")]
    scores: dict[str, Score] = {}
    if DATA.is_dir():
        scores = measured(sizes, options.keep)
        print(table(scores))
    else:
        print(f"no data at {DATA}: nothing measured")
    if options.docs and scores:
        learned, alone = ([scores[name] for name in names] for names in zip(*map(variants, sizes), strict=True))
        (options.docs / "figures").mkdir(exist_ok=True)
        draw(options.docs / "figures" / "concepts-videos.svg", sizes, learned, alone, scores["rules"])
        write_page(options.docs / "learned-concepts.md", scores, note(scores))
    if options.json:
        options.json.write_text(json.dumps({"checks": checks(scores, sizes[-1])}, indent=1) + "\n", encoding="utf-8")
    return 0


def variants(size: int) -> tuple[str, str]:
    """Names of what is learned from so many videos."""
    return f"{size} videos", f"{size} videos, {ALONE}"


def measured(sizes: list[int], keep: Path) -> dict[str, Score]:
    """Scores of the rules and of concepts learned from each number of videos."""
    asked = {
        scene: [question for question in several if question.question_type in ASKED]
        for scene, several in enumerate(read_questions(DATA / "questions.json").values())
    }
    camera = Camera.read(DATA / "camera.json")
    cases = [
        Case(DATA, scene, see_video(DATA / "videos" / f"video_{scene:05d}.mp4", camera), asked[scene]) for scene in TEST
    ]
    scores = {"rules": Score()}
    for case in cases:
        add_video(scores["rules"], case, tracks_facts(case.seen.tracks))
    for size in sizes:
        attributes, alone = variants(size)
        concepts = learned_from(size, keep)
        scores[attributes], scores[alone] = Score(), Score()
        for case in cases:
            add_video(scores[attributes], case, tracks_facts(concepts.recognise(case.seen)))
            add_video(scores[alone], case, concepts.facts(case.seen))
        print(table({name: scores[name] for name in variants(size)}), file=sys.stderr)
    return scores


def learned_from(size: int, keep: Path) -> Concepts:
    """Concepts learned from so many videos."""
    progress = progress_display(quiet=False)
    shown = films(DATA / "videos", DATA / "questions.json", scenes=(FIRST, FIRST + size))
    kept = Checkpoint(keep / f"networks-{size}", facts(shown, seed=0, device="cpu"))
    videos = look_at(shown, checkpoint=keep / "videos", progress=progress)
    learned = learn(videos, seed=0, checkpoint=kept, progress=progress)
    print("\n".join(learned.lines), file=sys.stderr)
    return learned.concepts


def note(scores: dict[str, Score]) -> str:
    """What the table is of."""
    first = next(iter(scores.values()))
    objects, questions = len(first.right["color"]), len(first.squared_errors)
    return f"{len(TEST)} test videos with {objects} objects and {questions} questions; shares that are right."


def checks(scores: dict[str, Score], size: int) -> list[dict[str, object]]:
    """The goals, for the largest number of videos."""
    learned, rules = scores.get(variants(size)[0]), scores.get("rules")
    entries = [
        _check(f"{name} right", None if learned is None else learned.share(name), goal) for name, goal in GOALS.items()
    ]
    gain = None if learned is None or rules is None else learned.share("descriptive") - rules.share("descriptive")
    return [*entries, _check("descriptive questions, learned attributes minus rules", gain, -MOST_LOST)]


def _check(name: str, value: float | None, goal: float) -> dict[str, object]:
    return {"name": name, "value": value, "goal": goal, "ok": value is not None and value >= goal}


if __name__ == "__main__":
    sys.exit(main())

"""Words learned from questions and answers, and asked with: heavier, lighter, and a word that changes nothing.

    python benchmarks/new_words.py [--json FILE] [--docs docs] [--teach 26] [--scenes 60] [--results DIR]
                                   [--model FILE.toml] [--hand-on]

The questions are those of ../shared/data/clevrer_bullet about heavier and lighter objects, one of each per video. The
words are learned as if they were unknown from the first videos (`--teach`; one that has no posterior is left out), and
the questions about the other videos are answered with the learned word and with the built-in one. The word that changes
nothing comes from the questions about heavier objects with the answers of the unchanged video. Each video's posterior
and results are written to `--results` as they come, so that a run that was interrupted goes on; those of another
version of the code, or of another `--model` or `--hand-on`, are to be deleted by hand. `--docs` writes the table into
`new-words.md` there and the figure beside it (needs matplotlib).
Without the data nothing is measured.
"""

import argparse
import json
import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import torch
from _clevrer_truth import true_facts
from _new_words_page import COUNTS, UNCHANGED, checks, figure, page, table
from _resumable import Result, measured

from vrdp_prob import AskablePosterior
from vrdp_prob.concepts.physical import LearnedWord
from vrdp_prob.concepts.physical.agreement import Agreement, agreements_of
from vrdp_prob.concepts.physical.examples import mentions
from vrdp_prob.concepts.physical.learn import DRAWS, word_of
from vrdp_prob.datasets import load, read_questions
from vrdp_prob.evaluation.judgement import judge
from vrdp_prob.inference import default_model
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.rollout import compile_model
from vrdp_prob.reasoning import PosteriorWorlds, infer
from vrdp_prob.reasoning.executor import answer_question
from vrdp_prob.scene import Choice, Question
from vrdp_prob.scene.question import RIGHT, WRONG

DATA = Path(__file__).parents[2] / "shared" / "data" / "clevrer_bullet"
RESULTS = Path("out") / "new_words"
BUILT_IN = ("heavier", "lighter")
ORDERS = 20
"""Random orders of the videos in which the words are learned, for the figure."""


def main(arguments: Sequence[str] | None = None) -> int:
    options = _options(arguments)
    taught: list[Result] = []
    asked: list[Result] = []
    if DATA.is_dir():
        model = default_model() if options.model is None else PhysicsModel.read(options.model)
        compile_model(model)
        posteriors = Posteriors(options.results, model, options.hand_on)
        taught = measured(
            teach,
            {scene: (scene, posteriors) for scene in range(options.teach)},
            options.results / "taught.jsonl",
            field="scene",
            label="Teaching",
            processes=options.processes,
        )
        taught = [one for one in taught if "failed" not in one]
        words = {word: {count: learned(word, taught[:count]) for count in counts(taught)} for word in BUILT_IN}
        asked = measured(
            ask,
            {scene: (scene, posteriors, words) for scene in range(options.teach, options.scenes)},
            options.results / f"asked-{options.teach}.jsonl",
            field="scene",
            label="Asking",
            processes=options.processes,
        )
        asked = [one for one in asked if "failed" not in one]
    else:
        print(f"no data at {DATA}: nothing measured")
    first = {word: [learned(word, taught[:count]) for count in counts(taught)] for word in (*BUILT_IN, UNCHANGED)}
    if taught:
        print(table(first, asked))
    if options.docs and taught:
        page(table(first, asked), options.docs / "new-words.md")
        figure(in_random_orders(taught), options.docs / "figures" / "new-words.svg")
    if options.json:
        options.json.write_text(json.dumps({"checks": checks(first, asked)}, indent=1) + "\n", encoding="utf-8")
    return 0


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="file for the checks")
    parser.add_argument("--docs", type=Path, help="folder of the documentation, whose page and figure are written anew")
    parser.add_argument("--teach", type=int, default=26, help="videos that the words are learned from")
    parser.add_argument("--scenes", type=int, default=60, help="all videos; those that teach not are asked about")
    parser.add_argument("--results", type=Path, default=RESULTS, help="folder of the results, which are gone on with")
    parser.add_argument("--hand-on", action="store_true", help="emcee where Laplace draws cannot be trusted; hours")
    parser.add_argument("--model", type=Path, help="model in TOML that the videos are inferred with")
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    return parser.parse_args(arguments)


def counts(taught: Sequence[Result]) -> list[int]:
    """Numbers of videos that words are learned from."""
    return [count for count in COUNTS if count <= len(taught)]


@dataclass(frozen=True)
class Posteriors:
    """The posteriors of the videos, each inferred once and kept.

    Parameters
    ----------
    folder
        Where they are kept.
    model
        With which physics.
    hand_on
        Whether emcee goes on where Laplace draws cannot be trusted.
    """

    folder: Path
    model: PhysicsModel
    hand_on: bool

    def of(self, scene: int) -> AskablePosterior:
        """That of a video."""
        path = self.folder / f"{name_of(scene)}.nc"
        if not path.exists():
            tracks = load(DATA, video=name_of(scene))
            infer(tracks, sampler="laplace", model=self.model, hand_on=self.hand_on, seed=0).write(path)
        return AskablePosterior.read(path)


def teach(task: tuple[int, Posteriors]) -> Result:
    """How far every meaning agrees with the answers about one video, word by word."""
    scene, posteriors = task
    torch.set_num_threads(1)
    try:
        posterior = posteriors.of(scene)
    except Exception as error:  # one video must not take the others with it; the reason stands in the results
        return {"scene": scene, "failed": f"{type(error).__name__}: {error}"}
    found: dict[str, list[Any]] = {}
    for word in BUILT_IN:
        (question,) = questions_with(word, scene)
        several = [[question], [answers_of_the_video(question, scene)]] if word == "heavier" else [[question]]
        told = agreements_of(word, posterior, several, draws=DRAWS, seed=0)
        found |= dict(zip((word, UNCHANGED), (one.draws.tolist() for one in told), strict=False))
    return {"scene": scene, "agreements": found}


def ask(task: tuple[int, Posteriors, Mapping[str, Mapping[int, LearnedWord]]]) -> Result:
    """Probability and truth of every choice about one video, with the built-in words and with the learned ones."""
    scene, posteriors, words = task
    torch.set_num_threads(1)
    try:
        worlds = PosteriorWorlds(posteriors.of(scene))
    except Exception as error:  # likewise
        return {"scene": scene, "failed": f"{type(error).__name__}: {error}"}
    answers = {}
    for word, by_count in words.items():
        (question,) = questions_with(word, scene)
        answers[word] = {"built-in": judge(name_of(scene), worlds, question).choices}
        for count, meaning in by_count.items():
            answers[word][str(count)] = judge(name_of(scene), worlds, question, [meaning]).choices
    return {"scene": scene, "answers": answers}


def learned(word: str, taught: Sequence[Result]) -> LearnedWord:
    """The word that some videos teach."""
    agreements = [Agreement(np.array(one["agreements"][word])) for one in taught]
    return word_of(word, agreements, examples=len(agreements), draws=DRAWS, seed=0)


def in_random_orders(taught: Sequence[Result]) -> dict[str, dict[int, list[LearnedWord]]]:
    """Each word as learned from the first videos of random orders, by their number."""
    generator = np.random.default_rng(0)
    orders = [generator.permutation(len(taught)) for _ in range(ORDERS)]
    return {
        word: {
            count: [learned(word, [taught[place] for place in order[:count]]) for order in orders]
            for count in counts(taught)
        }
        for word in (*BUILT_IN, UNCHANGED)
    }


def questions_with(word: str, scene: int) -> list[Question]:
    """The questions about a video that use a word."""
    return [
        question for question in read_questions(DATA / "questions.json")[name_of(scene)] if mentions(question, word)
    ]


def answers_of_the_video(question: Question, scene: int) -> Question:
    """The same question, judged by what happens in the video as it is."""
    facts, negated = true_facts(DATA, scene), "negate" in (question.program or ())

    def judged(choice: Choice) -> Choice:
        event = ["events" if token == "all_events" else token for token in choice.program or ()]
        happens = answer_question(facts, [*event[:-1], "exist"]).answer == "yes"
        return replace(choice, answer=RIGHT if happens != negated else WRONG)

    return replace(question, choices=tuple(judged(choice) for choice in question.choices))


def name_of(scene: int) -> str:
    return f"video_{scene:05d}"


if __name__ == "__main__":
    sys.exit(main())

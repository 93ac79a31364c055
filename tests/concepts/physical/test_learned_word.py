"""A learned word as a file, in sentences, and in questions."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.concepts.physical.words import MASS, NOTHING, SPEED, UNSURE, word
from tests.reasoning.hand_made import STORY, collision, video
from tests.reasoning.sliding_discs import Disc, KnownPosterior, tracks_of
from vrdp_prob.concepts.physical import LearnedWord
from vrdp_prob.concepts.physical.belief import Belief
from vrdp_prob.errors import InputError
from vrdp_prob.reasoning import ask
from vrdp_prob.reasoning.changes import Change, PhysicalParameter, Rule
from vrdp_prob.reasoning.checking import check_question
from vrdp_prob.scene import QuestionType

QUESTION = "If the red cube were floppier, what would happen?"
CHOICE = "The red cube collides with the blue cube"


def test_the_file_gives_the_word_back(tmp_path: Path) -> None:
    UNSURE.write(tmp_path / "floppier.json")
    again = LearnedWord.read(tmp_path / "floppier.json")
    assert again == UNSURE
    assert again.change == UNSURE.change
    assert json.loads((tmp_path / "floppier.json").read_text())["summary"] == list(UNSURE.summary)


def _set(*path: str | int, to: object) -> Callable[[Any], None]:
    def change(document: Any) -> None:
        for step in path[:-1]:
            document = document[step]
        document[path[-1]] = to

    return change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (_set("format", to="another"), "not a learned word; give a file that `vrdp-prob learn-word` wrote"),
        (_set("version", to=7), "a word of version 7, but version 1 is read"),
        (_set("extra", to=1), "fields extra are missing or unknown"),
        (_set("name", to="red"), "means something else in questions"),
        (_set("beliefs", 1, "probability", to=0.9), "the probabilities of beliefs do not add up to 1"),
        (_set("beliefs", 1, "weights", to=[0.2, 0.2, 0.2]), "the probabilities of weights of mass factor do not add"),
        (_set("beliefs", 1, "amounts", to=[2.0, 1.0, 0.5]), "the amounts of mass factor are not ascending numbers"),
        (_set("beliefs", 1, "amounts", to=[1.0, 2.0]), "the amounts of mass factor are not ascending numbers"),
        (_set("beliefs", 1, "parameter", to="colour"), "'colour' is not a valid PhysicalParameter"),
        (_set("beliefs", 0, "why", to="?"), "not a whole word"),
        (_set("evidence", "videos", to="many"), "not a whole word"),
        (_set("lapse", to={"mean": 0.1}), "not a whole word"),
        (_set("beliefs", 1, "rule", to=None), "the beliefs are not about changes that a word may mean"),
        (_set("beliefs", 1, "rule", to="offset"), "the beliefs are not about changes that a word may mean"),
        (_set("beliefs", to=[]), "the beliefs are not about changes that a word may mean"),
        (_set("beliefs", 1, "log_evidence", to=None), "not a whole word"),
        (_set("log_gain", to=float("nan")), "a number is not finite"),
        (_set("mc_errors", to={}), "mc_errors and beliefs are not about the same parameters"),
    ],
)
def test_files_that_are_no_words(tmp_path: Path, change: Callable[[Any], None], message: str) -> None:
    path = tmp_path / "floppier.json"
    UNSURE.write(path)
    document = json.loads(path.read_text())
    change(document)
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match=f"floppier.json: .*{message}"):
        LearnedWord.read(path)


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"floppier.json: the file cannot be read .*; check the path"):
        LearnedWord.read(tmp_path / "floppier.json")
    (tmp_path / "floppier.json").write_text("[1, 2")
    with pytest.raises(InputError, match="not a JSON file"):
        LearnedWord.read(tmp_path / "floppier.json")
    (tmp_path / "floppier.json").write_text("[1, 2]")
    with pytest.raises(InputError, match="not a learned word"):
        LearnedWord.read(tmp_path / "floppier.json")


def test_what_it_changes_adds_up_over_the_ways_to_change_it() -> None:
    other = Belief(PhysicalParameter.MASS, Rule.OFFSET, 0.15, 0.01, 1.0, (-1.0, 0.0, 1.0), (0.0, 0.5, 0.5))
    learned = word(NOTHING, MASS, other)
    assert learned.probabilities == pytest.approx({"nothing": 0.25, "mass": 0.75})
    assert (learned.subject, learned.best) == ("mass", MASS)


def test_the_change_holds_every_meaning_by_its_probability() -> None:
    meanings = UNSURE.change.meanings
    assert sum(meaning.probability for meaning in meanings) == pytest.approx(1)
    assert [meaning.probability for meaning in meanings if meaning.shift is None] == pytest.approx([0.25])
    twice = [m for m in meanings if m.shift is not None and m.shift.amount == 2.0]
    assert [(m.shift.parameter, m.probability) for m in twice if m.shift] == [("mass", pytest.approx(0.45))]


def test_sentences() -> None:
    first, second, third, last = UNSURE.summary
    assert first.startswith("'floppier' most probably changes the mass: times ")
    assert first.endswith("(probability 0.600 ± 0.010).")
    assert second == "That is not settled: mass 0.60, nothing 0.25, speed 0.15."
    assert third.startswith("Of the 9 answers to 3 questions about 2 videos about 10 % are no better than guessed")
    assert last == "v9 was left out."
    sure = word(Belief(None, None, 0.99, 0.001, 5.0), Belief(**{**vars(MASS), "probability": 0.01}))
    assert sure.summary[0] == "'floppier' changes nothing (probability 0.990 ± 0.020)."
    alike = word(Belief(None, None, 0.4, 0.0, 3.0), MASS)
    assert alike.summary[0] == "The answers do not tell what 'floppier' means."
    against = word(NOTHING, MASS, SPEED, log_gain=-2.0)
    assert against.contradicts_itself
    assert against.summary[0].endswith("guessing explains the 9 answers better (by 2.0 nats).")
    assert against.summary[-1] == "v9 was left out."


@pytest.mark.parametrize(
    "program",
    [
        "all_events objects red filter_color cube filter_shape unique counterfact_floppier",
        "objects red filter_color cube filter_shape unique counterfact_floppier",
        "objects red filter_color cube filter_shape unique apply_floppier get_counterfact",
    ],
)
def test_programs_with_the_word(program: str) -> None:
    facts = video(STORY, changed={(UNSURE.change, 0): [[collision(40, "0", "3")]]})
    answer = ask(facts, [*program.split(), "count"], words=[UNSURE])
    assert (answer.answer, answer.question_type) == (1, QuestionType.COUNTERFACTUAL)


def test_questions_in_english_with_the_word() -> None:
    facts = video(STORY, changed={(UNSURE.change, 0): [[collision(40, "0", "3")]]})
    for question in (
        QUESTION,
        "What would happen if the red cube were floppier?",
        "What will not happen if the red cube is much floppier?",
    ):
        answer = ask(facts, question, choices=[CHOICE], words=[UNSURE])
        assert answer.choices[0].probability == (0.0 if "not" in question else 1.0)


def test_an_answer_is_marginal_over_the_meaning() -> None:
    """Half of the meanings let the red disc reach the blue one, half leave it as it was."""
    discs = (Disc((-1.5, 0.0), (0.85, 0.0)), Disc((0.0, 0.05)), Disc((0.9, 0.15)))
    posterior = KnownPosterior(tracks_of(discs, 60), discs)
    faster = Belief(PhysicalParameter.SPEED, Rule.FACTOR, 0.5, 0.0, 0.0, (1.7, 1.8), (0.5, 0.5))
    learned = word(Belief(None, None, 0.5, 0.0, 0.0), faster)
    question, draws = "Would the red object hit the blue object if the red object were floppier?", 300
    answer = ask(posterior, question, draws=draws, words=[learned])
    yes = answer.distribution["yes"]
    assert yes == pytest.approx(0.5, abs=3 * np.sqrt(0.25 / draws))
    assert answer.explain().parts[0].probability == max(yes, 1 - yes)


def test_a_word_that_was_not_given_is_refused_by_its_name() -> None:
    for words in ([], [word(NOTHING, MASS, SPEED, name="slipperier")]):
        with pytest.raises(InputError, match=r"is not understood at 'floppier' \(word 6\)"):
            check_question(QUESTION, choices=[CHOICE], words=words)
        with pytest.raises(InputError, match="'counterfact_floppier' is unknown"):
            check_question(["objects", "unique", "counterfact_floppier", "count"], words=words)
    with pytest.raises(InputError, match="'floppier'"):
        check_question("If the red cube were five times floppier, what would happen?", choices=[CHOICE], words=[UNSURE])
    with pytest.raises(InputError, match="the word 'floppier' is given twice"):
        check_question(QUESTION, choices=[CHOICE], words=[UNSURE, UNSURE])


def test_a_learned_meaning_of_a_built_in_word_replaces_it() -> None:
    learned = word(NOTHING, MASS, SPEED, name="heavier")
    changed = {(learned.change, 0): [[collision(40, "0", "3")]], (Change.HEAVIER, 0): [[]]}
    facts = video(STORY, changed=changed)
    for question in ("What if the red cube were heavier?", "What if the red cube were five times heavier?"):
        assert ask(facts, question, choices=[CHOICE], words=[learned]).choices[0].probability == 1.0
        assert ask(facts, question, choices=[CHOICE]).choices[0].probability == 0.0
    assert np.isclose(sum(meaning.probability for meaning in learned.change.meanings), 1)

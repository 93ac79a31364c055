"""A learned word as a file, in sentences, and in questions."""

import ast
import inspect
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.concepts.physical.words import MASS, NOTHING, SPEED, UNSURE, word
from tests.reasoning.hand_made import STORY, collision, video
from tests.reasoning.sliding_discs import Disc, KnownPosterior, tracks_of
from vrdp_prob.concepts.physical import LearnedWord
from vrdp_prob.concepts.physical.belief import Belief
from vrdp_prob.concepts.physical.hypotheses import HYPOTHESES
from vrdp_prob.concepts.physical.naming import TAKEN, WORD
from vrdp_prob.errors import InputError
from vrdp_prob.reasoning import ask
from vrdp_prob.reasoning.changes import Change, PhysicalParameter, Rule
from vrdp_prob.reasoning.checking import check_question
from vrdp_prob.reasoning.language import choices, questions
from vrdp_prob.reasoning.language import phrases as grammar_phrases
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
        (
            _set("beliefs", 1, "parameter", to="colour"),
            "beliefs 2, parameter is 'colour', and none of mass, ",
        ),
        (_set("beliefs", 0, "why", to="?"), "not a whole word"),
        (_set("evidence", "videos", to="many"), "not a whole word"),
        (_set("lapse", to={"mean": 0.1}), "not a whole word"),
        (_set("beliefs", 1, "rule", to=None), "the beliefs are not about changes that a word may mean"),
        (_set("beliefs", 1, "rule", to="offset"), "the beliefs are not about changes that a word may mean"),
        (_set("beliefs", to=[]), "the beliefs are not about changes that a word may mean"),
        (_set("beliefs", 1, "log_evidence", to=None), "not a whole word"),
        (_set("log_gain", to=float("nan")), "a number is not finite"),
        (_set("mc_errors", to={}), "mc_errors and beliefs are not about the same parameters"),
        (_set("mc_errors", to=[]), "mc_errors is no JSON object"),
        (_set("beliefs", to=5), "beliefs is no list"),
        (_set("beliefs", 0, to=5), "beliefs 1 is no JSON object"),
        (_set("beliefs", 1, "mc_error", to=-1.0), "the Monte Carlo error mc_error of mass factor is -1, below 0"),
        (_set("log_gain", to="4"), "log_gain is '4', and no number"),
        (_set("evidence", "answers", to=-1), "evidence.answers is -1, and no whole number from 0 on"),
        (_set("lapse", "mean", to=7), "lapse.mean is 7, and no share between 0 and 1"),
        (_set("lapse", "q05", to=0.9), "lapse.q05 is 0.9, above lapse.q95, 0.3"),
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


@pytest.mark.parametrize(
    ("parameter", "rule", "amounts", "message"),
    [
        ("mass", "factor", [0.5, 1.0, 1e300], r"mass factor from 0.5 to 1e\+300, but 0.0625 to 16 is considered"),
        ("mass", "factor", [0.06, 1.0, 2.0], "mass factor from 0.06 to 2, but"),
        ("mass", "factor", [-1.0, 1.0, 2.0], "mass factor from -1 to 2, but"),
        ("friction", "factor", [0.5, 1.0, 1e200], r"friction factor from 0.5 to 1e\+200, but 0.0625 to 16"),
        ("speed", "offset", [-1.0, 0.0, 1000.0], "speed offset from -1 to 1000, but -1.2 to 1.2 is considered"),
        ("restitution", "offset", [-0.9, 0.0, 0.8], "restitution offset from -0.9 to 0.8, but -0.8 to 0.8"),
        ("restitution", "factor", [0.5, 1.0, 4.1], "restitution factor from 0.5 to 4.1, but 0.25 to 4"),
    ],
)
def test_amounts_beyond_those_that_are_considered(
    tmp_path: Path, *, parameter: str, rule: str, amounts: list[float], message: str
) -> None:
    path = tmp_path / "floppier.json"
    word(NOTHING, MASS).write(path)
    document = json.loads(path.read_text())
    document["beliefs"][0]["probability"] = 0.4
    document["beliefs"][1] |= {"parameter": parameter, "rule": rule, "amounts": amounts}
    document["mc_errors"] = {"nothing": 0.01, parameter: 0.01}
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match=f"floppier.json: not a whole word .beliefs 2, amounts: {message}"):
        LearnedWord.read(path)


def test_amounts_at_the_limits_are_read(tmp_path: Path) -> None:
    every = [
        Belief(one.parameter, one.rule, 1 / 8, 0.0, 0.0, tuple(one.amounts.tolist()), tuple(one.prior.tolist()))
        for one in HYPOTHESES
    ]
    errors = {"nothing": 0.0, **{str(one.parameter): 0.0 for one in HYPOTHESES}}
    whole = replace(word(replace(NOTHING, probability=1 / 4), *every), mc_errors=errors)
    whole.write(tmp_path / "floppier.json")
    assert LearnedWord.read(tmp_path / "floppier.json") == whole


@pytest.mark.parametrize("name", ["would", "if", "happen", "there", "collides", "video", "red", "without"])
def test_words_that_the_grammar_needs_are_refused(tmp_path: Path, name: str) -> None:
    path = tmp_path / "word.json"
    word(NOTHING, MASS, SPEED, name=name).write(path)
    with pytest.raises(InputError, match=f"word.json: .*the word '{name}' means something else in questions"):
        LearnedWord.read(path)


def test_no_word_of_the_grammar_can_be_learned() -> None:
    phrases = set()
    for module in (questions, grammar_phrases, choices):
        for node in ast.walk(ast.parse(inspect.getsource(module))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
                read = node.args if node.func.attr in ("expect", "accept") else []
            else:
                read = node.value.elts if isinstance(node, ast.Assign) and isinstance(node.value, ast.Tuple) else []
            phrases |= {one.value for one in read if isinstance(one, ast.Constant) and isinstance(one.value, str)}
    spoken = {one for phrase in phrases for one in phrase.split() if WORD.fullmatch(one)}
    assert {"would", "if", "happen", "there", "collide"} <= spoken
    assert spoken <= TAKEN


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"floppier.json: the file cannot be read .*; check the path"):
        LearnedWord.read(tmp_path / "floppier.json")
    (tmp_path / "floppier.json").write_text("[1, 2")
    with pytest.raises(InputError, match="not a JSON file"):
        LearnedWord.read(tmp_path / "floppier.json")
    (tmp_path / "floppier.json").write_text("[1, 2]")
    with pytest.raises(InputError, match="not a learned word"):
        LearnedWord.read(tmp_path / "floppier.json")
    (tmp_path / "floppier.json").write_bytes(b"PK\x03\x04\xff\xfe")
    with pytest.raises(InputError, match=r"not a learned word; give a file that `vrdp-prob learn-word` wrote"):
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

"""Meanings: one tree for each program that the grammar gives, and words that the grammar reads back."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrdp_prob.datasets import read_questions
from vrdp_prob.reasoning.language import parse_choice, parse_question
from vrdp_prob.reasoning.language.meaning import PRODUCTIONS, draw, meaning_of
from vrdp_prob.reasoning.language.rewording import reworded
from vrdp_prob.reasoning.language.wording import Wordings, skeleton, wordings
from vrdp_prob.scene import QuestionType

FILES = ("canonical", "training", "development", "held_out/order", "held_out/synonym", "held_out/paraphrase")


@given(st.sampled_from(("question", "choice")), st.integers(0, 2**32 - 1))
def test_a_program_has_one_meaning(kind: str, seed: int) -> None:
    meaning = draw(kind, np.random.default_rng(seed))
    again = meaning_of(meaning.program, kind)
    assert again is not None
    assert again.program == meaning.program
    assert meaning_of((*meaning.program, "negate", "count"), kind) is None


@pytest.mark.parametrize("production", sorted(PRODUCTIONS["question"]))
def test_the_grammar_reads_its_own_wording_of_every_question(production: str) -> None:
    generator = np.random.default_rng(3)
    for _ in range(20):
        program = draw("question", generator, production).program
        wording = reworded(program, "question")
        assert wording is not None
        # 'the object that collides with the cube' says nothing of the object: its program is the shorter one
        bare = production == "attribute_of_such_partner" and "filter_collision objects filter_collision" in " ".join(
            program
        )
        assert bare or parse_question(wording) == program


@pytest.mark.slow
def test_the_practice_set_comes_back_in_the_grammars_words(shared_data: Path) -> None:
    wrong = []
    for questions in read_questions(shared_data / "clevrer_bullet" / "questions.json").values():
        for question in questions:
            assert question.program is not None
            wording = reworded(question.program, "question")
            wrong += [question.text] if wording is None or parse_question(wording) != question.program else []
            for choice in question.choices:
                assert choice.program is not None
                program = tuple("events" if token == "all_events" else token for token in choice.program)
                wording = reworded(program, "choice")
                if wording is None or parse_choice(wording, QuestionType.EXPLANATORY) != program:
                    wrong.append(choice.text)
    assert not wrong


def test_what_no_question_asks_has_no_wording() -> None:
    assert reworded(("objects", "unique", "apply_heavier", "query_color"), "question") is None
    assert reworded(("objects",), "question") is None


@pytest.mark.parametrize("name", FILES)
def test_every_template_can_be_said(name: str) -> None:
    chosen, generator = wordings(name), np.random.default_rng(0)
    for kind in ("question", "choice"):
        for production in chosen.productions(kind):
            for template in chosen.of(kind, production):
                text = chosen.fill(
                    chosen.settle(template, generator), draw(kind, generator, production).parts, generator
                )
                assert not set(text) & set("{}[]<>|"), text


def test_choices_in_templates() -> None:
    chosen = Wordings({}, {"hits": ("strikes", "meets")})
    assert chosen.settle("it <hits> [the|a] wall", None) == "it strikes the wall"
    assert chosen.variants("it <hits> [the|] {object.the}") == {
        "it strikes the {object",
        "it meets the {object",
        "it strikes {object",
        "it meets {object",
    }
    assert skeleton("Does {first.the} hit it?") == skeleton("does {first.other} HIT it")

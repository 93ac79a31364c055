"""The learned parser: what it reads, what it refuses, its weights file, its training."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from hand_made import STORY, collision, video

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning import ask
from vrdp_prob.reasoning.changes import Change
from vrdp_prob.reasoning.checking import check_question
from vrdp_prob.reasoning.language import parse_choice, parse_question, read_choice, read_question
from vrdp_prob.reasoning.language.learned.agreement import agrees
from vrdp_prob.reasoning.language.learned.examples import examples, is_held_out
from vrdp_prob.reasoning.language.learned.measure import nonsense_of, score, texts_of
from vrdp_prob.reasoning.language.learned.network import ParserNetwork
from vrdp_prob.reasoning.language.learned.parser import LearnedParser, learned_parser
from vrdp_prob.reasoning.language.learned.storage import WEIGHTS, read_parser, write_parser
from vrdp_prob.reasoning.language.learned.training import train
from vrdp_prob.reasoning.language.meaning import meaning_of
from vrdp_prob.reasoning.language.wording import wordings
from vrdp_prob.reasoning.language.words import split
from vrdp_prob.report.asked import world_of
from vrdp_prob.scene import QuestionType

STRANGE = "Count all red cubes that leave the picture."
PLAIN = "How many red cubes exit the scene?"


def test_wordings_that_the_grammar_does_not_know_are_read_and_said_back() -> None:
    reading = read_question(STRANGE)
    assert reading.program == parse_question(PLAIN)
    assert reading.note is not None
    assert re.fullmatch(
        f"“{STRANGE}” is a wording that the grammar does not know; the learned parser read it as “{re.escape(PLAIN)}” "
        r"\(probability (more than )?\d+ %\)\.",
        reading.note,
    )
    assert read_question(PLAIN).note is None


def test_choices_are_sought_where_their_question_seeks_them() -> None:
    text, plain = "the crash of the red cube with the blue ball", "the red cube collides with the blue sphere"
    for kind in QuestionType:
        reading = read_choice(text, kind)
        assert reading.program == parse_choice(plain, kind)
        assert reading.note is not None
    with pytest.raises(InputError, match="predictive questions are about collisions"):
        read_choice("the blue ball leaves the picture", QuestionType.PREDICTIVE)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("How heavy is the wooden cube?", "is not understood at 'wooden' (word 5)"),
        ("Why is the sky blue?", "is not understood at 'sky' (word 4)"),
        ("Is there a red red cube?", "is not understood at 'red' (word 5)"),
        ("Count before the the", "is not understood at 'count' (word 1)"),
        ("What will happen if the red cube is not removed?", "is not understood at 'not' (word 9)"),
        ("If the red cube is not removed, what will happen?", "is not understood at 'not' (word 6)"),
        ("What would not happen if the sphere was not removed?", "is not understood at 'not' (word 9)"),
        (
            "Would the ball hit the red cube if the red cube weren't removed?",
            "is not understood at 'weren't' (word 12)",
        ),
        ("Which of these is not not responsible for the first collision?", "is not understood at 'not' (word 5)"),
        ("What will happen if we did not take the red cube away?", "is not understood at 'not' (word 7)"),
        ("What would not be prevented if the red cube is removed?", "is not understood at 'not' (word 3)"),
        ("Without removing the red cube, what will happen?", "is not understood at 'without' (word 1)"),
        ("How many objects collide with each other?", "is not understood at 'each' (word 6)"),
        ("How many objects touch each other?", "is not understood at 'touch' (word 4)"),
        ("How many things bump into each other?", "is not understood at 'bump' (word 4)"),
        ("If the cube were times lighter, what would happen?", "is not understood at 'times' (word 5)"),
    ],
)
def test_refusals_name_a_word_that_neither_knows_or_where_the_grammar_stops(text: str, message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)):
        parse_question(text)


@pytest.mark.parametrize(
    ("text", "question", "agreement"),
    [
        ("count the red cubes", "How many red cubes are there?", True),
        ("count the red cubes", "How many cubes are there?", False),
        ("count the cubes", "How many red cubes are there?", False),
        ("red cubes and blue balls", "Do any red spheres collide with the blue cube?", False),
        ("initially count the moving cubes", "How many cubes are moving when the video begins?", True),
        ("finally count the moving cubes", "How many cubes are moving when the video begins?", False),
        ("in the first frame count the moving cubes", "How many cubes are moving when the video begins?", True),
        ("count the first cubes", "How many cubes are there?", False),
        ("what for the cube", "Which of the following is responsible for the cube enters the scene?", False),
        ("the color of the cube", "What is the shape of the cube?", False),
        ("what will we see next", "Which event will not happen next?", False),
        ("what is the color of cubes", "What is the color of the cube?", False),
        ("do the cube and the ball appear", "Does the cube collide with the sphere?", False),
        ("do the cube and the ball collide", "Does the cube collide with the sphere?", True),
        ("will the cube appear", "Does the cube enter the scene?", False),
        ("how many cubes and balls are there", "How many cubes are there?", False),
        ("what could happen if the cube is not there", "What will happen without the cube?", True),
        ("what could happen if the cube is there", "What will happen without the cube?", False),
        ("what could happen if the cube is not removed", "What will happen without the cube?", False),
        ("what could happen if the cube had not been removed", "What will happen without the cube?", False),
        ("what could happen without removing the cube", "What will happen without the cube?", False),
        ("what could not happen without the cube", "What will not happen without the cube?", True),
        ("what could not happen without the cube", "What will happen without the cube?", False),
        ("what could happen if the cube is not going to be removed", "What will not happen without the cube?", False),
        ("what will not take place without the cube", "What will not happen without the cube?", True),
        ("what will happen if we do not take away the cube", "What will not happen without the cube?", False),
        ("count the cubes not at rest at the end", "How many cubes are moving when the video ends?", True),
        ("how many times do objects collide", "How many collisions happen?", True),
        ("how many objects collide", "How many collisions happen?", False),
        ("how many objects collide many times", "How many collisions happen?", False),
        ("what could happen if the cube were five times heavier", "What if the cube were heavier?", True),
        ("what could happen if the cube were times heavier", "What if the cube were heavier?", False),
        ("what could happen if the cube were five heavier", "What if the cube were heavier?", False),
    ],
)
def test_a_reading_must_speak_of_what_the_text_speaks_of(text: str, question: str, agreement: bool) -> None:
    meaning = meaning_of(parse_question(question), "question")
    assert meaning is not None
    assert agrees(split(text), meaning) is agreement


def test_an_improbable_program_is_not_read() -> None:
    parser = learned_parser()
    reading = parser.read("question", split(STRANGE))
    assert reading is not None
    assert parser.read("question", split(STRANGE), threshold=reading.probability + 1e-6) is None
    torch.manual_seed(0)
    sizes = (len(parser.vocabulary.words), len(parser.vocabulary.tokens))
    assert LearnedParser(ParserNetwork(*sizes).eval(), parser.vocabulary).read("question", split(STRANGE)) is None


def test_reading_is_deterministic() -> None:
    parser = learned_parser()
    again = LearnedParser(*read_parser(WEIGHTS))
    assert parser.read("question", split(STRANGE)) == again.read("question", split(STRANGE))


def test_answers_say_how_they_were_read() -> None:
    facts = video(STORY, future=[[collision(150, "1", "2")]])
    answer = ask(facts, "Count all cubes that hit the sphere.")
    assert answer.answer == 1
    assert "read it as “How many cubes collide with the sphere?”" in answer.notes[0]
    choices = ["the ball bumps into the cylinder", "The sphere collides with the cylinder"]
    answer = ask(facts, "Predict what will happen next.", choices=choices)
    assert answer.answer == (0, 1)
    assert ["learned parser" in note for note in answer.notes] == [True, True]
    check_question("Count all cubes that hit the sphere.")


def test_the_report_finds_the_world_of_a_wording_that_was_learned() -> None:
    facts = video(STORY, changed={(Change.REMOVED, 1): [[]]})
    question = "What could happen without the ball?"
    answer = ask(facts, question, choices=["The red cube and the blue cube collide"])
    assert world_of(answer, facts.bodies) == "removed:1"


def test_the_grammar_alone_loads_no_network() -> None:
    code = (
        "import sys; from vrdp_prob.reasoning.language import parse_question; "
        f"parse_question({PLAIN!r}); print([name for name in sys.modules if 'language.learned' in name])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("content", [None, b"", b"PK\x03\x04 cut short", b"no archive"])
def test_weights_that_cannot_be_read_are_one_sentence(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "weights.npz"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=r"the weights of the learned parser cannot be read; [^.]*\."):
        read_parser(path)


def test_weights_of_another_network_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "weights.npz"
    network, vocabulary = read_parser(WEIGHTS)
    write_parser(path, ParserNetwork(len(vocabulary.words), len(vocabulary.tokens), hidden=8), vocabulary)
    with pytest.raises(InputError, match="cannot be read"):
        read_parser(path)
    write_parser(path, network, vocabulary)
    assert path.stat().st_size < 1_500_000
    assert read_parser(path)[1] == vocabulary


def test_training_is_reproducible() -> None:
    (first, words), (second, again) = (train(seed=5, pairs=100, steps=2) for _ in range(2))
    assert words == again
    for one, other in zip(first.parameters(), second.parameters(), strict=True):
        assert torch.equal(one, other)


@pytest.mark.parametrize("name", ["development", "held_out/order", "held_out/synonym", "held_out/paraphrase"])
def test_held_out_wordings_are_not_trained_on(name: str) -> None:
    chosen = wordings(name)
    for kind in ("question", "choice"):
        for production in chosen.productions(kind):
            variants = {text for template in chosen.of(kind, production) for text in chosen.variants(template)}
            assert all(is_held_out(kind, production, text) for text in variants if re.search(r"(^| )\w", text))


def test_training_sees_sense_and_nonsense() -> None:
    seen = list(examples(400, np.random.default_rng(0)))
    nonsense = sum(example.program is None for example in seen) / len(seen)
    assert 0.1 < nonsense < 0.3
    assert {example.kind for example in seen} == {"question", "choice"}


def test_the_shipped_weights_read_development_wordings_and_answer_no_nonsense() -> None:
    texts, templates = texts_of("development", 2, np.random.default_rng(7))
    sense = score(learned_parser(), "", texts, templates)
    assert sense.right > 0.5
    assert sense.wrong < 0.02
    assert sense.together >= sense.right
    texts, templates = nonsense_of("held_out/out_of_scope", 2, np.random.default_rng(7))
    nonsense = score(learned_parser(), "", texts, templates)
    assert nonsense.right == 0
    assert nonsense.together_wrong < 0.02

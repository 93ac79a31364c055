"""From questions to answers: probabilities, joint probabilities, entropy, errors, and unusable questions."""

import json
import math
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hand_made import BODIES, STORY, collision, video
from jsonschema import validate

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning import ask
from vrdp_prob.reasoning.answer import monte_carlo_error
from vrdp_prob.reasoning.changes import Change
from vrdp_prob.reasoning.entropy import entropy
from vrdp_prob.reasoning.facts import TableFacts
from vrdp_prob.scene import Body, Choice, Event, Question, QuestionType, Shape

CHOICES = ("The sphere collides with the cylinder", "The red cube and the cylinder collide")
SCHEMA = Path(__file__).parents[2] / "vrdp_prob" / "report" / "schemas" / "report.schema.json"


def ambiguous() -> TableFacts:
    both, one = [collision(150, "1", "2"), collision(160, "0", "2")], [collision(150, "1", "2")]
    return video(*[STORY] * 10, future=[both] * 5 + [one] * 3 + [[]] * 2, effective_draws=10.0)


def test_multiple_choice_gives_each_choice_and_the_joint_answer() -> None:
    answer = ask(ambiguous(), "What will happen next?", choices=CHOICES)
    assert answer.question_type is QuestionType.PREDICTIVE
    assert [choice.probability for choice in answer.choices] == pytest.approx([0.8, 0.5])
    assert answer.answer == (0, 1)
    assert answer.probability == pytest.approx(0.5)
    assert answer.distribution == pytest.approx({"0,1": 0.5, "0": 0.3, "": 0.2})
    assert answer.entropy == pytest.approx(-(0.5 * math.log(0.5) + 0.3 * math.log(0.3) + 0.2 * math.log(0.2)))
    assert answer.choices[0].choice == CHOICES[0]


def test_the_errors_are_those_of_the_effective_draws() -> None:
    answer = ask(ambiguous(), "What will happen next?", choices=CHOICES)
    assert answer.choices[1].mc_error == pytest.approx(math.sqrt(0.25 / 12))
    assert monte_carlo_error(0.5, 10_000) == pytest.approx(0.005, rel=1e-3)
    assert 0 < monte_carlo_error(0.0, 400) < 0.01
    assert monte_carlo_error(0.3, np.inf) == 0


def test_entropy_is_zero_without_doubt() -> None:
    assert entropy(np.array([0.0, 1.0])) == 0
    assert entropy(np.array([0.5, 0.5])) == pytest.approx(math.log(2))


def test_negation_turns_choices_round() -> None:
    answer = ask(ambiguous(), "What will not happen next?", choices=CHOICES)
    assert [choice.probability for choice in answer.choices] == pytest.approx([0.2, 0.5])


def test_a_question_of_a_file_is_answered_by_its_programs() -> None:
    stated = Question(
        text="unreadable",
        program=("unseen_events", "belong_to"),
        choices=(
            Choice(
                "a",
                "?",
                ("all_events", "objects", "sphere", "filter_shape", "unique", "filter_collision", "unique"),
            ),
        ),
        question_id=7,
    )
    facts = video(*[STORY] * 2, future=[[collision(150, "1", "2")], [collision(150, "1", "2")]])
    with pytest.raises(InputError, match="several events fit 'the collision of the sphere'"):
        ask(facts, stated)
    sphere, cylinder = (f"objects {shape} filter_shape unique filter_collision" for shape in ("sphere", "cylinder"))
    better = f"all_events {sphere} {cylinder} unique"
    answer = ask(facts, Question("?", stated.program, (Choice("a", "?", tuple(better.split())),), question_id=7))
    assert (answer.question_id, answer.answer) == (7, ("a",))


def test_what_if_answers_come_from_the_changed_world() -> None:
    facts = video(STORY, changed={(Change.HEAVIER, 0): [[collision(40, "1", "3")]]})
    question = "What if the red cube were heavier?"
    answer = ask(
        facts, question, choices=["The sphere and the blue cube collide", "The sphere and the cylinder collide"]
    )
    assert [choice.probability for choice in answer.choices] == [1.0, 0.0]
    assert answer.question_type is QuestionType.COUNTERFACTUAL


def two_cubes(*events: Event, future: Sequence[Event] = ()) -> TableFacts:
    """A cube that may be metal or rubber, and one that is nearly certain to be metal."""
    unsure = tuple(
        replace(BODIES[place], material="metal", attribute_probabilities={"material": {"metal": p, "rubber": 1 - p}})
        for place, p in ((0, 0.5), (3, 0.95))
    )
    bodies = (unsure[0], BODIES[1], BODIES[2], unsure[1])
    draws = 4000
    return video(*[events] * draws, future=[future] * draws, bodies=bodies, effective_draws=400.0)


def test_a_note_tells_apart_why_draws_are_left_out() -> None:
    answer = ask(two_cubes(*STORY), "What is the color of the rubber cube?")
    assert answer.valid_share == pytest.approx(0.5, abs=0.02)
    assert answer.to_document()["valid_share"] == answer.valid_share
    shares = re.findall(r"(\d+) %", answer.notes[0])
    assert re.sub(r"\d+ %", "N %", answer.notes[0]) == (
        "The material of the red cube is uncertain (N % rubber). "
        "The material of the blue cube is uncertain (N % rubber). "
        "In N % of the draws there is no rubber cube, in N % there are two rubber cubes; "
        "the answer is from the other N %."
    )
    assert [int(share) for share in shares] == pytest.approx([50, 5, 47.5, 2.5, 50], abs=2.1)


def test_a_note_counts_draws_once() -> None:
    # the second step fails wherever the blue cube is meant, and in all draws that have left the question already
    answer = ask(two_cubes(collision(30, "0", "1")), "What shape is the object that collides with the rubber cube?")
    shares = [int(share) for share in re.findall(r"(\d+) % (?:there|of the draws)", answer.notes[0])]
    assert "% there is no collision of the rubber cube in the video; the answer is from the other" in answer.notes[0]
    assert shares == pytest.approx([47.5, 2.5, 2.5], abs=2.1)


def test_a_note_names_the_choice_that_it_is_about() -> None:
    facts = two_cubes(future=[collision(150, "1", "2")])
    choices = ("The sphere collides with the cylinder", "The rubber cube and the cylinder collide")
    answer = ask(facts, "What will happen next?", choices=choices)
    assert len(answer.notes) == 1
    assert answer.valid_share == pytest.approx(0.5, abs=0.02)
    assert f"; “{choices[1]}” is judged from the other 5" in answer.notes[0]
    asked = "Which event will not happen without the rubber cube?"
    assert "; every choice is judged from the other 5" in ask(facts, asked, choices=choices).notes[0]


def test_documents_fit_the_schema() -> None:
    schema = json.loads(SCHEMA.read_text())["properties"]["answers"]
    facts = ambiguous()
    answers = [
        ask(facts, "What will happen next?", choices=CHOICES),
        ask(facts, "How many collisions happen?"),
        ask(facts, "Does the sphere enter the scene?"),
        ask(facts, "What is the color of the sphere?"),
    ]
    documents = [answer.to_document() for answer in answers]
    validate(documents, schema)
    assert json.loads(json.dumps(documents, allow_nan=False))[1]["answer"] == 3


@pytest.mark.parametrize(
    ("question", "choices", "message"),
    [
        ("", (), "the question is empty"),
        (
            "What shape is the purple object?",
            (),
            "there is no purple object in the video; its objects are: red metal cube",
        ),
        (
            "What is the color of the cube?",
            (),
            "two objects fit 'the cube' (red metal cube, blue rubber cube); say which",
        ),
        ("Where is the cube?", (), "is not understood at 'where' (word 1)"),
        ("What will happen next?", (), "needs choices to judge; give at least one (--choice TEXT)."),
        ("How many collisions happen?", ("the red cube",), "is answered without choices; leave them out."),
        ("What will happen next?", ("The sphere kicks the cube",), "is not understood at 'kicks' (word 3)"),
        ("What will happen next?", ("The pink cube and the sphere collide",), "at 'pink' (word 2)"),
        (
            "What will happen next?",
            ("The gray cube and the sphere collide",),
            "there is no gray cube in the video",
        ),
        (
            "How many collisions happen before the sphere and the cylinder collide?",
            (),
            "there is no collision of the sphere with the cylinder in the video.",
        ),
        ("What color is the object that exits the scene before the sphere enters the scene?", (), "there is no exit"),
    ],
)
def test_unusable_questions(question: str, choices: tuple[str, ...], message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)) as caught:
        ask(video(STORY), question, choices=choices)
    assert "\n" not in str(caught.value)


def test_a_choice_program_of_the_wrong_type_is_refused() -> None:
    with pytest.raises(InputError, match=re.escape("must end with one object or one event")):
        ask(video(STORY), ["unseen_events", "belong_to"], choices=[["objects", "count"]])


def test_an_attribute_that_nobody_stated_is_not_guessed() -> None:
    bare = (Body("p", Shape.CYLINDER, radius=0.1), Body("q", Shape.SPHERE, radius=0.1))
    facts = video((), bodies=bare)
    with pytest.raises(InputError, match="the color of the sphere is not stated"):
        ask(facts, "What color is the sphere?")
    with pytest.raises(InputError, match=re.escape("its objects are: cylinder p, sphere q")):
        ask(facts, "What shape is the red object?")

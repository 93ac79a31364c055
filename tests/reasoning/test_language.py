"""English to programs: CLEVRER's wordings, their variants, and refusals that name the word."""

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrdp_prob.datasets import read_questions
from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.language import parse_choice, parse_question
from vrdp_prob.reasoning.program import ENTRIES, check, needs_choices
from vrdp_prob.reasoning.values import Truth
from vrdp_prob.scene import QuestionType
from vrdp_prob.scene.body import COLORS, MATERIALS

A = "objects red filter_color unique"
B = "objects metal filter_material cube filter_shape unique"


@pytest.mark.parametrize(
    ("question", "program"),
    [
        ("How many metal objects are there?", "objects metal filter_material count"),
        ("how many METAL objects are there in the video", "objects metal filter_material count"),
        ("How many collisions happen in the video?", "events objects filter_collision count"),
        ("How many cubes are moving?", "objects cube filter_shape null filter_moving count"),
        ("How many moving cubes are there?", "objects cube filter_shape null filter_moving count"),
        (
            "How many objects collide with the red object?",
            f"events {A} filter_collision objects filter_collision count",
        ),
        ("Is there a red sphere?", "objects red filter_color sphere filter_shape exist"),
        ("Are there any grey metallic things?", "objects gray filter_color metal filter_material exist"),
        ("Is the red object moving when the video ends?", "objects red filter_color end get_frame filter_moving exist"),
        ("Does the red object enter the scene?", f"events {A} filter_in exist"),
        (
            "Does the red object collide with the metal cube before the red object exits the scene?",
            f"events {A} filter_collision {B} filter_collision events {A} filter_out unique filter_before exist",
        ),
        ("What is the shape of the red object?", f"{A} query_shape"),
        ("What is the red object made of?", f"{A} query_material"),
        ("What colour is the metal cube?", f"{B} query_color"),
        (
            "What shape is the blue object that collides with the metal cube?",
            f"events {B} filter_collision objects blue filter_color filter_collision unique {B} get_col_partner "
            "query_shape",
        ),
        (
            "What color is the first metal object to enter the scene?",
            "events objects metal filter_material filter_in first filter_order get_object query_color",
        ),
        (
            "How many cubes enter the scene after the first collision?",
            "events objects cube filter_shape filter_in events objects filter_collision first filter_order "
            "filter_after count",
        ),
        (
            "What is responsible for the red object's exit?",
            f"events events {A} filter_out unique filter_ancestor belong_to",
        ),
        ("What will happen next?", "unseen_events belong_to"),
        ("What happens next?", "unseen_events belong_to"),
        ("What would have happened without the red object?", f"all_events {A} get_counterfact belong_to"),
        ("What would not have happened without the red object?", f"all_events {A} get_counterfact belong_to negate"),
        ("What happens if the red object is removed?", f"all_events {A} get_counterfact belong_to"),
        ("What if the metal cube were 5 times heavier?", f"all_events {B} counterfact_heavier belong_to"),
        (
            "How many cubes hit the red object?",
            f"events {A} filter_collision objects cube filter_shape filter_collision count",
        ),
        ("Does the red object hit the metal cube?", f"events {A} filter_collision {B} filter_collision exist"),
        (
            "Will the red object hit the metal cube?",
            f"all_events {A} filter_collision {B} filter_collision unique unseen_events belong_to",
        ),
        ("Which event will not happen next?", "unseen_events belong_to negate"),
        ("What will happen without the red object?", f"all_events {A} get_counterfact belong_to"),
        ("What if the red object were removed?", f"all_events {A} get_counterfact belong_to"),
        ("What if the metal cube were heavier?", f"all_events {B} counterfact_heavier belong_to"),
        (
            "If the red object were five times lighter, which event would not happen?",
            f"all_events {A} counterfact_lighter belong_to negate",
        ),
        (
            "Will the red object collide with the metal cube?",
            f"all_events {A} filter_collision {B} filter_collision unique unseen_events belong_to",
        ),
        (
            "Would the red object and the metal cube collide without the red object?",
            f"all_events {A} filter_collision {B} filter_collision unique all_events {A} get_counterfact belong_to",
        ),
    ],
)
def test_questions(question: str, program: str) -> None:
    assert parse_question(question) == tuple(program.split())


@pytest.mark.parametrize(
    ("choice", "kind", "program"),
    [
        ("the presence of the red object", QuestionType.EXPLANATORY, A),
        ("the red object's entrance", QuestionType.EXPLANATORY, f"events {A} filter_in unique"),
        ("the red object's colliding with the metal cube", QuestionType.EXPLANATORY, "events"),
        ("The red object and the metal cube collide", QuestionType.PREDICTIVE, "all_events"),
        ("The red object hits the metal cube", QuestionType.PREDICTIVE, "all_events"),
        ("The red object collides with the metal cube.", QuestionType.COUNTERFACTUAL, "all_events"),
    ],
)
def test_choices(choice: str, kind: QuestionType, program: str) -> None:
    if program in ("events", "all_events"):
        program = f"{program} {A} filter_collision {B} filter_collision unique"
    assert parse_choice(choice, kind) == tuple(program.split())


@pytest.mark.parametrize(
    ("question", "message"),
    [
        ("", "the question is empty"),
        (" ?! ", "the question is empty"),
        ("How many pink objects are there?", "is not understood at 'pink' (word 3)"),
        ("How many cubes fly away?", "is not understood at 'fly' (word 4)"),
        ("What is the size of the cube?", "is not understood at 'size' (word 4)"),
        ("What is the shape of the red red cube?", "is not understood at 'red' (word 8)"),
        ("How many collisions happen before the cube?", "ends too early, after 'cube'"),
        ("Bonjour", "is not understood at 'bonjour' (word 1)"),
        ("Isn't the red cube moving?", "is not understood at 'isn't' (word 1)"),
        ("Can't the cube enter the scene?", "is not understood at 'can't' (word 1)"),
        ("What ain't red?", "is not understood at 'ain't' (word 2)"),
        ("Does the cube's exit fly?", "is not understood at 'fly' (word 5)"),
        ("What would happen if the cube were times heavier?", "is not understood at 'times' (word 8)"),
        ("What would happen if the cube were three times heavier?", "is not understood at 'three' (word 8)"),
    ],
)
def test_refusals_name_the_word(question: str, message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)):
        parse_question(question)


@pytest.mark.parametrize(
    ("contracted", "in_full"),
    [
        ("What's the color of the red cube?", "What is the color of the red cube?"),
        ("What color is the cube that\u2019s moving?", "What color is the cube that is moving?"),
        ("Which event won't happen next?", "Which event will not happen next?"),
        (
            "Which of these isn't responsible for the first collision?",
            "Which of these is not responsible for the first collision?",
        ),
        ("What wouldn't happen if the cube weren't there?", "What would not happen if the cube were not there?"),
        ("What is responsible for the red cube's exit?", "What is responsible for the red cube 's exit?"),
    ],
)
def test_contractions_are_read_in_full(contracted: str, in_full: str) -> None:
    assert parse_question(contracted) == parse_question(in_full)


def test_choices_that_cannot_be_judged_are_refused() -> None:
    with pytest.raises(InputError, match="predictive questions are about collisions"):
        parse_choice("the red cube exits the scene", QuestionType.PREDICTIVE)
    with pytest.raises(InputError, match="the choice is empty"):
        parse_choice("", QuestionType.PREDICTIVE)
    with pytest.raises(InputError, match=re.escape("at 'dances' (word 4)")):
        parse_choice("the red cube dances", QuestionType.EXPLANATORY)


NOUNS = ("object", "cube", "sphere", "cylinder")


@st.composite
def things(draw: st.DrawFn, *, plural: bool = False) -> tuple[str, str]:
    """A noun phrase and the tokens that pick its objects."""
    color = draw(st.sampled_from((None, *COLORS)))
    material = draw(st.sampled_from((None, *MATERIALS)))
    noun = draw(st.sampled_from(NOUNS))
    words = [word for word in (color, material) if word] + [f"{noun}s" if plural else noun]
    tokens = ["objects"]
    for word, token in ((color, "filter_color"), (material, "filter_material")):
        tokens += [word, token] if word else []
    tokens += [noun, "filter_shape"] if noun != "object" else []
    return " ".join(words), " ".join(tokens)


@st.composite
def occasions(draw: st.DrawFn) -> tuple[str, str]:
    """An event as a clause, and its tokens."""
    (name, own), (other_name, other) = draw(things()), draw(things())
    both = f"events {own} unique filter_collision {other} unique filter_collision unique"
    return draw(
        st.sampled_from(
            [
                (f"the {name} enters the scene", f"events {own} unique filter_in unique"),
                (f"the {name} exits the scene", f"events {own} unique filter_out unique"),
                (f"the {name} and the {other_name} collide", both),
                (f"the {name} collides with the {other_name}", both),
                (f"the collision between the {name} and the {other_name}", both),
            ]
        )
    )


@given(things(plural=True), occasions(), st.sampled_from(("before", "after")), st.sampled_from(("enter", "exit")))
def test_conditions_round_trip(thing: tuple[str, str], occasion: tuple[str, str], when: str, verb: str) -> None:
    (name, own), (clause, event) = thing, occasion
    kind = {"enter": "filter_in", "exit": "filter_out"}[verb]
    tokens = f"events {own} {kind} {event} filter_{when}"
    for question, end in (
        (f"How many {name} {verb} the scene {when} {clause}?", "count"),
        (f"Are there any {name} that {verb} the scene {when} {clause}?", "exist"),
        (f"Do any {name} {verb} the scene {when} {clause}?", "exist"),
    ):
        assert parse_question(question) == (*tokens.split(), end)


@given(things(), occasions(), st.sampled_from(("moving", "stationary")))
def test_descriptions_round_trip(thing: tuple[str, str], occasion: tuple[str, str], state: str) -> None:
    (name, own), (clause, event) = thing, occasion
    if clause.startswith("the collision"):
        clause = "the cube enters the scene"
        event = "events objects cube filter_shape unique filter_in unique"
    program = f"{own} {event} get_frame filter_{state} unique query_color".split()
    assert parse_question(f"What color is the {state} {name} when {clause}?") == tuple(program)
    assert parse_question(f"What is the color of the {name} that is {state} when {clause}?") == tuple(program)


@given(things(), things(), st.booleans(), st.sampled_from(("is removed", "were heavier", "were much lighter")))
def test_what_if_round_trips_and_type_checks(
    changed: tuple[str, str], other: tuple[str, str], negated: bool, how: str
) -> None:
    word = " not" if negated else ""
    verb = "will" if how == "is removed" else "would"
    program = parse_question(f"If the {changed[0]} {how}, what {verb}{word} happen?")
    assert program == parse_question(f"What {verb}{word} happen if the {changed[0]} {how}?")
    assert needs_choices(program)
    choice = parse_choice(f"The {changed[0]} and the {other[0]} collide", QuestionType.COUNTERFACTUAL)
    check(choice, ends_in=ENTRIES)
    check((*choice, *program), ends_in=(Truth,))


def test_every_wording_of_the_practice_set_gives_its_program(shared_data: Path) -> None:
    wrong = []
    for questions in read_questions(shared_data / "clevrer_bullet" / "questions.json").values():
        for question in questions:
            assert question.question_type is not None
            if parse_question(question.text) != question.program:
                wrong.append(question.text)
            wrong += [c.text for c in question.choices if parse_choice(c.text, question.question_type) != c.program]
    assert not wrong

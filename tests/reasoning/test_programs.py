"""The type checker of programs: what it refuses, and that it points at the token."""

import re

import pytest
from hand_made import STORY, video

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.executor import answer_question
from vrdp_prob.reasoning.program import check, needs_choices, question_type
from vrdp_prob.scene import QuestionType


@pytest.mark.parametrize(
    ("program", "message"),
    [
        ("", "the program is empty; give at least one token."),
        ("<END> objects count", "the program is empty; give at least one token."),
        ("objects filter_colour", "program token 2 'filter_colour' is unknown; did you mean 'filter_color'?"),
        ("objects xyzzy count", "program token 2 'xyzzy' is unknown; see docs/questions.md for the tokens."),
        ("count", "program token 1 'count' takes objects or events, but finds nothing."),
        (
            "events red filter_color count",
            "program token 3 'filter_color' takes objects, then a word, but finds events, then a word.",
        ),
        (
            "objects cube filter_color count",
            "program token 3 'filter_color' takes one of gray, red, blue, green, brown",
        ),
        ("objects first filter_shape count", "not 'first'"),
        (
            "objects objects count",
            "the program ends at token 3 'count' with objects left over; every value must be taken by an operation.",
        ),
        ("objects", "the program ends at token 1 'objects' with objects; it must end with yes or no or a number"),
        ("objects unique", "with one object; it must end with"),
        ("objects unique count", "program token 3 'count' takes objects or events, but finds one object."),
        ("events unique query_color", "program token 3 'query_color' takes one object, but finds one event."),
        ("objects events filter_in count", "program token 3 'filter_in' takes events, then objects or one object"),
        ("objects unique get_frame", "program token 3 'get_frame' takes one event, but finds one object."),
        ("events count negate", "program token 3 'negate' takes yes or no, but finds a number."),
        ("events red", "the program ends at token 2 'red' with events left over"),
        ("objects now filter_moving count", "program token 2 'now' is unknown"),
        ("objects red filter_moving count", "program token 3 'filter_moving' takes one of null, not 'red'."),
    ],
)
def test_refusals_point_at_the_token(program: str, message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)):
        check(program.split())


def test_padding_of_parsed_programs_is_dropped() -> None:
    assert check(["<START>", "objects", "count", "<NULL>", "count"]).tokens == ("objects", "count")
    assert check(["objects", "count", "<END>", "nonsense"]).tokens == ("objects", "count")


@pytest.mark.parametrize(
    ("program", "expected"),
    [
        ("events objects filter_collision count", False),
        ("unseen_events belong_to", True),
        ("all_events objects red filter_color unique get_counterfact belong_to negate", True),
        ("all_events objects red filter_color unique counterfact_heavier belong_to", True),
        ("events objects red filter_color unique filter_collision unique get_frame", False),
    ],
)
def test_programs_that_judge_choices_are_known(program: str, expected: bool) -> None:
    assert needs_choices(program.split()) is expected


@pytest.mark.parametrize(
    ("program", "expected"),
    [
        ("objects count", QuestionType.DESCRIPTIVE),
        ("unseen_events belong_to", QuestionType.PREDICTIVE),
        ("events events unique filter_ancestor belong_to", QuestionType.EXPLANATORY),
        ("all_events objects unique filter_counterfact belong_to", QuestionType.COUNTERFACTUAL),
        ("all_events objects unique counterfact_lighter belong_to", QuestionType.COUNTERFACTUAL),
    ],
)
def test_the_kind_is_read_off_the_program(program: str, expected: QuestionType) -> None:
    assert question_type(program.split()) is expected


def test_a_question_program_may_be_given_as_tokens() -> None:
    assert answer_question(video(STORY), ["objects", "count"]).answer == 4

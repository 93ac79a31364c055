"""Names, numbers and sentences."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrdp_prob.inference.draws.summaries import ParameterSummary, Summary
from vrdp_prob.plain_words import counted, listed, percent, percent_error
from vrdp_prob.reasoning.answer import monte_carlo_error
from vrdp_prob.report.wording import interval_words, mass_status, names, restitution_status, tags, with_names
from vrdp_prob.scene import Body, Shape


def body(identity, color=None, material=None, shape=Shape.SPHERE, **more):
    return Body(identity, shape, 0.2, color=color, material=material, **more)


@pytest.mark.parametrize(
    ("bodies", "expected"),
    [
        ((body("0", "red"), body("1", "blue")), ["red sphere", "blue sphere"]),
        ((body("0", "red", "metal"), body("1", "red", "rubber")), ["metal sphere", "rubber sphere"]),
        (
            (body("0", "red", "metal"), body("1", "red", "rubber"), body("2", "blue", "metal")),
            ["red metal sphere", "rubber sphere", "blue sphere"],
        ),
        ((body("7"), body("8")), ["sphere 7", "sphere 8"]),
        ((body("left", shape=Shape.CYLINDER), body("right", shape=Shape.CYLINDER)), ["“left”", "“right”"]),
    ],
)
def test_names_fit_one_body_alone(bodies, expected):
    assert list(names(bodies).values()) == expected


@given(
    st.lists(
        st.tuples(st.sampled_from([None, "red", "blue"]), st.sampled_from([None, "metal"]), st.sampled_from(Shape)),
        min_size=1,
        max_size=8,
    )
)
def test_names_are_unique(kinds):
    bodies = [body(str(index), *kind[:2], shape=kind[2]) for index, kind in enumerate(kinds)]
    assert len(set(names(bodies).values())) == len(bodies)


def test_long_ids_become_letters():
    assert list(tags([body("a puck"), body("another")]).values()) == ["A", "B"]


@given(st.floats(0, 1))
def test_percent_is_certain_only_where_the_probability_is(probability):
    assert (percent(probability) in ("0 %", "100 %")) == (probability in (0, 1))
    assert percent(probability, 0.01) not in ("0 %", "100 %")


def test_few_draws_are_not_nearly_certain():
    assert [percent(1.0, monte_carlo_error(1.0, draws)) for draws in (3, 30, 400, 4000)] == [
        "> 55 %",
        "> 93 %",
        "> 99 %",
        "> 99 %",
    ]
    assert percent(0.0, monte_carlo_error(0.0, 30)) == "< 7 %"


def test_percent_errors():
    assert [percent_error(0.8, error) for error in (0.0, 0.004, 0.02)] == ["", "± 0.4", "± 2"]
    assert percent_error(1.0, 0.01) == percent_error(0.0, 0.01) == ""


@pytest.mark.parametrize(
    ("interval", "words"),
    [
        (Summary(1.0234, 0.1, 0.8765, 1.1912), ("1.02", "0.88 to 1.19")),
        (Summary(3.2, 2.0, 0.4, 9.87), ("3.2", "0.4 to 9.9")),
        (Summary(0.031, 0.0004, 0.0302, 0.0318), ("0.0310", "0.0302 to 0.0318")),
        (Summary(0.0052, 0.0001, 0.0050, 0.0054), ("0.0052", "0.0050 to 0.0054")),
        (Summary(0.0146, 0.0, 0.0146, 0.0146), ("0.0146", "held fixed")),
        (Summary(1.0, 0.0, 1.0, 1.0), ("1.00", "held fixed")),
    ],
)
def test_numbers_are_rounded_to_what_the_interval_supports(interval, words):
    assert interval_words(interval) == words


def test_lists_and_counts():
    assert [listed(["a"]), listed(["a", "b"]), listed(["a", "b", "c"])] == ["a", "a and b", "a, b and c"]
    assert [counted(0, "object"), counted(1, "object"), counted(14, "object")] == [
        "no objects",
        "one object",
        "14 objects",
    ]


def test_sentences_name_objects():
    bodies = (body("0", "gray"), body("3", "cyan"), body("4", "red"), body("13", "blue"), body("left puck"))
    assert with_names("Objects 3, 4 never collide.", bodies) == "The cyan sphere and the red sphere never collide."
    assert with_names("Object 13 stops at 3 s.", bodies) == "The blue sphere stops at 3 s."
    assert (
        with_names("as if objects 4 and left puck met", bodies) == "as if the red sphere and the sphere “left puck” met"
    )
    assert with_names("most for object 4, 0.014 m", bodies) == "most for the red sphere, 0.014 m"
    assert with_names("The objects 5 and 134 are others.", bodies) == "The objects 5 and 134 are others."


def test_status_in_words():
    name = {"1": "cyan cube", "2": "red sphere"}
    some = Summary(1.0, 0.1, 0.9, 1.1)
    ratio = ParameterSummary(some, "ratio_only", ("1",))
    assert mass_status(ratio, body("0"), name) == "Only its ratio to the cyan cube is known, not the mass itself."
    product = ParameterSummary(some, "product_only", ("1", "2"))
    assert "product with that of the cyan cube and the red sphere" in restitution_status(product, name)
    default, drawn = ParameterSummary(Summary(1.0, 0.0, 1.0, 1.0), "default"), ParameterSummary(some, "default")
    assert mass_status(default, body("0"), name) == restitution_status(default, name)
    assert restitution_status(default, name).startswith("A default value: no collision tells it")
    assert mass_status(drawn, body("0"), name).startswith("Drawn from the prior: no collision tells it")
    assert mass_status(default, body("0", mass=0.03), name) == "Weighed: given with the input."

"""Numbers as a reader sees them."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.discovery.findings import TILT, VIDEOS, named
from vrdp_prob.discovery.finding import Estimate, UpperBound
from vrdp_prob.discovery.page.gain_figure import HIGHEST, video_figure
from vrdp_prob.discovery.page.summary import summary
from vrdp_prob.discovery.page.wording import (
    MINUS,
    TIMES,
    UNDEFINED,
    bound_words,
    chance,
    estimate_words,
    length_unit,
    number,
    p_words,
    parameter_words,
    signed,
    typeset,
    with_unit,
)
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt


@pytest.mark.parametrize(
    ("value", "precision", "words"),
    [
        (0.0021723, 0.00015, "0.00217"),
        (-0.0021723, 0.00015, f"{MINUS}0.00217"),
        (231.4, 33.1, "231"),
        (2314.0, 330.0, "2314"),
        (0.0, 0.2, "0.00"),
        (-0.0001, 0.2, "0.00"),
        (0.0, None, "0"),
        (0.0, 0.0, "0"),
        (12.34, None, "12"),
        (9.99, None, "10.0"),
        (3.14e-7, 2e-8, f"3.14{TIMES}10⁻⁷"),
        (3.14e7, None, f"3.1{TIMES}10⁷"),
        (math.nan, 1.0, UNDEFINED),
        (math.inf, None, "∞"),
        (-math.inf, None, f"{MINUS}∞"),
        (12.3, math.nan, "12"),
    ],
)
def test_numbers_have_the_digits_that_mean_something(value: float, precision: float | None, words: str) -> None:
    assert number(value, precision) == words


@given(st.floats(-1e9, 1e9).filter(lambda value: abs(value) > 1e-12), st.floats(0.001, 1.0))
def test_a_number_read_back_is_within_its_precision(value: float, share: float) -> None:
    digits, _, power = number(value, abs(value) * share).replace(MINUS, "-").partition(TIMES)
    exponent = power.removeprefix("10").translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")) or "0"
    assert float(f"{digits}e{exponent}") == pytest.approx(value, abs=0.1 * abs(value) * share)


def test_an_interval_stands_in_one_power_of_ten() -> None:
    mean, interval = estimate_words(Estimate(5e-5, 2e-5, 1e-5, 9e-5, "m/s^2"))
    assert mean == f"5.0{TIMES}10⁻⁵ m/s²"
    assert interval == f"1.0{TIMES}10⁻⁵ to 9.0{TIMES}10⁻⁵"
    assert estimate_words(Estimate(1e-4, 4e-5, 2e-5, 1.8e-4, "1")) == ("0.000100", "0.000020 to 0.000180")


def test_differences_have_their_sign() -> None:
    assert (signed(3.2), signed(-3.2), signed(0.0)) == ("+3.2", f"{MINUS}3.2", "0")


def test_bounds_and_units() -> None:
    assert bound_words(UpperBound("bowl", "bowl_stiffness", 0.004600, "1/s^2")) == "≤ 0.0046 1/s²"
    assert bound_words(UpperBound("bowl", "bowl_stiffness", 120.0, "1")) == "≤ 120"
    assert bound_words(UpperBound("bowl", "bowl_stiffness", 8.2e-7, "m")) == f"≤ 8.2{TIMES}10⁻⁷ m"
    assert bound_words(UpperBound("bowl", "bowl_stiffness", 0.0, "m")) == "≤ 0 m"
    assert bound_words(UpperBound("bowl", "bowl_stiffness", None, "m")) == "no bound"
    assert bound_words(UpperBound("material_friction", "ratio", 0.04, "1", 1.0)) == "within 0.04 of 1"
    slip = UpperBound("slip_to_roll", "slip_friction", 3e-4, "1", "rolling_resistance")
    assert bound_words(slip) == "within 0.0003 of the rolling resistance"
    slipping = replace(slip, remark="or so large that spheres roll at once")
    assert bound_words(slipping) == "within 0.0003 of the rolling resistance, or so large that spheres roll at once"
    assert with_unit("3", "1") == "3"
    wall = UpperBound("wall", "hidden_wall_distance", 0.0, "m", measure="depth of a wall")
    assert bound_words(wall) == "no room for any"
    assert bound_words(replace(wall, bound=0.2)) == "≤ 0.2 m"


def test_p_values_and_probabilities() -> None:
    assert [p_words(p) for p in (0.27, 0.0107, 0.001, 1.0)] == ["0.27", "0.011", "0.001", "1"]
    assert [p_words(p) for p in (9.7e-4, 3.1e-38)] == [f"1{TIMES}10⁻³", f"3{TIMES}10⁻³⁸"]
    assert [p_words(p) for p in (7e-306, 0.0)] == ["< 10⁻⁹⁹"] * 2
    assert {p_words(p) for p in (math.nan, -0.1, 1.1)} == {UNDEFINED}
    assert [chance(p) for p in (0.0, 0.314, 1.0)] == ["< 1 %", "31 %", "> 99 %"]


def test_lengths_stand_in_the_unit_that_suits_them() -> None:
    assert [length_unit([size])[1] for size in (2.0, 0.02, 0.00002, 0.0)] == ["m", "mm", "µm", "m"]
    assert length_unit([math.inf, 0.02]) == (1e3, "mm")


@pytest.mark.parametrize(
    ("plain", "seen"),
    [
        ("by 0.19 m/s^2 towards -37 degrees", f"by 0.19 m/s² towards {MINUS}37 degrees"),
        ("tilt_y = -0.0119 ± 9.4e-05;", f"tilt_y = {MINUS}0.0119 ± 9.4{TIMES}10⁻⁵;"),
        ("of run-1, 3-5, run-2e-05 and case1e-05x", "of run-1, 3-5, run-2e-05 and case1e-05x"),
    ],
)
def test_a_sentence_is_typeset(plain: str, seen: str) -> None:
    assert typeset(plain) == seen


def test_parameters_are_described() -> None:
    assert parameter_words("tilt_x", SurfaceTilt()) == "sine of the table's slope, component in which x falls"
    assert parameter_words("own_thing[red]", None) == "own thing (red)"


def test_a_hundred_equal_gains_fit_into_the_figure() -> None:
    gain = TILT.gain
    equal = type(gain)(gain.before, gain.after, gain.noise, 100.0, 0.0, {str(video): 1.0 for video in range(100)})
    figure = video_figure(equal)
    assert not figure.in_rows
    assert len({dot.y for dot in figure.dots}) == 100
    assert max(dot.y for dot in figure.dots) <= HIGHEST


def test_a_video_that_carries_a_gain_is_named() -> None:
    assert not any("alone" in line for line in summary(named()))
    by_video = {VIDEOS[0]: 220.0, **dict.fromkeys(VIDEOS[1:], 1.0)}
    carried = replace(TILT, gain=replace(TILT.gain, by_video=by_video, elpd_difference=231.0))
    told = summary(replace(named(), causes=(carried,)))
    assert "The gain of surface tilt comes from run_00 alone and may be something of that video." in told


def test_an_error_that_stays_is_said_to_stay() -> None:
    before = TILT.gain.before
    same = replace(TILT, gain=replace(TILT.gain, after=before))
    told = summary(replace(named(), causes=(TILT, same), gain=None))[0]
    assert "surface tilt takes the error of predicted positions from" in told
    assert "and surface tilt leaves it at" in told

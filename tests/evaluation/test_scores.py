"""Scores against sums done by hand, and against forecasts whose calibration is known."""

import math

import numpy as np
import pytest

from vrdp_prob.evaluation.judgement import Judgement, Kind
from vrdp_prob.evaluation.scores import Scores, brier_gain, calibration_error


def choices_of(
    *choices: tuple[float, bool], scene: str = "a", right: bool = True, confidence: float = 0.9
) -> Judgement:
    return Judgement(
        scene, "0", Kind.PREDICTIVE, "What happens next?", "0", "0", right, confidence, 0.5, 0.25, tuple(choices)
    )


def open_answer(confidence: float, right: bool, *, scene: str = "a", squared_error: float = 0.0) -> Judgement:
    probability = confidence if right else 1 - confidence
    return Judgement(scene, "0", Kind.DESCRIPTIVE, "How many?", "1", "1", right, confidence, probability, squared_error)


def test_options_by_hand() -> None:
    scores = Scores.of([choices_of((0.9, True), (0.2, False)), choices_of((0.6, False), right=False)])
    assert (scores.questions, scores.options) == (2, 3)
    assert scores.accuracy_per_question == 0.5
    assert scores.accuracy_per_option == pytest.approx(2 / 3)
    assert scores.brier == pytest.approx((0.01 + 0.04 + 0.36) / 3)
    assert scores.log_score == pytest.approx((math.log(0.9) + math.log(0.8) + math.log(0.4)) / 3)
    assert scores.ece == pytest.approx((0.1 + 0.2 + 0.6) / 3)


def test_open_answers_by_hand() -> None:
    scores = Scores.of([open_answer(0.75, True, squared_error=0.0625), open_answer(0.7, False, squared_error=0.49)])
    assert scores.accuracy_per_option is None
    assert scores.accuracy_per_question == 0.5
    assert scores.brier == pytest.approx((0.0625 + 0.49) / 2)
    assert scores.ece == pytest.approx(abs(0.75 - 1 + 0.7) / 2)
    assert scores.refused == 0


def test_a_refused_question_is_wrong_in_every_option() -> None:
    refused = Judgement(
        "a",
        "0",
        Kind.PREDICTIVE,
        "?",
        "",
        "",
        False,
        0.0,
        0.0,
        1.0,
        ((0.5, False), (0.5, True)),
        refused="no such cube",
    )
    scores = Scores.of([refused])
    assert (scores.accuracy_per_option, scores.accuracy_per_question, scores.refused) == (0.0, 0.0, 1)


def test_nothing_asked_has_no_scores() -> None:
    scores = Scores.of([])
    assert scores.questions == 0
    assert scores.brier is None
    assert scores.reliability == ()


def test_calibrated_forecasts_stay_within_the_bound() -> None:
    """The bound is exceeded in 5 % of all cases: of 300 in more than 28 or fewer than 4 with a probability of 0.002."""
    generator, beyond = np.random.default_rng(0), 0
    for number in range(300):
        forecast = generator.beta(0.5, 0.5, 100)
        outcome = generator.random(100) < forecast
        judgements = [choices_of((float(p), bool(right))) for p, right in zip(forecast, outcome, strict=True)]
        scores = Scores.of(judgements, seed=number)
        assert scores.ece is not None
        assert scores.ece_if_calibrated_q95 is not None
        beyond += scores.ece > scores.ece_if_calibrated_q95
    assert 4 <= beyond <= 28


def test_overconfident_forecasts_are_beyond_the_bound() -> None:
    generator = np.random.default_rng(0)
    truth = generator.beta(2, 2, 300)
    judgements = [choices_of((float(p > 0.5), bool(generator.random() < p))) for p in truth]
    scores = Scores.of(judgements)
    assert scores.ece is not None
    assert scores.ece_if_calibrated_q95 is not None
    assert scores.ece > scores.ece_if_calibrated_q95 + 0.2
    assert any(not one.low <= one.observed <= one.high for one in scores.reliability)


def test_the_calibration_error_does_not_add_up_over_bins_of_opposite_sign() -> None:
    forecast = np.array([0.05, 0.95])
    assert calibration_error(forecast, np.array([True, False])) == pytest.approx(0.95)
    assert calibration_error(forecast, np.array([False, True])) == pytest.approx(0.05)


def test_the_surest_answers_come_first_and_equally_sure_ones_count_alike() -> None:
    sure = [open_answer(0.9, True) for _ in range(5)]
    unsure = [open_answer(0.6, right) for right in (False, False, True, False, True)]
    curve = Scores.of([*unsure, *sure]).abstention
    assert curve[:5] == (1.0,) * 5
    assert curve[-1] == pytest.approx(0.7)
    assert curve[5] == pytest.approx((5 + 0.4) / 6)
    alike = Scores.of([open_answer(1.0, right) for right in (True, True, True, True, True, False)]).abstention
    assert alike == pytest.approx([5 / 6] * 10)


def test_the_bootstrap_draws_scenes_not_questions() -> None:
    """Ten questions of each of two scenes: all right in one, all wrong in the other."""
    judgements = [open_answer(0.9, scene == "a", scene=scene) for scene in "ab" for _ in range(10)]
    interval = Scores.of(judgements).intervals["accuracy_per_question"]
    assert (interval.low, interval.high) == (0.0, 1.0)
    many = [open_answer(0.9, number % 2 == 0, scene=str(number)) for number in range(400)]
    narrow = Scores.of(many).intervals["accuracy_per_question"]
    assert narrow.high - narrow.low == pytest.approx(2 * 1.96 * 0.5 / 20, rel=0.15)


def test_one_scene_gives_no_interval() -> None:
    alone = [open_answer(0.9, number % 2 == 0) for number in range(10)]
    assert Scores.of(alone).intervals == {}
    gain, interval = brier_gain(alone, alone)
    assert (gain, interval) == (0.0, None)
    # options of one scene alone, whatever else was asked about the other
    scores = Scores.of([choices_of((0.9, True), scene="a"), open_answer(0.9, True, scene="b")])
    assert set(scores.intervals) == {"accuracy_per_question", "brier"}


def test_the_gain_is_the_difference_of_brier_scores() -> None:
    generator = np.random.default_rng(1)
    ours, other = [], []
    for scene in range(60):
        right = bool(generator.random() < 0.8)
        ours.append(choices_of((0.8, right), scene=str(scene)))
        other.append(choices_of((1.0, right), scene=str(scene)))
    gain, interval = brier_gain(ours, other)
    brier = [Scores.of(judgements).brier for judgements in (ours, other)]
    assert brier[0] is not None
    assert brier[1] is not None
    assert gain == pytest.approx(brier[1] - brier[0])
    assert interval is not None
    assert interval.low < gain < interval.high

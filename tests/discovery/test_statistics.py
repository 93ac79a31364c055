"""The statistics beneath the checks keep their error rates."""

import numpy as np
import pytest
from scipy.stats import chi2, kstest

from vrdp_prob.discovery.checks.false_discovery import controlled, significant
from vrdp_prob.discovery.checks.replications import sum_p_value, two_sided_p_value
from vrdp_prob.discovery.checks.scatter_regression import dependence
from vrdp_prob.discovery.finding import Check
from vrdp_prob.discovery.residuals.linear import Score
from vrdp_prob.discovery.residuals.look_elsewhere import anywhere, independent_places
from vrdp_prob.discovery.words import direction_words, number


def test_benjamini_and_hochberg_by_hand() -> None:
    # The example of their paper (section 3.2): four of fifteen are rejected at 5 %.
    p_values = [1e-4, 4e-4, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344, 0.0459, 0.324, 0.4262, 0.5719, 0.6528]
    found = significant(np.array([*p_values, 0.759, 1.0]))
    assert found.tolist() == [True] * 4 + [False] * 11


def test_without_anything_significant_nothing_is() -> None:
    assert not significant(np.array([0.06, 0.2, 0.9])).any()
    assert significant(np.zeros(0)).shape == (0,)


def test_checks_come_in_the_order_of_their_p_values() -> None:
    checks = [Check(str(p), 0.0, p, False, "") for p in (0.5, 1e-5, 0.04)]
    found = controlled(checks)
    assert [(check.name, check.significant) for check in found] == [("1e-05", True), ("0.04", False), ("0.5", False)]


def test_a_check_that_saw_nothing_does_not_count_because_others_do() -> None:
    found = controlled([Check(str(p), 0.0, p, False, "") for p in (*[1e-9] * 9, 0.02)])
    assert [check.significant for check in found] == [True] * 9 + [False]


def test_a_scan_of_independent_places_has_as_many() -> None:
    generator = np.random.default_rng(0)
    largest = generator.chisquare(2, (2000, 40)).max(axis=1)
    assert independent_places(largest, 2, 1000) == pytest.approx(40, rel=0.3)
    assert independent_places(largest, 2, 10) == 10


def test_the_best_of_many_places_is_judged_as_such() -> None:
    generator = np.random.default_rng(6)
    found = [anywhere(float(generator.uniform(size=30).min()), 30) for _ in range(300)]
    assert kstest(found, "uniform").pvalue > 0.01
    assert anywhere(1e-20, 30) == pytest.approx(3e-19)
    assert anywhere(1.0, 30) == pytest.approx(1.0)


def test_p_values_of_sums_and_numbers_are_uniform() -> None:
    generator = np.random.default_rng(1)
    sums = [sum_p_value(3 * generator.chisquare(7), 3 * generator.chisquare(7, 300)) for _ in range(400)]
    numbers = [two_sided_p_value(generator.normal(2, 5), generator.normal(2, 5, 300)) for _ in range(400)]
    assert kstest(sums, "uniform").pvalue > 0.01
    assert kstest(numbers, "uniform").pvalue > 0.01


def test_strong_effects_get_small_p_values() -> None:
    replicas = np.random.default_rng(2).chisquare(7, 300)
    assert sum_p_value(100.0, replicas) < 1e-10
    assert two_sided_p_value(60.0, np.random.default_rng(3).normal(size=300)) < 1e-100


def regression(generator: np.random.Generator, slope: float = 0.0, bodies: int = 20) -> float:
    """P-value of a dependence of products of bodies' factors on something, as pairs of them meet."""
    pairs = np.array([generator.choice(bodies, 2, replace=False) for _ in range(16)])
    owners = np.zeros((len(pairs), bodies))
    owners[np.arange(len(pairs))[:, None], pairs] = 1.0
    asked = generator.normal(size=(len(pairs), 1))
    sd = generator.uniform(0.01, 0.05, len(pairs))
    values = owners @ generator.normal(-0.1, 0.05, bodies) + sd * generator.normal(size=len(pairs))
    found = dependence(values + slope * asked[:, 0], np.diag(sd**2), owners, np.ones((len(pairs), 1)), asked)
    assert found is not None
    return found.p_value


def test_a_dependence_is_found_where_there_is_one_and_as_rarely_as_stated_where_there_is_none() -> None:
    generator = np.random.default_rng(4)
    null = np.array([regression(generator) for _ in range(400)])
    assert 0.02 < (null < 0.05).mean() < 0.09
    assert np.mean([regression(generator, 0.2) < 1e-3 for _ in range(50)]) > 0.9


def ring_regression(generator: np.random.Generator, slope: float = 0.0) -> float | None:
    """The same of fitted factors of single bodies, which met along four trees and round a ring of four."""
    trees = [(5 * k + i, 5 * k + j) for k in range(4) for i, j in ((0, 1), (1, 2), (1, 3), (3, 4))]
    pairs = np.array([*trees, (20, 21), (21, 22), (22, 23), (23, 20)])
    owners = np.zeros((len(pairs), 24))
    owners[np.arange(len(pairs))[:, None], pairs] = 1.0
    asked, sd = generator.normal(size=(len(pairs), 1)), 0.03
    measured = owners @ generator.normal(-0.1, 0.05, 24) + slope * asked[:, 0] + sd * generator.normal(size=len(pairs))
    inverse = np.linalg.pinv(owners)
    fitted = owners @ (inverse @ measured)
    covariance = owners @ (sd**2 * inverse @ inverse.T) @ owners.T
    found = dependence(fitted, covariance, owners, np.ones((len(pairs), 1)), asked)
    return None if found is None else found.p_value


def test_numbers_that_follow_from_one_another_count_once() -> None:
    generator = np.random.default_rng(5)
    null = [ring_regression(generator) for _ in range(400)]
    assert 0.02 < np.mean([p is not None and p < 0.05 for p in null]) < 0.09
    assert np.mean([(ring_regression(generator, 0.2) or 1.0) < 1e-3 for _ in range(50)]) > 0.9


def test_a_dependence_on_what_does_not_differ_is_none() -> None:
    values, ones = np.arange(5.0), np.ones((5, 1))
    assert dependence(values, np.eye(5), np.eye(5), ones, ones) is None


def test_a_score_beside_others_is_that_of_the_part_they_leave() -> None:
    generator = np.random.default_rng(5)
    design, noise = generator.normal(size=(50, 4)), generator.normal(size=50)
    score = Score(design.T @ noise, design.T @ design)
    known, asked = design[:, :2], design[:, 2:]
    left = asked - known @ np.linalg.lstsq(known, asked, rcond=None)[0]
    fitted = np.linalg.lstsq(left, noise, rcond=None)[0]
    part = score.of([2, 3], [0, 1])
    np.testing.assert_allclose(part.estimate, fitted)
    np.testing.assert_allclose(part.sd, np.sqrt(np.diag(np.linalg.inv(left.T @ left))))
    assert part.p_value == pytest.approx(chi2.sf(((left @ fitted) ** 2).sum(), 2))


def test_a_score_tells_nothing_of_what_it_has_no_information_about() -> None:
    part = Score(np.array([3.0, 0.0]), np.diag([1.0, 0.0]))
    assert part.degrees == 1
    assert part.estimate.tolist() == [3.0, 0.0]
    assert Score(np.zeros(2), np.zeros((2, 2))).p_value == 1.0


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.01234, "0.012"), (123.4, "123"), (2.45, "2.5"), (0.0, "0"), (3.2e-6, "3.2e-06"), (-0.5, "-0.50")],
)
def test_numbers_have_two_figures(value: float, text: str) -> None:
    assert number(value) == text


def test_directions_near_an_axis_are_called_by_it() -> None:
    assert [direction_words(x, y) for x, y in ((1, 0.1), (0, -2), (-1, -0.01))] == ["+x", "-y", "-x"]
    assert direction_words(1, 1) == "45 degrees (counter-clockwise from +x)"

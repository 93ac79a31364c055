import numpy as np
import pytest
from scipy.stats import norm

from vrdp_prob.inference.samplers.importance import effective_count, flattened, resampled, smoothed_weights


def test_importance_weights_tell_a_good_proposal_from_a_bad_one() -> None:
    draws = np.random.default_rng(0).standard_normal(4000)
    weights, k_hat = smoothed_weights(norm.logpdf(draws, 0.1, 0.9) - norm.logpdf(draws))
    assert k_hat < 0.5
    assert float((weights * draws).sum()) == pytest.approx(0.1, abs=0.05)
    _, k_hat = smoothed_weights(norm.logpdf(draws, 0, 3) - norm.logpdf(draws))
    assert k_hat > 0.7


def test_weights_that_hardly_differ_have_no_tail() -> None:
    generator = np.random.default_rng(0)
    two_heaps = np.where(generator.random(4000) < 0.03, 0.012, 0.0) + 1e-5 * generator.random(4000)
    _, k_hat = smoothed_weights(two_heaps)
    assert k_hat <= 0


def test_importance_weights_survive_worlds_without_support() -> None:
    weights, _ = smoothed_weights(np.array([-np.inf, -np.inf, 0.0]))
    assert weights.tolist() == [0, 0, 1]


def test_flattened_weights_leave_the_wished_number_of_draws() -> None:
    log_ratio = np.random.default_rng(0).normal(scale=5, size=1000)
    assert effective_count(flattened(log_ratio, 1.0)) < 20
    assert effective_count(flattened(log_ratio, 300.0)) == pytest.approx(300, rel=1e-3)


def test_resampling_takes_each_draw_as_often_as_it_weighs() -> None:
    weights = np.array([0.5, 0.25, 0.25, 0.0])
    chosen = resampled(weights, 1000, np.random.default_rng(0))
    assert np.bincount(chosen, minlength=4) == pytest.approx(1000 * weights, abs=1)

"""Residuals of several videos as a linear function of what is unknown."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import log_ndtr
from scipy.stats import chi2

from vrdp_prob.discovery.residuals.linear import LinearFit, LinearVideo, Score


def _video(seed: int) -> LinearVideo:
    generator = np.random.default_rng(seed)
    own, shared = generator.standard_normal((40, 3)), generator.standard_normal((40, 2))
    return LinearVideo(f"v{seed}", generator.standard_normal(40), own, shared, 35)


def _fit(*videos: LinearVideo) -> LinearFit:
    return LinearFit(videos, np.zeros(2), 1e-6 * np.eye(2))


def _pulling(at_edge: bool) -> LinearVideo:
    """A video whose derivatives promise much, by its own unknowns and by those that all share."""
    video = _video(3)
    residuals = video.residuals + video.own @ np.full(3, 8.0) + video.shared @ np.full(2, 30.0)
    return replace(video, residuals=residuals, at_edge=at_edge)


def test_a_video_at_an_edge_pulls_no_other_one() -> None:
    first, second = _video(1), _video(2)
    alone, pulled, spared = (
        _fit(first, second),
        _fit(first, second, _pulling(at_edge=False)),
        _fit(first, second, _pulling(at_edge=True)),
    )

    def squares(fit: LinearFit) -> float:
        return float(sum((left**2).sum() for left in fit.left[:2]))

    assert squares(pulled) > 2 * squares(alone)
    assert squares(spared) == pytest.approx(squares(alone), rel=0.1)


@pytest.mark.parametrize("off", [0.0, 1e-3])
def test_what_a_video_at_an_edge_promises_is_no_score_of_what_acts_as_shared_unknowns_do(off: float) -> None:
    """What is left of such a direction is next to nothing, and the slope was that of a shared unknown."""
    generator = np.random.default_rng(5)
    videos, directions = [], []
    for video in (_video(1), _video(2), _pulling(at_edge=True)):
        shared = video.shared.copy()
        shared[video.data :] = 0.0
        videos.append(replace(video, shared=shared))
        directions.append(shared[: video.data, :1] + off * generator.standard_normal((video.data, 1)))
    score = _fit(*videos).score(directions)
    assert score.chi_square < chi2.isf(1e-4, 1)


def test_what_a_video_at_an_edge_promises_is_seen_and_does_not_count() -> None:
    video = _pulling(at_edge=True)
    assert video.promised > 100
    assert not video.slope(video.left[:, None]).any()


def test_slopes_of_all_videos_and_the_prior_balance() -> None:
    fit = replace(_fit(_video(1), _video(2), _video(3)), prior_gradient=np.array([0.3, -0.2]), prior=np.eye(2))
    total = sum(fit.slopes)
    step = np.linalg.solve(fit.curvature, fit.prior_gradient + sum(v.slope(v.left[:, None])[:, 0] for v in fit.videos))
    np.testing.assert_allclose(total + fit.prior_gradient - fit.prior @ step, 0.0, atol=1e-9)
    for video, left, slope in zip(fit.videos, fit.left, fit.slopes, strict=True):
        np.testing.assert_allclose(video.reduced_shared.T @ left, slope, atol=1e-9)


def test_what_strengths_have_in_common_is_no_difference() -> None:
    """Where a fit is at an edge, another parameter that has it leaves next to no information on it, and a slope."""
    score = Score(np.array([3.7, 16.1, 2.0]), np.array([[292.4, -291.3, 0.0], [-291.3, 292.2, 0.0], [0.0, 0.0, 4.0]]))
    assert score.chi_square > 190.0
    apart = score.within(np.array([[-1.0, 1.0, 0.0], [0.0, 0.0, 1.0]]))
    half = (16.1 - 3.7) ** 2 / (292.4 + 292.2 + 2 * 291.3)
    assert (apart.degrees, apart.chi_square) == (2, pytest.approx(half + 1.0))
    np.testing.assert_allclose(apart.estimate[0], -apart.estimate[1])
    assert score.within(np.eye(3)[1:]).degrees == 2
    np.testing.assert_array_equal(score.within(np.eye(3)).gradient, score.gradient)


@pytest.mark.parametrize("chi_square", [3.0, 1_300.0, 1_400.0, 1e6])
def test_what_a_statistic_tells_is_known_where_its_p_value_is_below_any_number(chi_square: float) -> None:
    """With one degree it is that of a normal, with two an exponential."""
    one, two = (Score(np.full(count, np.sqrt(chi_square / count)), np.eye(count)) for count in (1, 2))
    assert one.log_p_value == pytest.approx(np.log(2) + log_ndtr(-np.sqrt(chi_square)), rel=1e-5)
    assert two.log_p_value == pytest.approx(-chi_square / 2)

"""Draws of the numbers of a cause whose density is no Gaussian."""

import numpy as np
import pytest

from tests.discovery.fitted import fitted
from tests.discovery.scenes import Setting
from vrdp_prob.discovery.candidates.scores import score_causes
from vrdp_prob.discovery.selection.cause_draws import walk
from vrdp_prob.discovery.selection.estimates import estimates
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.models.effects.friction_patch import FrictionPatch


def test_walkers_spread_along_a_ridge_much_longer_than_the_gaussian_at_its_top() -> None:
    """Along the ridge the density is a Gaussian of sd 4, across it one of sd 0.2, and the ridge bends."""

    def log_density(places: np.ndarray) -> np.ndarray:
        along, across = places.T
        values: np.ndarray = -((along / 4) ** 2) / 2 - ((across - along**2 / 20) / 0.2) ** 2 / 2
        return values

    draws = walk(log_density, 2, np.random.default_rng(0))
    assert draws is not None
    assert draws[:, 0].mean() == pytest.approx(0.0, abs=1.0)
    assert draws[:, 0].std() == pytest.approx(4.0, rel=0.15)
    across = draws[:, 1] - draws[:, 0] ** 2 / 20
    assert across.std() == pytest.approx(0.2, rel=0.2)


def test_a_density_that_ends_is_left_by_no_walker() -> None:
    draws = walk(lambda places: np.where((np.abs(places) < 1).all(axis=1), 0.0, -1e300), 2, np.random.default_rng(0))
    assert draws is not None
    assert np.abs(draws).max() < 1
    assert draws.std(axis=0) == pytest.approx(1 / np.sqrt(3), rel=0.1)


def test_where_nothing_is_possible_but_the_top_no_walker_sets_out() -> None:
    assert walk(lambda places: np.full(len(places), -1e300), 2, np.random.default_rng(0)) is None


def test_a_patch_is_begun_at_another_size_and_measured_along_its_edges() -> None:
    data, fit = fitted("friction_patch", 3.0, seed=3, setting=Setting(videos=6, bodies=3))
    base = Trial((), fit)
    patch = FrictionPatch()
    (score,) = score_causes(fit, base.unexplained.plain, [patch], seed=0)
    assert score.other_starts
    small = base.with_cause(score)
    assert small is not None
    found = small.continued().begun_elsewhere(base, score)
    assert found.fit.log_evidence > small.fit.log_evidence
    even = np.ones(len(fit.videos))
    gaussian = estimates(found.fit, patch, unexplained=found.unexplained)
    drawn = estimates(found.fit, patch, unexplained=found.unexplained, known=found.marginals(patch, even))
    laws = data.truth.videos[0].laws
    for name in ("patch_x", "patch_y", "patch_radius", "patch_friction"):
        assert drawn[name].q025 <= getattr(laws, name) <= drawn[name].q975
    assert drawn["patch_radius"].sd < gaussian["patch_radius"].sd / 3  # which is far too wide here

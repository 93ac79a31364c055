"""What is local is begun at several sizes."""

import numpy as np
import pytest

from tests.discovery.fitted import fitted
from tests.discovery.scenes import Setting
from vrdp_prob.discovery.candidates import scores
from vrdp_prob.discovery.candidates.scores import score_causes
from vrdp_prob.discovery.selection.estimates import estimates
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.models.effects.friction_patch import FrictionPatch


@pytest.mark.slow
def test_a_patch_is_begun_at_another_size_that_explains_as_much() -> None:
    data, fit = fitted("friction_patch", 3.0, seed=3, setting=Setting(videos=6, bodies=3))
    base = Trial((), fit)
    patch = FrictionPatch()
    (score,) = score_causes(fit, base.unexplained.plain, [patch], seed=0)
    assert score.other_starts
    small = base.with_cause(score)
    assert small is not None
    found = small.continued().begun_elsewhere(base, score)
    assert found.fit.log_evidence > small.fit.log_evidence
    told = estimates(found.fit, patch, unexplained=found.unexplained)
    laws = data.truth.videos[0].laws
    for name in ("patch_x", "patch_y", "patch_radius", "patch_friction"):
        assert told[name].q025 <= getattr(laws, name) <= told[name].q975
    small_ones = estimates(small.fit, patch, unexplained=small.unexplained)
    assert small_ones["patch_radius"].q975 < laws.patch_radius


def test_where_nothing_is_left_the_best_place_is_told_all_the_same() -> None:
    points = [{"patch_radius": 0.3}, {"patch_radius": 0.6}]
    assert scores._best_of_each_size(FrictionPatch(), points, np.array([-2e-17, -1e-17])) == [1]
    assert scores._best_of_each_size(FrictionPatch(), points, np.array([9.0, 10.0])) == [1, 0]
    assert scores._best_of_each_size(FrictionPatch(), points, np.array([7.0, 10.0])) == [1]

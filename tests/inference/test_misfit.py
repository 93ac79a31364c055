"""What a fit leaves is told from gross outliers, whatever the noise is taken for."""

import numpy as np
import pytest

from tests.inference.generator import observe
from tests.inference.test_infer import chain, with_outliers
from vrdp_prob.inference import default_model
from vrdp_prob.inference.map_fit import MapFit, fit_map
from vrdp_prob.inference.misfit import judge
from vrdp_prob.models.noise import NoiseFamily
from vrdp_prob.scene import Tracks


def fitted(tracks: Tracks) -> MapFit:
    return fit_map(tracks, default_model(), np.random.default_rng(0))


@pytest.mark.parametrize("seed", [2, 3])
def test_outliers_neither_hide_a_wrong_course_nor_count_as_one(seed: int) -> None:
    fit = fitted(with_outliers(observe(chain(), noise=0.005, seed=seed), 0.05))
    assert fit.likelihood.noise is NoiseFamily.STUDENT_T
    assert fit.search.agreed
    assert fit.misfit.ratio == pytest.approx(1.0, abs=0.15)
    assert fit.misfit.fits
    astray = fit.point.copy()
    astray[fit.likelihood.coordinates.places["mass", 1]] += 0.5
    assert judge(fit.likelihood, astray, fit.clues).ratio > 3


def test_a_push_that_no_model_knows_shows_among_outliers() -> None:
    tracks = observe(chain(), noise=0.005, seed=4)
    positions = tracks.positions.copy()
    late = np.maximum(tracks.times - 1.5, 0.0)
    positions[:, 0, 1] += 0.4 * late**2
    pushed = Tracks.from_arrays("pushed", tracks.bodies, tracks.times, positions)
    fit = fitted(with_outliers(pushed, 0.05))
    assert fit.misfit.outliers
    assert not fit.misfit.fits
    assert fit.misfit.error_acceleration is not None

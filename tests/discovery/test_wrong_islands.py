"""Joint fits of videos with cubes whose yaws nobody measured, of which one has found a wrong yaw by itself.

With that yaw goes a decay of the spins that the video seems to know very well.
"""

from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest

from tests.discovery.fitted import fitted
from tests.discovery.hidden import hide
from tests.discovery.measurement import Measurement
from tests.discovery.scenes import Setting
from vrdp_prob.inference import default_model
from vrdp_prob.inference.map_fit import fit_map
from vrdp_prob.inference.search.plan import TURNING
from vrdp_prob.inference.several_videos import spin_islands
from vrdp_prob.inference.several_videos.climb_state import NoCommonWorldError
from vrdp_prob.inference.several_videos.fitting import SharedFit, fit_together
from vrdp_prob.inference.several_videos.spin_islands import DECAY, with_other_spins
from vrdp_prob.models.parameters import Prior
from vrdp_prob.models.physics import PhysicsModel

SIX = Setting(videos=6, bodies=3)

MEASURED = Measurement(angles=True)


def test_where_yaws_are_measured_no_other_decay_of_the_spins_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    _, fit = fitted(None, seed=1, measurement=MEASURED)
    monkeypatch.setattr(spin_islands, "fit_together", Mock(side_effect=AssertionError))
    assert with_other_spins(fit, seed=0) is fit


def test_other_decays_of_the_spins_serve_to_begin_with(monkeypatch: pytest.MonkeyPatch) -> None:
    _, fit = fitted(seed=1)
    believed: list[Prior] = []

    def begun(_tracks: object, *, model: PhysicsModel, **_options: object) -> SharedFit:
        decay = next(one for one in model.parameters if one.name == DECAY)
        believed.append(model.believed(decay).prior)
        if len(believed) == 1:
            raise NoCommonWorldError
        return replace(fit, model=model)

    monkeypatch.setattr(spin_islands, "fit_together", begun)
    assert with_other_spins(fit, seed=0) is fit  # none was much better
    usual = fit.model.believed(next(one for one in fit.model.parameters if one.name == DECAY)).prior
    places = [(one.mean - usual.mean) / usual.sd for one in believed]
    assert places == sorted(places)
    assert min(places) < 0 < max(places)
    assert all(one.sd < usual.sd for one in believed)


@pytest.mark.slow
def test_videos_that_agreed_on_a_wrong_decay_of_the_spins_find_their_yaws() -> None:
    tracks = hide((), seed=34, effect_size=0.0, setting=SIX).tracks
    fit = fit_together(tracks, model=default_model(), model_error=False)
    found = with_other_spins(fit, seed=0)
    assert found.joint.log_density > fit.joint.log_density + 100
    assert found.model == fit.model
    assert max(one.misfit.ratio for one in found.fits) < 1.15 < max(one.misfit.ratio for one in fit.fits)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [7, 10, 11, 18])
def test_no_video_loses_its_course_among_the_others(seed: int) -> None:
    _, fit = fitted(None, seed=seed, setting=SIX)
    assert fit.joint.converged
    assert max(one.misfit.ratio for one in fit.fits) < 1.25


def test_a_cube_is_turned_where_it_meets_something_for_the_second_time() -> None:
    tracks = hide((), seed=10, effect_size=0.0, setting=SIX).tracks[1]
    fit = fit_map(tracks, default_model(), np.random.default_rng(0), plan=TURNING, model_error=False)
    # Where it is turned at its first contact only, residuals of twice the noise are left.
    assert fit.misfit.ratio < 1.1

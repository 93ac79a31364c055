"""Joint fits of videos with cubes whose yaws nobody measured, of which one has found a wrong yaw by itself.

With that yaw goes a decay of the spins that the video seems to know very well.
"""

import numpy as np
import pytest

from tests.discovery.fitted import fitted
from tests.discovery.hidden import hide
from tests.discovery.scenes import Setting
from vrdp_prob.inference import default_model
from vrdp_prob.inference.map_fit import fit_map
from vrdp_prob.inference.search.plan import TURNING

SIX = Setting(videos=6, bodies=3)


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

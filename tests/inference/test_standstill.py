"""A body that a slope drives back after it has stopped; up to there friction would have explained its motion."""

import numpy as np
import pytest

from vrdp_prob.inference.map_fit import fit_map
from vrdp_prob.inference.several_videos import fit_together
from vrdp_prob.inference.several_videos.second_look import may_take_another_course
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt
from vrdp_prob.models.parameters import GRAVITY
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.scene import Body, Shape, Tracks

TILT, NOISE = 0.003, 1e-4
BASE = PhysicsModel.base()
TILTED = BASE.with_effect(SurfaceTilt())


def uphill(speed: float, seconds: float) -> Tracks:
    """A body without friction that is sent up the slope: constant acceleration."""
    times = np.arange(round(seconds * 50)) / 50
    x = 0.9 - speed * times + GRAVITY * TILT * times**2 / 2
    positions = np.stack([x, np.zeros_like(x)], axis=-1)[:, None]
    positions += NOISE * np.random.default_rng(round(100 * speed)).standard_normal(positions.shape)
    return Tracks.from_arrays(f"{speed} m/s", (Body("glider", Shape.CYLINDER, 0.05),), times, positions)


@pytest.mark.parametrize(("seconds", "turns"), [(3.0, False), (6.0, True)])
def test_a_turning_body_has_another_course_of_events(seconds: float, turns: bool) -> None:
    fit = fit_map(uphill(0.13, seconds), BASE, np.random.default_rng(0), model_error=False)
    assert may_take_another_course(fit) == turns
    assert (fit.misfit.ratio > 20) == turns  # friction stops it, and holds it


@pytest.mark.slow
def test_a_fit_finds_that_a_slope_and_not_friction_has_stopped_a_body() -> None:
    fit = fit_map(uphill(0.13, 6.0), TILTED, np.random.default_rng(0), model_error=False)
    assert fit.misfit.ratio < 1.1


@pytest.mark.slow
def test_videos_that_know_nothing_of_the_turn_do_not_outvote_the_one_that_shows_it() -> None:
    videos = [uphill(0.28, 3.0), uphill(0.13, 6.0), uphill(0.22, 3.0), uphill(0.6, 1.5)]
    fit = fit_together(videos, model=TILTED, model_error=False)
    assert max(one.misfit.ratio for one in fit.fits) < 1.1
    tilt, friction = fit.value("tilt_x"), fit.value("sliding_friction")
    assert tilt is not None
    assert friction is not None
    assert tilt == pytest.approx(TILT, rel=0.05)
    assert friction < TILT / 10

"""What a model leaves to chance: nothing of noise, most of accelerations at random, little of a cause once it is in."""

from dataclasses import replace

import numpy as np
import pytest

from tests.discovery.fitted import fitted
from vrdp_prob.discovery.candidates.scores import score_causes
from vrdp_prob.discovery.residuals import unexplained as module
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.discovery.residuals.unexplained import unexplained
from vrdp_prob.discovery.selection.gains import gain
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.inference.several_videos.population import with_learned_population
from vrdp_prob.models.effects.external_impulse import ExternalImpulse
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt
from vrdp_prob.models.model_error import straying


def null() -> SharedFit:
    _, fit = fitted(seed=1)
    return fit.under(with_learned_population(fit), model_error=False)


def _shaken(model: ResidualModel, size: float, duration: float) -> ResidualModel:
    """The residuals of bodies that were accelerated at random: by another number every so often, summed by hand."""
    generator = np.random.default_rng(3)
    videos = []
    for video in model.videos:
        motion, steps = video.motion, 20
        fine = np.linspace(motion.times[0], motion.times[-1], steps * len(motion.times))
        moved = np.zeros((*motion.speed.shape, 3, 1))
        for body in range(motion.speed.shape[1]):
            for axis in (0, 1):
                count = int(np.ceil(np.ptp(fine) / duration)) + 1
                acceleration = size * generator.standard_normal(count)[((fine - fine[0]) / duration).astype(int)]
                velocity = np.cumsum(acceleration) * (fine[1] - fine[0])
                place = np.cumsum(velocity) * (fine[1] - fine[0])
                moved[:, body, axis, 0] = np.interp(motion.times, fine, place)
        # Rows are what a change of the measured places does to predicted less observed.
        extra = -video.linear.padded(video.rows(moved))[:, 0]
        videos.append(replace(video, linear=replace(video.linear, residuals=video.linear.residuals + extra)))
    return ResidualModel(replace(model.linear, videos=tuple(one.linear for one in videos)), tuple(videos))


def test_noise_leaves_nothing_unexplained() -> None:
    found = unexplained(null())
    assert found.accelerated == ()
    # Two variances of each video are free.
    assert (np.abs(found.gains) < 4).all()


def test_what_an_edge_promises_is_no_acceleration(monkeypatch: pytest.MonkeyPatch) -> None:
    fit = null()
    plain = ResidualModel.of(fit)
    first, *others = plain.videos
    own = first.linear.own / np.linalg.norm(first.linear.own, axis=0)
    promising = replace(
        first.linear, residuals=first.linear.residuals + own @ np.full(own.shape[1], 10.0), at_edge=True
    )
    assert promising.promised > 100
    videos = (replace(first, linear=promising), *others)
    model = ResidualModel(replace(plain.linear, videos=tuple(one.linear for one in videos)), videos)
    monkeypatch.setattr(module.ResidualModel, "of", lambda _: model)
    assert unexplained(fit).accelerated == ()


@pytest.mark.parametrize("size", [0.02, 0.1])
def test_accelerations_at_random_are_found(size: float, monkeypatch: pytest.MonkeyPatch) -> None:
    # Shaken by hand, bodies do not rebound as they come: restitutions have to be free to make up for it.
    (_, fit), duration = fitted(seed=1), 0.5
    shaken = _shaken(ResidualModel.of(fit), size, duration)
    monkeypatch.setattr(module.ResidualModel, "of", lambda _: shaken)
    found = unexplained(fit)
    second = np.ones(1)
    strayed = [
        one.size * float(np.sqrt(straying(second, 0.0, one.duration)[0, 0]))
        for video in found.straying
        for one in video
    ]
    assert len(strayed) == 6
    # Two steps of half a second each, of which the first moves a body by 3/8 of a m per m/s^2 and the second by 1/8.
    assert 0.6 < np.median(strayed) / (size * np.hypot(3 / 8, 1 / 8)) < 1.6
    assert found.gains.min() > 6
    assert found.independent().dispersion < 1.2 < found.plain.dispersion
    assert found.shared_widening.max() > 1.5


@pytest.fixture(scope="module")
def without() -> Trial:
    """Videos of a slope without it."""
    _, fit = fitted("surface_tilt", seed=3)
    return Trial((), fit.under(with_learned_population(fit), model_error=False))


@pytest.mark.slow
def test_kicks_in_video_after_video_explain_no_slope(without: Trial) -> None:
    kicks = ExternalImpulse()
    (score,) = score_causes(without.fit, without.unexplained.plain, [kicks], seed=0)
    kicked = without.with_cause(score)
    assert kicked is not None
    assert len(kicked.acting(kicks)) > 1
    assert kicked.patches(kicks)


@pytest.mark.slow
def test_a_cause_stands_out_and_leaves_nothing(without: Trial) -> None:
    tilt = SurfaceTilt()
    fit = without.fit.under(without.fit.model.with_effect(tilt), model_error=False)
    within = Trial((tilt,), fit.with_other_courses(seed=0))
    assert without.unexplained.accelerated
    assert within.unexplained.accelerated == ()
    plain = sum(one.log_density for one in within.cavities.values())
    plain -= sum(one.log_density for one in without.cavities.values())
    gained, error = gain(within, without)
    assert 0 < gained < plain
    assert gained > 2 * error

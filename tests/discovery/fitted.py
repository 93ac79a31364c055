"""Joint fits of generated videos, made once for all tests that look at them."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from jaxtyping import Float

from tests.discovery.data_set import DataSet, Wanted, draw
from tests.discovery.measurement import Measurement
from tests.discovery.scenes import Setting
from vrdp_prob.discovery.candidates.scores import score_causes
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.inference.several_videos.fitting import SharedFit, fit_together
from vrdp_prob.models.effects.body_friction import BodyFriction
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.physics import PhysicsModel

SMALL = Setting(videos=3, bodies=3, frames=70)


@cache
def fitted(
    way: str | None = None,
    effect_size: float = 5.0,
    *,
    seed: int,
    setting: Setting = SMALL,
    measurement: Measurement | None = None,
) -> tuple[DataSet, SharedFit]:
    """Videos in which a cause is hidden (none: a null), and the fit of the base model with own frictions."""
    wanted = [] if way is None else [Wanted(way, effect_size=effect_size)]
    data = draw(wanted, seed=seed, setting=setting, measurement=measurement)
    model = PhysicsModel.base().with_effect(BodyFriction())
    return data, fit_together(data.tracks, model=model, model_error=False)


def with_cause(way: str, effect_size: float, effect: Effect, *, seed: int) -> tuple[Trial, Trial]:
    """The base model on videos in which a cause is hidden, and the same with an effect from where its score begins."""
    _, fit = fitted(way, effect_size, seed=seed)
    base = Trial((), fit)
    (score,) = score_causes(fit, ResidualModel.of(fit), [effect], seed=0)
    trial = base.with_cause(score)
    assert trial is not None
    return base, trial


def moved(model: ResidualModel, changes: Sequence[Float[np.ndarray, "time body number"]]) -> ResidualModel:
    """What a fit would leave, to first order, if all that is measured of each video were elsewhere by some changes.

    Parameters
    ----------
    model
        What it leaves.
    changes
        Of all places in m, and of angles in rad where these are measured.
    """
    videos = []
    for video, change in zip(model.videos, changes, strict=True):
        rows = video.linear.padded(video.rows(change[..., None]))
        videos.append(replace(video, linear=replace(video.linear, residuals=video.linear.residuals - rows[:, 0])))
    return ResidualModel(replace(model.linear, videos=tuple(one.linear for one in videos)), tuple(videos))

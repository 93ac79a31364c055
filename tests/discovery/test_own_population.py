"""A cause that explains why bodies differ is worth that they differ less; without it they differ as before."""

from dataclasses import replace

import numpy as np
import pytest

from tests.discovery.fitted import fitted
from tests.discovery.hidden import hide
from tests.discovery.scenes import Setting
from vrdp_prob.discovery.candidates.scores import score_causes
from vrdp_prob.discovery.selection.gains import gain, gains
from vrdp_prob.discovery.selection.trials import Trial, with_own_population
from vrdp_prob.inference import default_model
from vrdp_prob.inference.several_videos.fitting import SharedFit, fit_together
from vrdp_prob.models.effects.body_friction import FRICTION_RATIO
from vrdp_prob.models.effects.mass_dependent_friction import MassDependentFriction
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt
from vrdp_prob.models.parameters import RESTITUTION, Prior

SURE = replace(RESTITUTION, prior=Prior(np.log(0.95), 0.02))
"""What somebody knows of restitutions."""
NEEDED = 6.0
"""Gain (nats) without which no cause is named (`search`): twenty causes share odds of 0.05."""


def spread_of(fit: SharedFit) -> float:
    return fit.model.believed(FRICTION_RATIO).prior.sd


@pytest.mark.slow
def test_friction_by_mass_makes_bodies_alike_and_is_worth_it() -> None:
    data = hide(["mass_dependent_friction"], seed=1, effect_size=3.0, setting=Setting(videos=6, bodies=3))
    fit = fit_together(data.tracks, model=default_model(), model_error=False)
    base = Trial((), with_own_population(fit))
    (score,) = score_causes(base.fit, base.unexplained.plain, [MassDependentFriction()], seed=0)
    found = base.with_cause(score)
    assert found is not None
    assert spread_of(base.fit) > 0.05
    assert spread_of(found.fit) < spread_of(base.fit) / 2
    assert gain(found, base)[0] > NEEDED
    again = found.without(found.causes[0])
    assert spread_of(again.fit) == pytest.approx(spread_of(base.fit), rel=0.3)
    # A single video may take another course of events on the way.
    assert np.median(np.abs(gains(again, base))) < 1.0


@pytest.mark.slow
def test_without_a_cause_bodies_are_believed_to_be_what_the_given_model_says() -> None:
    _, fit = fitted("surface_tilt", 5.0, seed=2)
    tilted = fit.under(fit.model.with_effect(tilt := SurfaceTilt()), model_error=False)
    trial = Trial((tilt,), tilted, stated={RESTITUTION.name: SURE})
    assert trial.without(tilt).fit.model.believed(RESTITUTION) == SURE
    assert trial.without(tilt).causes == ()

"""Contacts that spring back across are found beside friction in contacts."""

import pytest

from tests.discovery.fitted import fitted
from tests.discovery.scenes import Setting
from vrdp_prob.discovery.candidates.scores import score_causes
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.discovery.selection.estimates import estimates
from vrdp_prob.discovery.selection.leavings import Leavings
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.inference.several_videos.fitting import fit_together
from vrdp_prob.models.effects.contact_friction import ContactFriction
from vrdp_prob.models.effects.tangential_restitution import TangentialRestitution

TRUE = 0.6
MANY = Setting(videos=5, bodies=4, frames=70)


@pytest.mark.slow
def test_what_friction_leaves_where_contacts_spring_back_is_found_and_measured() -> None:
    data, base = fitted("springing_contacts", 10.0, seed=2, setting=MANY)
    rubbing = fit_together(data.tracks, model=base.model.with_effect(ContactFriction()), model_error=False)
    trial = Trial((ContactFriction(),), rubbing)
    (score,) = score_causes(rubbing, ResidualModel.of(rubbing), [TangentialRestitution()], seed=0)
    springing = trial.with_cause(score)
    assert springing is not None
    springing = springing.continued()
    found = estimates(springing.fit, TangentialRestitution())["tangential_restitution"]
    assert score.p_value < 1e-3
    assert springing.brought(trial) > 10.0
    assert found.q025 > 0.0
    assert abs(found.mean - TRUE) < 3 * found.sd  # one of two tops, within a nat of each other


@pytest.mark.slow
def test_it_is_looked_for_beside_friction_in_contacts_alone() -> None:
    _, fit = fitted("springing_contacts", 10.0, seed=2, setting=MANY)
    springing = TangentialRestitution()
    leavings = Leavings((ContactFriction(), springing), 0)
    assert leavings.further(Trial((), fit)) == [ContactFriction()]

"""Where a fit has lost its way, single videos tell the cause."""

import pytest

from tests.discovery.fitted import fitted
from vrdp_prob.discovery.candidates.single_videos import causes_of_lost_videos, lost_videos
from vrdp_prob.models.effects.clock_error import ClockError
from vrdp_prob.models.effects.contact_friction import ContactFriction
from vrdp_prob.models.effects.material_friction import MaterialFriction
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt


def test_no_video_of_a_null_is_lost() -> None:
    _, fit = fitted(seed=1)
    assert lost_videos(fit) == []
    assert causes_of_lost_videos(fit, [], [SurfaceTilt()], {"surface_tilt"}, 6.0, seed=0) == []


@pytest.mark.slow
def test_friction_of_contacts_is_told_by_the_videos_that_nothing_else_explains() -> None:
    _, fit = fitted("contact_friction", 3.0, seed=1)
    ratios = [part.misfit.ratio for part in fit.fits]
    worst = ratios.index(max(ratios))
    assert ratios[worst] > 1.2
    effects = [SurfaceTilt(), ContactFriction(), ClockError(), MaterialFriction()]
    found = causes_of_lost_videos(fit, [worst], effects, {effect.name for effect in effects}, 6.0, seed=0)
    assert found[0][0].name == "contact_friction"
    assert found[0][1] > 50


@pytest.mark.slow
def test_nothing_is_searched_with_what_is_neither_likely_nor_acts_in_contacts() -> None:
    _, fit = fitted("contact_friction", 3.0, seed=1)
    assert causes_of_lost_videos(fit, [0, 1], [SurfaceTilt(), ClockError()], set(), 6.0, seed=0) == []

"""A kick that comes with a contact mends what the fit makes of the contact; one in free flight is a cause."""

import numpy as np
import pytest

from tests.discovery.fitted import fitted
from vrdp_prob.discovery.candidates.scores import CauseScore, Site
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.models.effects.external_impulse import ExternalImpulse
from vrdp_prob.models.simulator.events import RolloutEventKind


def first_contact(fit: SharedFit) -> tuple[int, int, float]:
    """A video, one of two bodies that meet in it, and when."""
    for video, part in enumerate(fit.fits):
        contacts = part.rollout.events.of_kind(RolloutEventKind.COLLISION)
        if len(contacts):
            return video, int(contacts.first[0]), float(contacts.time[0])
    pytest.fail("no bodies meet")


@pytest.mark.parametrize(("frames_after", "patches"), [(1.0, True), (8.0, False)])
def test_a_kick_is_a_cause_only_apart_from_contacts(frames_after: float, patches: bool) -> None:
    _, fit = fitted(None, seed=1)
    video, body, time = first_contact(fit)
    times = fit.fits[video].likelihood.tracks.times
    later = fit.fits[video].rollout.events.of_kind(RolloutEventKind.COLLISION).time
    kick = time + frames_after * float(times[1] - times[0])
    assert patches or np.abs(later - kick).min() > 0.1
    effect = ExternalImpulse()
    site = Site(video, body, {"impulse_time": kick, "impulse_x": 0.02, "impulse_y": -0.02}, 30.0, 1e-6)
    trial = Trial((), fit).with_cause(CauseScore(effect, {}, (site,), 30.0, 2, 1e-6, {}, 9))
    assert trial is not None
    assert trial.acting(effect) == [video]
    assert trial.patches(effect) == patches

"""A kick that comes with a contact mends what the fit makes of the contact; one in free flight is a cause."""

import numpy as np
import pytest

from tests.discovery.fitted import fitted
from vrdp_prob.discovery.candidates.first_guess import FirstGuess, Site
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


def kicked(fit: SharedFit, video: int, body: int, kick: dict[str, float]) -> Trial:
    """The fit with a kick of a body."""
    site = Site(video, body, kick, 30.0, 1e-6)
    trial = Trial((), fit).with_cause(FirstGuess(ExternalImpulse(), {}, (site,), places=9))
    assert trial is not None
    assert trial.acting(ExternalImpulse()) == [video]
    return trial


def test_a_kick_that_comes_with_a_contact_is_no_cause() -> None:
    _, fit = fitted(None, seed=1)
    video, body, time = first_contact(fit)
    times = fit.fits[video].likelihood.tracks.times
    kick = {"impulse_time": time + float(times[1] - times[0]), "impulse_x": 0.02, "impulse_y": -0.02}
    assert kicked(fit, video, body, kick).patches(ExternalImpulse())


@pytest.mark.slow
def test_a_kick_in_free_flight_is_a_cause() -> None:
    data, fit = fitted("external_impulse", seed=1)
    (video,) = (k for k, one in enumerate(data.truth.videos) if np.isfinite(one.laws.kick_time))
    laws = data.truth.videos[video].laws
    contacts = fit.fits[video].rollout.events.of_kind(RolloutEventKind.COLLISION).time
    assert np.abs(contacts - laws.kick_time).min() > 0.2
    kick = {"impulse_time": laws.kick_time, "impulse_x": laws.kick_x, "impulse_y": laws.kick_y}
    trial = kicked(fit, video, int(laws.kick_body), kick)
    assert trial.brought(Trial((), fit)) > 0.0
    assert not trial.patches(ExternalImpulse())

"""How far apart bodies are in their own friction, learned from all videos."""

import pytest

from tests.discovery.fitted import fitted
from tests.discovery.scenes import Setting
from vrdp_prob.inference.several_videos.population import with_learned_spreads


@pytest.mark.parametrize("spread", [0.05, 0.3])
def test_the_spread_of_friction_is_that_of_the_bodies(spread: float) -> None:
    data, fit = fitted(seed=1, setting=Setting(videos=5, bodies=3, friction_spread=spread))
    learned = with_learned_spreads(fit).beliefs["friction_ratio"].prior.sd
    # A dozen bodies move: the logarithm of their spread has a standard deviation of about 0.2.
    assert spread / 2.2 < learned < 2.2 * spread
    assert len(data.tracks) == 5


def test_too_few_bodies_leave_the_prior() -> None:
    _, fit = fitted(seed=1, setting=Setting(videos=2, bodies=2, frames=60))
    prior = next(one for one in fit.model.parameters if one.name == "friction_ratio").prior
    assert with_learned_spreads(fit).beliefs["friction_ratio"].prior == prior

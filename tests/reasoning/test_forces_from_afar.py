"""What if an object were removed or heavier, where bodies repel each other: by an integrator of the tests' own."""

import numpy as np
import pytest

from tests.inference.repelling_discs import MASSES, inferred, video
from vrdp_prob.inference.identifiability.status import BodyStatus, ParameterStatus, Status
from vrdp_prob.inference.posterior import Posterior
from vrdp_prob.reasoning.changes import Change
from vrdp_prob.reasoning.stock import Stock
from vrdp_prob.reasoning.worlds import PosteriorWorlds

HEAVIER = 5.0


@pytest.fixture(scope="module")
def posterior() -> Posterior:
    return inferred()


@pytest.mark.parametrize("own_courses", [True, pytest.param(False, marks=pytest.mark.slow)])
@pytest.mark.parametrize("change", [Change.REMOVED, Change.HEAVIER])
def test_bodies_feel_from_afar_that_another_is_missing_or_has_another_mass(
    posterior: Posterior, change: Change, *, own_courses: bool
) -> None:
    factor = np.array([HEAVIER, 1.0, 1.0])
    other = video(without=0) if change.removes else video(factor * MASSES)
    expected = other.motion.states[-1, :, :2]
    seen = video().motion.states[-1, :, :2]
    worlds = PosteriorWorlds(posterior, draws=60, own_courses=own_courses)
    found = worlds.counterfactual(change, 0).trajectory[:, -1, :, :2].mean(axis=0)
    kept = slice(1, None) if change.removes else slice(None)
    assert np.abs(expected - seen[kept]).max() > 0.1
    np.testing.assert_allclose(found[kept], expected, atol=0.02)


def test_a_mass_that_was_drawn_is_not_drawn_again_from_the_prior(
    posterior: Posterior, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What little the tracks tell of it, they tell together with the force, so that another draw would not fit that."""
    unsaid = BodyStatus(ParameterStatus(Status.DEFAULT), ParameterStatus(Status.DEFAULT))
    monkeypatch.setattr(Stock, "_status", lambda _self, _body: unsaid)
    (batch,) = PosteriorWorlds(posterior, draws=40, defaults="prior").batches
    assert (batch.drawn.mass[:, :2] == posterior.worlds(40).mass[:, :2]).all()
    assert batch.drawn.mass[:, 2].std() > 0.1  # that one was weighed, and is held

"""What if an object were removed or heavier, where bodies repel each other: by an integrator of the tests' own."""

from dataclasses import replace

import numpy as np
import pytest

from tests.discovery.laws import Laws
from tests.discovery.measurement import Measurement, measure
from tests.discovery.videos import Video
from vrdp_prob import infer
from vrdp_prob.inference.identifiability import BodyStatus, ParameterStatus, Status
from vrdp_prob.inference.posterior import Posterior
from vrdp_prob.models.effects.pair_force import PairForce
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.reasoning.changes import Change
from vrdp_prob.reasoning.stock import Stock
from vrdp_prob.reasoning.worlds import PosteriorWorlds
from vrdp_prob.scene import Shape

MASSES = np.array([0.5, 2.0, 1.0])
HEAVIER = 5.0


def _video(mass: np.ndarray, *, without: int | None = None) -> Video:
    """Three discs that repel each other so that none of them meets, or two of them."""
    kept = [body for body in range(3) if body != without]
    return Video(
        shapes=(Shape.CYLINDER,) * len(kept),
        materials=("metal",) * len(kept),
        position=np.array([[0.0, 0.0], [1.2, 0.2], [0.4, 1.3]])[kept],
        velocity=np.array([[0.15, 0.05], [-0.1, 0.05], [0.0, -0.1]])[kept],
        angle=np.zeros(len(kept)),
        spin=np.zeros(len(kept)),
        release=np.zeros(len(kept)),
        mass=mass[kept],
        radius=np.full(len(kept), 0.1),
        restitution=np.full(len(kept), 0.8),
        friction=np.full(len(kept), 0.005),
        frames=75,
        laws=Laws(pair_strength=-0.1),
    )


@pytest.fixture(scope="module")
def posterior() -> Posterior:
    tracks, _ = measure(_video(MASSES), "repelling", Measurement(), np.random.default_rng(1))
    bodies = (*tracks.bodies[:2], replace(tracks.bodies[2], mass=MASSES[2]))
    model = PhysicsModel.base().with_effect(PairForce())
    return infer(replace(tracks, bodies=bodies), model=model, sampler="laplace", seed=1, hand_on=False)


@pytest.mark.parametrize("own_courses", [True, False])
@pytest.mark.parametrize("change", [Change.REMOVED, Change.HEAVIER])
def test_bodies_feel_from_afar_that_another_is_missing_or_has_another_mass(
    posterior: Posterior, change: Change, *, own_courses: bool
) -> None:
    factor = np.array([HEAVIER, 1.0, 1.0])
    other = _video(MASSES, without=0) if change.removes else _video(factor * MASSES)
    expected = other.motion.states[-1, :, :2]
    seen = _video(MASSES).motion.states[-1, :, :2]
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

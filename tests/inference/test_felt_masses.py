"""Masses that a path tells though nothing collides, by a force between bodies; the motion is another integrator's."""

from dataclasses import replace

import numpy as np
import pytest

from tests.discovery.laws import Laws
from tests.discovery.measurement import Measurement, measure
from tests.discovery.videos import Video
from vrdp_prob import infer
from vrdp_prob.inference.identifiability import Status
from vrdp_prob.inference.posterior import Posterior
from vrdp_prob.models.effects.pair_force import PairForce
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.scene import Shape

MASSES = np.array([0.5, 2.0, 1.0])


@pytest.fixture(scope="module")
def posterior() -> Posterior:
    """Three discs that repel each other so that none of them meets, one of which was weighed."""
    video = Video(
        shapes=(Shape.CYLINDER,) * 3,
        materials=("metal",) * 3,
        position=np.array([[0.0, 0.0], [1.2, 0.2], [0.4, 1.3]]),
        velocity=np.array([[0.15, 0.05], [-0.1, 0.05], [0.0, -0.1]]),
        angle=np.zeros(3),
        spin=np.zeros(3),
        release=np.zeros(3),
        mass=MASSES,
        radius=np.full(3, 0.1),
        restitution=np.full(3, 0.8),
        friction=np.full(3, 0.005),
        frames=75,
        laws=Laws(pair_strength=-0.1),
    )
    places = video.motion.states[..., :2]
    assert min(np.linalg.norm(places[:, i] - places[:, j], axis=1).min() for i, j in ((0, 1), (0, 2), (1, 2))) > 0.2
    tracks, _ = measure(video, "repelling", Measurement(), np.random.default_rng(1))
    bodies = (*tracks.bodies[:2], replace(tracks.bodies[2], mass=MASSES[2]))
    tracks = replace(tracks, bodies=bodies)
    return infer(tracks, model=PhysicsModel.base().with_effect(PairForce()), sampler="laplace", seed=1, hand_on=False)


def test_masses_of_bodies_that_only_repel_each_other_are_found(posterior: Posterior) -> None:
    log_mass = np.log(posterior.data["posterior"]["mass"].values.reshape(-1, 3))
    sd = log_mass.std(axis=0)
    assert np.all(sd[:2] < 0.1)
    assert np.all(np.abs(log_mass.mean(axis=0) - np.log(MASSES))[:2] < 4 * sd[:2])
    assert [one.mass.status for one in posterior.status.values()] == [Status.IDENTIFIED] * 3


def test_only_the_restitution_of_bodies_that_never_collide_is_called_a_default(posterior: Posterior) -> None:
    assert [one.restitution.status for one in posterior.status.values()] == [Status.DEFAULT] * 3
    told = [sentence for sentence in posterior.warnings if "default" in sentence]
    assert told == ["Objects a, b, c never collide in view: restitution is a default value, not measured."]

"""Three discs that repel each other so that none of them meets another; the motion is another integrator's."""

from dataclasses import replace

import numpy as np

from tests.discovery.laws import Laws
from tests.discovery.measurement import Measurement, measure
from tests.discovery.videos import Video
from vrdp_prob import infer
from vrdp_prob.inference.posterior import Posterior
from vrdp_prob.models.effects.pair_force import PairForce
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.scene import Shape

MASSES = np.array([0.5, 2.0, 1.0])
WEIGHED = 2
"""The disc whose mass is stated."""


def video(mass: np.ndarray = MASSES, *, without: int | None = None) -> Video:
    """The discs, or those that are left without one of them."""
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


def inferred() -> Posterior:
    """What is inferred from the tracks of all three, one of which was weighed."""
    seen = video()
    places = seen.motion.states[..., :2]
    assert min(np.linalg.norm(places[:, i] - places[:, j], axis=1).min() for i, j in ((0, 1), (0, 2), (1, 2))) > 0.2
    tracks, _ = measure(seen, "repelling", Measurement(), np.random.default_rng(1))
    bodies = list(tracks.bodies)
    bodies[WEIGHED] = replace(bodies[WEIGHED], mass=MASSES[WEIGHED])
    model = PhysicsModel.base().with_effect(PairForce())
    return infer(replace(tracks, bodies=tuple(bodies)), model=model, sampler="laplace", seed=1, hand_on=False)

"""Short videos of the tests' own generator, alike in friction and drag."""

from dataclasses import replace
from functools import cache

import numpy as np

from tests.inference.generator import Scene, integrate, observe
from vrdp_prob.models.parameters import GRAVITY
from vrdp_prob.scene import Shape, Tracks

FRICTION = 0.06
DRAG = 0.05
NOISE = 0.004


@cache
def sliding(seed: int, *, frames: int = 30, noise: float = NOISE, friction: float = FRICTION) -> Tracks:
    """One cylinder that slides, never the same way."""
    generator = np.random.default_rng([seed, 1])
    angle, speed = generator.uniform(0, 2 * np.pi), generator.uniform(1.0, 1.6)
    scene = Scene(
        (Shape.CYLINDER,),
        generator.uniform(-1, 1, (1, 2)),
        speed * np.array([[np.cos(angle), np.sin(angle)]]),
        np.ones(1),
        np.ones(1),
        np.full(1, 0.2),
        np.full(1, GRAVITY * friction),
        drag=DRAG,
    )
    return replace(observe(scene, noise=noise, frames=frames, seed=seed), video=f"slide {seed}")


@cache
def colliding(seed: int, *, frames: int = 40, noise: float = NOISE) -> Tracks:
    """A cylinder that hits a resting one."""
    generator = np.random.default_rng([seed, 2])
    aside = generator.uniform(-0.15, 0.15)
    scene = Scene(
        (Shape.CYLINDER, Shape.CYLINDER),
        np.array([[-0.8, 0.0], [0.2, aside]]),
        np.array([[generator.uniform(1.5, 2.2), 0.0], [0.0, 0.0]]),
        np.exp(0.4 * generator.standard_normal(2)),
        generator.uniform(0.75, 0.95, 2),
        np.full(2, 0.2),
        np.full(2, GRAVITY * FRICTION),
        drag=DRAG,
    )
    integrate(scene, np.arange(frames) / 25)
    assert scene.contacts
    return replace(observe(scene, noise=noise, frames=frames, seed=seed), video=f"hit {seed}")

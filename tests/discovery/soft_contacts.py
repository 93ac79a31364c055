"""Videos of discs whose contacts last: a linear spring pushes them apart while they overlap."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from vrdp_prob.scene import Body, Shape, Tracks

GRAVITY, FRICTION = 9.81, 0.02
RADIUS, NOISE = 0.1, 0.002
STEP, FRAME = 1e-4, 0.04


def videos(duration: float, *, seed: int, count: int = 4, frames: int = 50, growth: float = 1.0) -> list[Tracks]:
    """Videos of two discs that meet once, at one speed in each.

    Parameters
    ----------
    duration
        How long a contact lasts in s.
    seed
        Of everything that is drawn.
    count, frames
        Numbers of videos, and of frames in each.
    growth
        Factor of the radii at which bodies touch.
    """
    generator = np.random.default_rng(seed)
    found = []
    for number in range(count):
        speed = np.geomspace(0.4, 2.0, count)[number]
        mass = np.exp(0.3 * generator.standard_normal(2))
        aside = generator.uniform(-0.12, 0.12)
        place = np.array([[-0.15 - 0.6 * speed, aside / 2], [0.15, -aside / 2]])
        stiffness = (np.pi / duration) ** 2 / (1 / mass).sum()
        velocity = np.array([[speed, 0.0], [-0.05, 0.0]])
        path = _path(place, velocity, _Spring(mass, stiffness, 2 * RADIUS * growth), frames)
        seen = path + NOISE * generator.standard_normal(path.shape)
        bodies = tuple(Body(name, Shape.CYLINDER, RADIUS) for name in "ab")
        found.append(Tracks.from_arrays(f"v{number + 1}", bodies, FRAME * np.arange(frames), seen))
    return found


@dataclass(frozen=True)
class _Spring:
    """Masses (kg) of two bodies, and the spring (N/m) between them where they are nearer than some distance (m)."""

    mass: Float[np.ndarray, "body"]
    stiffness: float
    length: float

    def accelerations(self, place: Float[np.ndarray, "body 2"]) -> Float[np.ndarray, "body 2"]:
        """Accelerations in m/s^2."""
        between = place[1] - place[0]
        distance = float(np.linalg.norm(between))
        force = self.stiffness * max(self.length - distance, 0.0) * between / distance
        return np.stack([-force, force]) / self.mass[:, None]


def _path(
    place: Float[np.ndarray, "body 2"], velocity: Float[np.ndarray, "body 2"], spring: _Spring, frames: int
) -> Float[np.ndarray, "time body 2"]:
    """Places at each frame, by small steps of the semi-implicit rule of Euler."""
    every = round(FRAME / STEP)
    path = [place.copy()]
    for _ in range((frames - 1) * every):
        velocity = velocity + STEP * spring.accelerations(place)
        speed = np.linalg.norm(velocity, axis=1, keepdims=True)
        velocity = velocity * np.maximum(1 - STEP * FRICTION * GRAVITY / np.maximum(speed, 1e-12), 0.0)
        place = place + STEP * velocity
        path.append(place)
    return np.array(path[::every])

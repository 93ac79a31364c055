"""Random videos of the independent integrator with everything true of them: the state of every body at every frame.

2 to 6 spheres, cylinders and cubes; 1 to 6 pairs collide; bodies at rest, moving, or entering late; noise 0.005 to
0.03 m; up to a tenth of the positions lost.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tests.inference.generator import Scene, states
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.parameters import GRAVITY, Transform
from vrdp_prob.scene import Body, Shape, Tracks

FRAMES, RATE = 128, 25.0
TIMES = np.arange(FRAMES) / RATE
RADIUS = 0.2
KINDS = (Shape.SPHERE, Shape.CYLINDER, Shape.CUBE)
MOST_PAIRS = 6
EARLY = 0.4
"""A contact within so many seconds after a body was first seen counts as early."""
APART = 0.1
"""Contacts of a pair that are so many seconds apart are two collisions; a cube may land on one corner, then another."""


@dataclass(frozen=True)
class Truth:
    """One video and what is true of it.

    Parameters
    ----------
    scene
        The bodies; its contacts are those of the video.
    tracks
        What was seen.
    states
        x, y, vx, vy, angle, spin of every body at every frame (time, body, 6), SI units.
    noise
        Standard deviation in m of the positions' errors.
    shared
        True values of the parameters that all bodies share, by name.
    friction_ratio
        Friction of each body over the shared one.
    """

    scene: Scene
    tracks: Tracks
    states: np.ndarray
    noise: float
    shared: dict[str, float]
    friction_ratio: np.ndarray

    @property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """Pairs that collide, in the order of their first contact."""
        return tuple(dict.fromkeys((first, second) for _, first, second in self.scene.contacts))

    @property
    def strata(self) -> frozenset[str]:
        """The hard kinds of scenes that it belongs to."""
        seen, contacts = self.tracks.first_seen, self.scene.contacts
        found = set()
        if any(time - seen[body] < EARLY for time, *bodies in contacts for body in bodies):
            found.add("early contact")
        if sum(shape is Shape.CUBE for shape in self.scene.shapes) >= 2:
            found.add("two or more cubes")
        if max(collisions_of_each(contacts, len(self.scene.shapes))) >= 3:
            found.add("three or more collisions of one body")
        return frozenset(found)

    def point(self, likelihood: Likelihood) -> np.ndarray:
        """The true values in the vector of a likelihood; what it calls by another name is left at the prior's mean."""
        result = likelihood.coordinates.prior_mean.copy()
        values = self._values(likelihood.observations.position_reference)
        for place, entry in enumerate(likelihood.coordinates.entries):
            if entry.field in values:
                value = float(values[entry.field][entry.owner or 0])
                result[place] = np.log(value) if entry.transform is Transform.LOG else value
        return result

    def _values(self, noise_reference: float) -> dict[str, np.ndarray]:
        first = self.tracks.seen.argmax(axis=0)
        seen = self.states[first, np.arange(len(first))]
        quarter = np.pi / 2
        return {
            **dict(zip(("x", "y", "velocity_x", "velocity_y"), seen.T[:4], strict=True)),
            "angle": (seen[:, 4] + quarter / 2) % quarter - quarter / 2,
            "spin": seen[:, 5],
            "mass": self.scene.mass,
            "restitution": self.scene.restitution,
            "friction_ratio": self.friction_ratio,
            "noise_scale": np.array([self.noise / noise_reference]),
            **{name: np.array([value]) for name, value in self.shared.items()},
        }


def collisions_of_each(contacts: Sequence[tuple[float, int, int]], bodies: int) -> list[int]:
    """Number of collisions of each body; contacts of a pair in quick succession are one."""
    counts, latest = [0] * bodies, dict[tuple[int, int], float]()
    for time, first, second in sorted(contacts):
        if time - latest.get((first, second), -np.inf) > APART:
            counts[first] += 1
            counts[second] += 1
        latest[first, second] = time
    return counts


def random_truth(seed: int) -> Truth:
    """The video of a seed."""
    generator = np.random.default_rng([seed, 77])
    bodies = int(generator.integers(2, 7))
    wanted = int(generator.integers(1, min(MOST_PAIRS, bodies * (bodies - 1) // 2, bodies) + 1))
    while True:
        truth = _filmed(generator, bodies)
        if truth is not None and len(truth.pairs) == wanted:
            return truth


def _filmed(generator: np.random.Generator, bodies: int) -> Truth | None:
    """A video; None where a body enters inside another one, or collides before it is seen."""
    shared = {
        "sliding_friction": float(generator.uniform(0.03, 0.12)),
        "rolling_resistance": float(generator.uniform(0.004, 0.03)),
        "air_drag": float(generator.uniform(0.01, 0.06)),
        "angular_drag": float(generator.uniform(0.3, 1.5)),
    }
    ratio = np.exp(0.2 * generator.standard_normal(bodies))
    scene = _arranged(generator, bodies, shared, ratio)
    found = states(scene, TIMES)
    if _crowded(scene, found):
        return None
    noise = float(generator.uniform(0.005, 0.03))
    positions = found[..., :2] + noise * generator.standard_normal(found[..., :2].shape)
    lost = generator.random(positions.shape[:2]) < generator.uniform(0, 0.1)
    positions[lost | (TIMES[:, None] < scene.release - 1e-9)] = np.nan
    described = tuple(Body(str(k), shape, RADIUS) for k, shape in enumerate(scene.shapes))
    tracks = Tracks.from_arrays("synthetic", described, TIMES, positions)
    unseen = any(time <= tracks.first_seen[list(pair)].max() for time, *pair in scene.contacts)
    return None if unseen else Truth(scene, tracks, found, noise, shared, ratio)


def _crowded(scene: Scene, found: np.ndarray) -> bool:
    """Whether a body enters where another one is."""
    for body, release in enumerate(scene.release):
        frame = int(np.searchsorted(TIMES, release - 1e-9))
        others = [k for k in range(len(scene.release)) if k != body and scene.release[k] <= release + 1e-9]
        distance = np.linalg.norm(found[frame, others, :2] - found[frame, body, :2], axis=1)
        if distance.min(initial=np.inf) < 3 * RADIUS:
            return True
    return False


def _arranged(generator: np.random.Generator, bodies: int, shared: dict[str, float], ratio: np.ndarray) -> Scene:
    """Bodies apart from each other; the moving ones aim at another one, more or less well."""
    position = _apart(generator, bodies)
    velocity, spin, release = np.zeros((bodies, 2)), np.zeros(bodies), np.zeros(bodies)
    for body in range(1, bodies):
        if body == 1 or generator.random() < 0.7:
            target = position[generator.integers(body)] + 0.2 * generator.standard_normal(2)
            if generator.random() < 0.3:
                position[body] *= 3.0 / np.abs(position[body]).max()
                release[body] = TIMES[generator.integers(1, 60)]
            away = target - position[body]
            velocity[body] = generator.uniform(0.8, 2.5) * away / np.linalg.norm(away)
            spin[body] = generator.normal(0, 1) if generator.random() < 0.5 else 0.0
    shapes = tuple(KINDS[index] for index in generator.integers(len(KINDS), size=bodies))
    rolling = np.array([shape is Shape.SPHERE for shape in shapes])
    friction = ratio * np.where(rolling, shared["rolling_resistance"], shared["sliding_friction"])
    return Scene(
        shapes,
        position,
        velocity,
        mass=np.exp(0.4 * generator.standard_normal(bodies)),
        restitution=generator.uniform(0.6, 0.95, bodies),
        radius=np.full(bodies, RADIUS),
        deceleration=GRAVITY * friction,
        drag=shared["air_drag"],
        angle=generator.uniform(0, np.pi / 2, bodies),
        spin=spin,
        spin_deceleration=shared["angular_drag"],
        release=release,
    )


def _apart(generator: np.random.Generator, bodies: int) -> np.ndarray:
    while True:
        position = generator.uniform(-2.5, 2.5, size=(bodies, 2))
        apart = np.linalg.norm(position[:, None] - position[None], axis=-1) + 9 * np.eye(bodies)
        if apart.min() > 0.6:
            return position

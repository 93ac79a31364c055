"""Scenes to test the inference on, from an integrator of its own: small steps and bisection, nothing of the simulator.

Planar bodies slide under constant friction and quadratic drag; contacts are frictionless impulses along the normal,
with the product of the two restitutions; squares turn.
"""

from dataclasses import dataclass, field

import numpy as np

from tests.inference import generator_kernel
from vrdp_prob.scene import Body, Shape, Tracks, Wall

STEP = 2.5e-4
"""Step in s; a corner that reaches less deep into a body than half the way of one step may be missed."""
MOST_CONTACTS = 1000


@dataclass
class Scene:
    """What is true of a scene; arrays have one row per body. SI units."""

    shapes: tuple[Shape, ...]
    position: np.ndarray
    velocity: np.ndarray
    mass: np.ndarray
    restitution: np.ndarray
    radius: np.ndarray
    deceleration: np.ndarray
    drag: float = 0.0
    angle: np.ndarray = field(default_factory=lambda: np.zeros(0))
    spin: np.ndarray = field(default_factory=lambda: np.zeros(0))
    spin_deceleration: float = 0.0
    release: np.ndarray = field(default_factory=lambda: np.zeros(0))
    contacts: list[tuple[float, int, int]] = field(default_factory=list)

    def __post_init__(self) -> None:
        count = len(self.shapes)
        for name in ("angle", "spin", "release"):
            if not len(getattr(self, name)):
                setattr(self, name, np.zeros(count))


def states(scene: Scene, times: np.ndarray) -> np.ndarray:
    """x, y, vx, vy, angle, spin of every body at all times (time, body, 6); contacts are noted in the scene."""
    start = np.column_stack([scene.position, scene.velocity, scene.angle, scene.spin])
    found, contacts = generator_kernel.integrate(
        np.ascontiguousarray(start, dtype=float),
        np.asarray(scene.release, dtype=float),
        np.asarray(scene.mass, dtype=float),
        np.asarray(scene.radius, dtype=float),
        np.array([shape is Shape.CUBE for shape in scene.shapes]),
        np.asarray(scene.restitution, dtype=float),
        np.asarray(scene.deceleration, dtype=float),
        float(scene.drag),
        float(scene.spin_deceleration),
        np.asarray(times, dtype=float),
        STEP,
        MOST_CONTACTS,
    )
    scene.contacts[:] = [(float(time), int(first), int(second)) for time, first, second in contacts]
    return np.asarray(found)


def integrate(scene: Scene, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions (time, body, 2) and angles (time, body); contacts are noted in the scene."""
    found = states(scene, times)
    return found[..., :2], found[..., 4]


def observe(
    scene: Scene,
    *,
    noise: float = 0.01,
    dropout: float = 0.0,
    frames: int = 128,
    rate: float = 25.0,
    seed: int = 0,
    angles: bool = False,
    masses: dict[int, float] | None = None,
    walls: tuple[Wall, ...] = (),
) -> Tracks:
    """Tracks of a scene with independent noise; a body is seen from its release on."""
    generator = np.random.default_rng(seed)
    times = np.arange(frames) / rate
    positions, turned = integrate(scene, times)
    positions = positions + noise * generator.standard_normal(positions.shape)
    hidden = (times[:, None] < scene.release - 1e-9) | (generator.random(positions.shape[:2]) < dropout)
    positions[hidden] = np.nan
    bodies = tuple(
        Body(str(k), shape, float(scene.radius[k]), mass=(masses or {}).get(k)) for k, shape in enumerate(scene.shapes)
    )
    measured = turned + 0.02 * generator.standard_normal(turned.shape) if angles else None
    return Tracks.from_arrays("synthetic", bodies, times, positions, angles=measured, walls=walls)


def random_scene(generator: np.random.Generator, bodies: int = 4, *, squares: bool = True) -> Scene:
    """A scene like those of the practice set: some bodies at rest, the others aimed at them."""
    kinds = (Shape.SPHERE, Shape.CYLINDER, Shape.CUBE) if squares else (Shape.CYLINDER,)
    while True:
        shapes = tuple(kinds[index] for index in generator.integers(len(kinds), size=bodies))
        position = generator.uniform(-2.5, 2.5, size=(bodies, 2))
        apart = np.linalg.norm(position[:, None] - position[None], axis=-1) + 9 * np.eye(bodies)
        if apart.min() < 0.8:
            continue
        velocity = np.zeros((bodies, 2))
        for body in range(1, bodies):
            if generator.random() < 0.7:
                target = position[generator.integers(body)] + 0.15 * generator.standard_normal(2)
                direction = (target - position[body]) / np.linalg.norm(target - position[body])
                velocity[body] = generator.uniform(1.0, 2.5) * direction
        mass = np.exp(0.4 * generator.standard_normal(bodies))
        rolling = np.array([shape is Shape.SPHERE for shape in shapes])
        deceleration = np.where(rolling, 0.08, 0.5)
        scene = Scene(
            shapes,
            position,
            velocity,
            mass,
            generator.uniform(0.6, 0.95, bodies),
            np.full(bodies, 0.2),
            deceleration,
            drag=0.04,
            angle=generator.uniform(0, np.pi / 2, bodies),
            spin_deceleration=0.5,
        )
        integrate(scene, np.arange(128) / 25)
        if len({contact[1:] for contact in scene.contacts}) >= 2:
            return scene

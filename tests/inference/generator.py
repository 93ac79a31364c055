"""Scenes to test the inference on, from an integrator of its own: small steps and bisection, nothing of the simulator.

Planar bodies slide under constant friction and quadratic drag; contacts are frictionless impulses along the normal,
with the product of the two restitutions; squares turn.
"""

from dataclasses import dataclass, field

import numpy as np

from vrdp_prob.scene import Body, Shape, Tracks, Wall

STEP = 1e-3
TOLERANCE = 1e-10


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


def integrate(scene: Scene, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions (time, body, 2) and angles (time, body); contacts are noted in the scene."""
    scene.contacts.clear()
    state = np.concatenate([scene.position, scene.velocity, scene.angle[:, None], scene.spin[:, None]], axis=1)
    positions, angles, now = [], [], float(times[0])
    for time in times:
        while now < time - 1e-12:
            following = scene.release[scene.release > now + 1e-12].min(initial=np.inf)
            step = min(STEP, time - now, following - now)
            state, now = _advance(scene, state, now, step)
        positions.append(state[:, :2].copy())
        angles.append(state[:, 4].copy())
    return np.array(positions), np.array(angles)


def _advance(scene: Scene, state: np.ndarray, now: float, step: float) -> tuple[np.ndarray, float]:
    released = scene.release <= now + 1e-9
    target = _free(scene, state, released, step)
    touching = [
        pair for pair in _pairs(released) if _gap(scene, target, *pair)[0] < 0 and _closing(scene, target, pair)
    ]
    if not touching:
        return target, now + step
    low, high = 0.0, step
    while high - low > TOLERANCE:
        middle = (low + high) / 2
        trial = _free(scene, state, released, middle)
        if any(_gap(scene, trial, *pair)[0] < 0 and _closing(scene, trial, pair) for pair in touching):
            high = middle
        else:
            low = middle
    state = _free(scene, state, released, high)
    for pair in touching:
        if _gap(scene, state, *pair)[0] < 1e-8 and _closing(scene, state, pair):
            state = _impulse(scene, state, pair)
            scene.contacts.append((now + high, *pair))
    return state, now + high


def _pairs(released: np.ndarray) -> list[tuple[int, int]]:
    alive = np.flatnonzero(released)
    return [(int(i), int(j)) for k, i in enumerate(alive) for j in alive[k + 1 :]]


def _free(scene: Scene, state: np.ndarray, released: np.ndarray, step: float) -> np.ndarray:
    """One midpoint step of the free motion; a body that would turn back has stopped."""
    result = state.copy()
    velocity = state[:, 2:4]
    half = velocity + step / 2 * _acceleration(scene, velocity)
    new = velocity + step * _acceleration(scene, half)
    moved = state[:, :2] + step * (velocity + new) / 2
    stopped = (new * velocity).sum(axis=1) <= 0
    new[stopped], moved[stopped] = 0.0, state[stopped, :2]
    result[:, :2], result[:, 2:4] = moved, new
    spin = np.sign(state[:, 5]) * np.maximum(np.abs(state[:, 5]) - scene.spin_deceleration * step, 0)
    result[:, 4] += step * (state[:, 5] + spin) / 2
    result[:, 5] = spin
    result[~released] = state[~released]
    return result


def _acceleration(scene: Scene, velocity: np.ndarray) -> np.ndarray:
    speed = np.linalg.norm(velocity, axis=1, keepdims=True)
    direction = velocity / np.maximum(speed, 1e-300)
    return -scene.deceleration[:, None] * direction - scene.drag * speed * velocity


def _corners(scene: Scene, state: np.ndarray, body: int) -> np.ndarray:
    half = scene.radius[body]
    corners = half * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
    return state[body, :2] + corners @ _turn(state[body, 4]).T


def _cross(a: np.ndarray, b: np.ndarray) -> float:
    return float(a[0] * b[1] - a[1] * b[0])


def _turn(angle: float) -> np.ndarray:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def _from_square(scene: Scene, state: np.ndarray, square: int, point: np.ndarray) -> tuple[float, np.ndarray]:
    """Signed distance of a point from a square and the outward direction there."""
    turn = _turn(state[square, 4])
    local = turn.T @ (point - state[square, :2])
    excess = np.abs(local) - scene.radius[square]
    outside = np.maximum(excess, 0)
    if outside.any():
        distance = float(np.linalg.norm(outside))
        return distance, turn @ (np.sign(local) * outside / distance)
    axis = int(np.argmax(excess))
    direction = np.zeros(2)
    direction[axis] = np.sign(local[axis])
    return float(excess[axis]), turn @ direction


def _gap(scene: Scene, state: np.ndarray, i: int, j: int) -> tuple[float, np.ndarray, np.ndarray]:
    """Gap, normal from j to i, and the contact point."""
    squares = [scene.shapes[k] is Shape.CUBE for k in (i, j)]
    between = state[i, :2] - state[j, :2]
    distance = float(np.linalg.norm(between))
    if not any(squares):
        normal = between / distance
        return distance - scene.radius[i] - scene.radius[j], normal, state[j, :2] + scene.radius[j] * normal
    if distance > 1.5 * (scene.radius[i] + scene.radius[j]):
        return distance, between / distance, state[j, :2]
    if not all(squares):
        square, disc = (i, j) if squares[0] else (j, i)
        gap, outward = _from_square(scene, state, square, state[disc, :2])
        normal = -outward if square == i else outward
        return gap - scene.radius[disc], normal, state[disc, :2] - scene.radius[disc] * outward
    options = []
    for square, other, sign in ((j, i, 1.0), (i, j, -1.0)):
        for corner in _corners(scene, state, other):
            gap, outward = _from_square(scene, state, square, corner)
            options.append((gap, sign * outward, corner))
    return min(options, key=lambda option: option[0])


def _contact_speed(scene: Scene, state: np.ndarray, pair: tuple[int, int]) -> tuple[float, np.ndarray, list[float]]:
    i, j = pair
    _, normal, point = _gap(scene, state, i, j)
    levers = [_cross(point - state[k, :2], normal) for k in pair]
    speed = float((state[i, 2:4] - state[j, 2:4]) @ normal + state[i, 5] * levers[0] - state[j, 5] * levers[1])
    return speed, normal, levers


def _closing(scene: Scene, state: np.ndarray, pair: tuple[int, int]) -> bool:
    return _contact_speed(scene, state, pair)[0] < 0


def _impulse(scene: Scene, state: np.ndarray, pair: tuple[int, int]) -> np.ndarray:
    i, j = pair
    speed, normal, levers = _contact_speed(scene, state, pair)
    inertia = [2 / 3 * scene.mass[k] * scene.radius[k] ** 2 for k in pair]
    inverse = 1 / scene.mass[i] + 1 / scene.mass[j] + levers[0] ** 2 / inertia[0] + levers[1] ** 2 / inertia[1]
    impulse = -(1 + scene.restitution[i] * scene.restitution[j]) * speed / inverse
    result = state.copy()
    result[i, 2:4] += impulse / scene.mass[i] * normal
    result[j, 2:4] -= impulse / scene.mass[j] * normal
    result[i, 5] += impulse * levers[0] / inertia[0]
    result[j, 5] -= impulse * levers[1] / inertia[1]
    return result


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

"""Scenes whose unknowns come from the very prior that the inference believes in, for checks of its calibration.

The prior is that of `vrdp_prob.models` (its objects and constants are used here, so that they cannot drift apart); the
motion comes from the independent integrator. A scene is kept or thrown away by what was measured, never by what is true
of it: posteriors of scenes selected by their data are as calibrated as all.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from tests.inference.generator import Scene, integrate
from vrdp_prob.errors import InputError
from vrdp_prob.models.effects.body_friction import FRICTION_RATIO
from vrdp_prob.models.observation import NOISE_LOG_SD, NOISE_SHARE_OF_RADIUS
from vrdp_prob.models.parameters import (
    AIR_DRAG,
    ANGULAR_DRAG,
    GRAVITY,
    MASS,
    RESTITUTION,
    ROLLING_RESISTANCE,
    SLIDING_FRICTION,
)
from vrdp_prob.models.unknowns import SPEED_SD, SPIN_SD, YAW_SD
from vrdp_prob.scene import Body, Shape, Tracks

SHARED = (SLIDING_FRICTION, ROLLING_RESISTANCE, AIR_DRAG, ANGULAR_DRAG)
"""What all bodies share; the logarithm is what has a prior, as of everything here but velocities and angles."""
RATE = 25.0
FRAMES = (40, 60)
RELEASE_REGION = 1.0
"""Half side in m of the square in which bodies are released."""
RESTING = 0.3
"""Share of the bodies that rest at their release, which is part of what the inference believes possible."""
CUBES = 0.4
"""Share of the scenes that may hold cubes, whose yaw nobody measured."""
LATE = 0.15
"""Share of the scenes in which a body comes in late."""
DROPOUT = 0.05

SEEN_REGION = 5.0
"""Half side in m of the square in which everything must have been measured..."""
ROUGHNESS = (0.003, 0.03)
"""...with a noise (m) that shows as this in the tracks,"""
FIRST_GAP = 0.1
"""...bodies apart by this gap (m) around their corners where they were first seen,"""
KINK = 0.3
"""...and a change of velocity (m/s) of a body near another one that is larger than this, and not just noise."""
KINK_FRAMES = 5
NOISE_OF_KINKS = 40.0
"""Change of velocity (m/s) per noise (m) that is not just noise: about 4 standard deviations."""
NEAR = 0.1


@dataclass(frozen=True)
class PriorScene:
    """A scene with its measurement and everything that is true of it.

    Parameters
    ----------
    seed
        Of all its randomness.
    scene
        The bodies.
    tracks
        What was measured.
    exact
        Positions in m without noise.
    noise
        Standard deviation in m of the noise.
    shared
        Values of the parameters that all bodies share, by name.
    friction_ratio
        Friction of each body over the shared one.
    """

    seed: int
    scene: Scene
    tracks: Tracks
    exact: np.ndarray
    noise: float
    shared: dict[str, float]
    friction_ratio: np.ndarray

    @property
    def pairs(self) -> set[frozenset[str]]:
        """Pairs that collide."""
        return {frozenset((str(first), str(second))) for _, first, second in self.scene.contacts}


def prior_scene(seed: int) -> PriorScene | None:
    """The scene of a seed; None where its measurement is not of the kind that is looked at."""
    generator = np.random.default_rng([seed, 20240])
    try:
        drawn = _draw(seed, generator)
    except InputError:  # measured bodies overlap
        return None
    return drawn if _wanted(drawn.tracks) else None


def _draw(seed: int, generator: np.random.Generator) -> PriorScene:
    """A scene from the prior, and its measurement."""
    count = int(generator.integers(2, 4))
    kinds = (Shape.CYLINDER, Shape.SPHERE, Shape.CUBE) if generator.random() < CUBES else (Shape.CYLINDER, Shape.SPHERE)
    shapes = tuple(kinds[index] for index in generator.integers(len(kinds), size=count))
    moving = generator.random(count) >= RESTING
    shared = {one.name: float(np.exp(one.prior.sample(generator, ()))) for one in SHARED}
    ratio = np.exp(FRICTION_RATIO.prior.sample(generator, (count,)))
    spheres = np.array([shape is Shape.SPHERE for shape in shapes])
    friction = np.where(spheres, shared[ROLLING_RESISTANCE.name], shared[SLIDING_FRICTION.name])
    frames = int(generator.integers(FRAMES[0], FRAMES[1] + 1))
    radius = generator.uniform(0.15, 0.25, count)
    release = np.zeros(count)
    if generator.random() < LATE:
        release[-1] = generator.integers(4, frames // 2) / RATE
    scene = Scene(
        shapes,
        generator.uniform(-RELEASE_REGION, RELEASE_REGION, (count, 2)),
        moving[:, None] * SPEED_SD * generator.standard_normal((count, 2)),
        np.exp(MASS.prior.sample(generator, (count,))),
        np.exp(RESTITUTION.prior.sample(generator, (count,))),
        radius,
        GRAVITY * friction * ratio,
        drag=shared[AIR_DRAG.name],
        angle=YAW_SD * generator.standard_normal(count),
        spin=moving * SPIN_SD * generator.standard_normal(count),
        spin_deceleration=shared[ANGULAR_DRAG.name],
        release=release,
    )
    noise = NOISE_SHARE_OF_RADIUS * float(np.median(radius)) * float(np.exp(NOISE_LOG_SD * generator.standard_normal()))
    exact, tracks = _measured(scene, frames, noise, generator)
    return PriorScene(seed, scene, tracks, exact, noise, shared, ratio)


def _measured(scene: Scene, frames: int, noise: float, generator: np.random.Generator) -> tuple[np.ndarray, Tracks]:
    """Positions without noise, and the tracks: with noise, from the release on, some frames missing later."""
    times = np.arange(frames) / RATE
    exact, _ = integrate(scene, times)
    positions = exact + noise * generator.standard_normal(exact.shape)
    before = times[:, None] < scene.release - 1e-9
    first = (~before).argmax(axis=0)
    missing = generator.random(positions.shape[:2]) < DROPOUT
    missing[first, np.arange(len(scene.shapes))] = False
    positions[before | missing] = np.nan
    bodies = tuple(Body(str(k), shape, float(scene.radius[k])) for k, shape in enumerate(scene.shapes))
    return exact, Tracks.from_arrays("prior", bodies, times, positions)


def _wanted(tracks: Tracks) -> bool:
    """Whether a measurement is of the kind that is looked at."""
    seen = tracks.positions[tracks.seen]
    if np.abs(seen).max() > SEEN_REGION or not ROUGHNESS[0] <= _roughness(tracks) <= ROUGHNESS[1]:
        return False
    pairs = list(combinations(range(len(tracks.bodies)), 2))
    return all(_apart(tracks, pair) for pair in pairs) and any(_kink(tracks, pair) for pair in pairs)


def _roughness(tracks: Tracks) -> float:
    """Noise in m per axis that the third differences of neighbouring positions show."""
    differences = np.diff(tracks.positions, n=3, axis=0)
    return float(np.nanmedian(np.abs(differences)) / 0.6745 / np.sqrt(20))


def _reach(body: Body) -> float:
    """Largest distance in m of a point of a body from its centre."""
    return float(body.radius or 0.0) * (np.sqrt(2) if body.shape is Shape.CUBE else 1.0)


def _distance(tracks: Tracks, pair: tuple[int, int]) -> np.ndarray:
    """Gap in m around the corners of two bodies in every frame; NaN where one was not seen."""
    first, second = pair
    between = np.linalg.norm(tracks.positions[:, first] - tracks.positions[:, second], axis=-1)
    return between - _reach(tracks.bodies[first]) - _reach(tracks.bodies[second])


def _apart(tracks: Tracks, pair: tuple[int, int]) -> bool:
    """Whether two bodies are apart when the later of them is first seen."""
    gap = _distance(tracks, pair)
    return bool(gap[np.isfinite(gap)][0] > FIRST_GAP)


def _kink(tracks: Tracks, pair: tuple[int, int]) -> bool:
    """Whether the velocity of one of two bodies changes where they are near each other."""
    near = np.flatnonzero(_distance(tracks, pair) < NEAR)
    smallest = max(KINK, NOISE_OF_KINKS * _roughness(tracks))
    return any(_change(tracks, body, frame) > smallest for frame in near for body in pair)


def _change(tracks: Tracks, body: int, frame: int) -> float:
    """Change of a body's velocity (m/s) at a frame, by straight lines through the frames before and after it."""
    velocities = []
    for window in (slice(max(frame - KINK_FRAMES, 0), frame), slice(frame + 1, frame + 1 + KINK_FRAMES)):
        times, places = tracks.times[window], tracks.positions[window, body]
        seen = np.isfinite(places).all(axis=1)
        if seen.sum() < KINK_FRAMES - 1:
            return 0.0
        velocities.append(np.polyfit(times[seen], places[seen], 1)[0])
    return float(np.linalg.norm(velocities[1] - velocities[0]))

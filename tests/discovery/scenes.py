"""Random videos with nothing hidden in them: bodies on a table, some at rest, the others aimed at them."""

from dataclasses import dataclass, replace

import numpy as np

from tests.discovery.laws import Laws
from tests.discovery.videos import Video
from vrdp_prob.scene import Shape, Wall

SLIDING, ROLLING = 0.05, 0.02
"""Median friction coefficients of what slides, and of spheres that roll."""
ENTRANCE = 2.6
"""Distance from the middle in m at which bodies come in late."""
MATERIALS = ("metal", "rubber")


@dataclass(frozen=True)
class Setting:
    """What kind of videos are drawn.

    Parameters
    ----------
    videos, bodies, frames, frame_rate
        Numbers of videos, bodies in each and frames, and frames per second.
    shapes
        Solids that are drawn from; all of them are there where there are bodies enough.
    resistance
        Factor of friction and drag; 0 where bodies glide for ever.
    friction_spread, restitution_spread, mass_spread
        Standard deviation of the logarithm of the bodies' own factors.
    late
        Probability that one body of a video comes in late.
    same_bodies
        Whether the same bodies are in all videos.
    arena
        Half side in m of a square of four stated walls around the table, None without.
    """

    videos: int = 12
    bodies: int = 4
    frames: int = 100
    frame_rate: float = 25.0
    shapes: tuple[Shape, ...] = (Shape.SPHERE, Shape.CYLINDER, Shape.CUBE)
    resistance: float = 1.0
    friction_spread: float = 0.05
    restitution_spread: float = 0.05
    mass_spread: float = 0.4
    late: float = 0.3
    same_bodies: bool = False
    arena: float | None = None


def draw_videos(setting: Setting, generator: np.random.Generator) -> tuple[Video, ...]:
    """Videos of one table and one camera; in each, bodies meet twice at least, or once if there are only two."""
    bodies = _draw_bodies(setting, generator)
    x, y = generator.uniform(-0.3, 0.3, 2)
    centre = float(x), float(y)
    videos = []
    for _ in range(setting.videos):
        if not setting.same_bodies:
            bodies = _draw_bodies(setting, generator)
        videos.append(replace(_launch(bodies, setting, generator), centre=centre))
    return tuple(videos)


def _draw_bodies(setting: Setting, generator: np.random.Generator) -> Video:
    """A video of bodies that are nowhere yet."""
    count = setting.bodies
    kinds = [setting.shapes[k % len(setting.shapes)] for k in generator.permutation(count)]
    rolling = np.array([kind is Shape.SPHERE for kind in kinds])
    own = np.exp(setting.friction_spread * generator.standard_normal(count))
    restitution = 0.88 * np.exp(setting.restitution_spread * generator.standard_normal(count))
    return Video(
        shapes=tuple(kinds),
        materials=tuple(MATERIALS[k % 2] for k in generator.permutation(count)),
        position=np.zeros((count, 2)),
        velocity=np.zeros((count, 2)),
        angle=np.zeros(count),
        spin=np.zeros(count),
        release=np.zeros(count),
        mass=np.exp(setting.mass_spread * generator.standard_normal(count)),
        radius=generator.uniform(0.15, 0.25, count),
        restitution=np.minimum(restitution, 0.99),
        friction=np.where(rolling, ROLLING, SLIDING) * own * setting.resistance,
        frames=setting.frames,
        frame_rate=setting.frame_rate,
        laws=Laws(drag=0.03 * setting.resistance, spin_decay=0.5),
        walls=() if setting.arena is None else _square(setting.arena),
    )


def _launch(bodies: Video, setting: Setting, generator: np.random.Generator) -> Video:
    """The bodies on their way, drawn until enough of them meet and none comes in on top of another."""
    count = setting.bodies
    while True:
        position = generator.uniform(-1.8, 1.8, size=(count, 2))
        velocity = np.zeros((count, 2))
        release = np.zeros(count)
        if count > 1 and generator.random() < setting.late:
            direction = generator.uniform(0, 2 * np.pi)
            entrance = ENTRANCE if setting.arena is None else min(ENTRANCE, setting.arena - 0.4)
            position[-1] = entrance * np.array([np.cos(direction), np.sin(direction)])
            release[-1] = generator.uniform(0.1, 0.35) * setting.frames / setting.frame_rate
        for body in range(count):
            if body == count - 1 or generator.random() < 0.75:
                target = position[generator.integers(body)] if body > 0 else np.zeros(2)
                velocity[body] = _towards(target, position[body], generator)
        moving = np.linalg.norm(velocity, axis=1) > 0
        video = replace(
            bodies,
            position=position,
            velocity=velocity,
            release=release,
            angle=generator.uniform(-np.pi, np.pi, count),
            spin=np.where(moving, generator.uniform(-5, 5, count), 0.0),
        )
        if _clear(video) and (video.motion.pairs[:, 1] < count).sum() >= min(count - 1, 2):
            return video


def _towards(target: np.ndarray, place: np.ndarray, generator: np.random.Generator) -> np.ndarray:
    """A velocity roughly towards a place."""
    way = target + 0.2 * generator.standard_normal(2) - place
    return generator.uniform(0.7, 1.8) * way / np.linalg.norm(way)


def _clear(video: Video) -> bool:
    """Whether no body is released on top of another one."""
    reach = 1.5 * (video.radius[:, None] + video.radius[None])
    for body, release in enumerate(video.release):
        place = video.motion.states[int(release * video.frame_rate), :, :2] if release > 0 else video.position
        apart = np.linalg.norm(place - place[body], axis=1)
        apart[body] = np.inf
        if (apart < reach[body]).any():
            return False
    return True


def _square(half: float) -> tuple[Wall, ...]:
    """Four walls around the middle."""
    corners = [(-half, -half), (half, -half), (half, half), (-half, half)]
    return tuple(Wall(*corners[k - 1], *corners[k], restitution=0.8) for k in range(4))

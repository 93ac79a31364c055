"""The twenty causes of the catalogue, hidden in videos with a strength; one small function each.

A function takes the videos, the strength in the unit that the register states, and a generator that draws directions,
places and times; the same generator state gives the same details at every strength.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from tests.discovery import places
from tests.discovery.scenes import MATERIALS, ROLLING
from tests.discovery.videos import Disc, Video
from vrdp_prob.scene import Shape, Wall

Videos = tuple[Video, ...]
Hide = Callable[[Videos, float, np.random.Generator], Videos]


@dataclass(frozen=True)
class Cause:
    """A physical cause that can be hidden.

    Parameters
    ----------
    name
        Name in the catalogue, or one of its own for an effect outside it.
    hide
        The function that hides it.
    unit
        Unit of the strength.
    most
        Strength beyond which it is no longer a small effect; the search for a strength ends there.
    least
        Smallest strength that is tried, at which it is gone or hardly there where nothing else is said.
    catalogued
        Whether the catalogue has it.
    placed
        Whether it acts only where it is put, which is where bodies go.
    """

    name: str
    hide: Hide
    unit: str
    most: float
    least: float = 0.0
    catalogued: bool = True
    placed: bool = False


def governed(videos: Videos, **numbers: float) -> Videos:
    """All videos with other numbers in their laws."""
    return tuple(video.governed_by(**numbers) for video in videos)


def with_disc(videos: Videos, disc: Disc) -> Videos:
    """All videos with a further disc that nobody sees."""
    return tuple(replace(video, hidden_discs=(*video.hidden_discs, disc)) for video in videos)


def with_walls(videos: Videos, walls: tuple[Wall, ...]) -> Videos:
    """All videos with further walls that nobody sees."""
    return tuple(replace(video, hidden_walls=(*video.hidden_walls, *walls)) for video in videos)


def direction(generator: np.random.Generator) -> tuple[float, float]:
    """A random unit vector."""
    angle = generator.uniform(0, 2 * np.pi)
    return float(np.cos(angle)), float(np.sin(angle))


def sign(generator: np.random.Generator) -> float:
    """1 or -1."""
    return float(generator.choice([-1.0, 1.0]))


def surface_tilt(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Strength: sine of the slope."""
    x, y = direction(generator)
    return governed(videos, tilt_x=strength * x, tilt_y=strength * y)


def linear_drag(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Strength: deceleration per speed."""
    return governed(videos, linear_drag=strength)


def wind(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Strength: speed of the air."""
    x, y = direction(generator)
    return governed(videos, wind_x=strength * x, wind_y=strength * y)


def magnus_curl(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Strength: sideways acceleration per spin and speed."""
    return governed(videos, curl=sign(generator) * strength)


def bowl(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Strength: acceleration per distance from the lowest point."""
    x, y = generator.uniform(-0.5, 0.5, 2)
    return governed(videos, bowl=strength, bowl_x=x, bowl_y=y)


def rotating_table(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Strength: rate of turning."""
    x, y = generator.uniform(-0.5, 0.5, 2)
    return governed(videos, rotation=sign(generator) * strength, rotation_x=x, rotation_y=y)


def pair_force(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Strength: force times squared distance; bodies attract or repel."""
    return governed(videos, pair_strength=sign(generator) * strength)


def friction_patch(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Strength: relative change of the friction on the patch; it lies on the way of a body."""
    radius = generator.uniform(0.3, 0.7)
    x, y = places.on_a_way(videos, generator)
    change = strength if generator.random() < 0.7 else -strength
    return governed(videos, patch_friction=change, patch_x=x, patch_y=y, patch_radius=radius)


def time_varying_friction(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Strength: relative change of the friction between the first stamp and one frame after the last, the time T."""
    change = sign(generator) * strength
    return tuple(v.governed_by(friction_trend=change * v.frame_rate / v.frames) for v in videos)


def mass_dependent_friction(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Strength: power of the mass in kg."""
    power = sign(generator) * strength
    return tuple(replace(v, friction=v.friction * v.mass**power) for v in videos)


def material_friction(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Strength: by what share one material's friction is larger."""
    rough = str(generator.choice(MATERIALS))
    return tuple(
        replace(v, friction=v.friction * (1 + strength * np.array([m == rough for m in v.materials]))) for v in videos
    )


def slip_to_roll(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Strength: friction coefficient of a sphere that slips; spheres are released without rolling.

    It has no value at which it vanishes. Below the rolling resistance it makes no sense, so that is the least.
    """
    if not any(Shape.SPHERE in video.shapes for video in videos):
        raise ValueError("slip_to_roll needs spheres; draw videos with some.")
    return governed(videos, slip_friction=strength)


def contact_friction(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Strength: friction coefficient of contacts."""
    return governed(videos, contact_friction=strength)


def springing_contacts(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Strength: friction coefficient of contacts that spring back across by 0.6 of their sliding where they stick."""
    return governed(videos, contact_friction=strength, tangential_restitution=0.6)


def speed_dependent_restitution(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Strength: power with which restitution falls."""
    return governed(videos, restitution_power=strength, restitution_speed=0.5)


def hidden_obstacle(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Strength: how far in m a disc reaches into the place where some body would have ended, square on its way."""
    return with_disc(videos, places.in_the_way(videos, strength, generator))


def wall(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Strength: how far in m one wall, or two, cut off the region that bodies would reach."""
    return with_walls(videos, places.cutting_off(videos, strength, generator))


def obstacle_met_often(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Strength: radius in m of a disc where many bodies pass; none is so small that it leaves little."""
    return with_disc(videos, places.in_many_ways(videos, strength, generator))


def wall_met_often(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Strength: how far in m a wall cuts off the region that bodies reach, where many go; it never leaves little."""
    return with_walls(videos, places.cutting_many(videos, strength, generator))


def external_impulse(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Strength: change of the velocity of one moving body of one video, once."""
    number, body, time = places.moving_moment(videos, generator)
    x, y = direction(generator)
    kicked = videos[number].governed_by(kick_time=time, kick_body=body, kick_x=strength * x, kick_y=strength * y)
    return (*videos[:number], kicked, *videos[number + 1 :])


def lost_frames(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Strength: time in s that passes without a frame, once in every video, in its first half."""
    after = [generator.integers(video.frames // 8, video.frames // 2) for video in videos]
    return tuple(
        replace(v, late=np.where(np.arange(v.frames) > k, strength, 0.0)) for v, k in zip(videos, after, strict=True)
    )


def frames_dropped_often(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Strength: how many frames, to the next whole number, are missing of every video; in its first two thirds."""
    found = []
    for video in videos:
        after = generator.permutation(np.arange(video.frames // 12, 2 * video.frames // 3))[: round(strength)]
        missing = (np.arange(video.frames)[:, None] > after).sum(axis=1)
        found.append(replace(video, late=missing / video.frame_rate))
    return tuple(found)


def irregular_frames(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Strength: standard deviation in s of the true times about the stamps; frames keep their order."""
    late = []
    for video in videos:
        most = 0.45 / video.frame_rate
        shift = np.clip(strength * generator.standard_normal(video.frames), -most, most)
        late.append(np.where(np.arange(video.frames) > 0, shift, 0.0))
    return tuple(replace(v, late=shift) for v, shift in zip(videos, late, strict=True))


def lens_distortion(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Strength: relative displacement per squared distance from the picture's middle."""
    change = sign(generator) * strength
    return tuple(replace(v, distortion=change) for v in videos)


def contact_radius_error(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Strength: share by which bodies touch farther out, or farther in, than their radii say."""
    factor = 1 + sign(generator) * strength
    return tuple(replace(v, touching=factor) for v in videos)


CATALOGUE: dict[str, Cause] = {
    "surface_tilt": Cause("surface_tilt", surface_tilt, "1", 0.2),
    "linear_drag": Cause("linear_drag", linear_drag, "1/s", 4.0),
    "wind": Cause("wind", wind, "m/s", 8.0),
    "magnus_curl": Cause("magnus_curl", magnus_curl, "1", 1.0),
    "bowl": Cause("bowl", bowl, "1/s^2", 2.0),
    "rotating_table": Cause("rotating_table", rotating_table, "rad/s", 1.0),
    "pair_force": Cause("pair_force", pair_force, "N m^2", 0.3),
    "friction_patch": Cause("friction_patch", friction_patch, "1", 8.0, placed=True),
    "time_varying_friction": Cause("time_varying_friction", time_varying_friction, "1", 4.0),
    "mass_dependent_friction": Cause("mass_dependent_friction", mass_dependent_friction, "1", 3.0),
    "material_friction": Cause("material_friction", material_friction, "1", 6.0),
    "slip_to_roll": Cause("slip_to_roll", slip_to_roll, "1", 0.2, least=ROLLING),
    "contact_friction": Cause("contact_friction", contact_friction, "1", 1.0),
    "speed_dependent_restitution": Cause("speed_dependent_restitution", speed_dependent_restitution, "1", 1.0),
    "hidden_obstacle": Cause("hidden_obstacle", hidden_obstacle, "m", 0.5, placed=True),
    "wall": Cause("wall", wall, "m", 1.0, placed=True),
    "external_impulse": Cause("external_impulse", external_impulse, "m/s", 2.0, placed=True),
    "clock_error": Cause("clock_error", lost_frames, "s", 0.5),
    "lens_distortion": Cause("lens_distortion", lens_distortion, "1/m^2", 0.08),
    "contact_radius_error": Cause("contact_radius_error", contact_radius_error, "1", 0.3),
}
"""The twenty causes by name."""

VARIANTS: dict[str, Cause] = {
    "frames_dropped_often": Cause("clock_error", frames_dropped_often, "1", 8.0, least=2.0),
    "irregular_frames": Cause("clock_error", irregular_frames, "s", 0.018),
    "obstacle_met_often": Cause(
        "hidden_obstacle", obstacle_met_often, "m", places.LARGEST_DISC, least=0.2, placed=True
    ),
    "restitution_between_walls": Cause("speed_dependent_restitution", speed_dependent_restitution, "1", 1.0),
    "springing_contacts": Cause("contact_friction", springing_contacts, "1", 1.0),
    "wall_met_often": Cause("wall", wall_met_often, "m", 1.0, least=0.3, placed=True),
}
"""Other ways in which a cause of the catalogue shows; the name to find is the cause's."""

"""Effects that the catalogue does not have, hidden in videos with a strength; one small function each."""

import numpy as np

from tests.discovery.causes import CATALOGUE, VARIANTS, Cause, Videos, direction, governed, sign


def grain(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """The table has a grain: friction is larger along one direction and smaller across it, by this share."""
    return governed(videos, grain=strength, grain_direction=generator.uniform(0, np.pi))


def cubic_drag(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Drag with the third power of the speed; strength: its coefficient."""
    return governed(videos, cubic_drag=strength)


def vortex(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """The air turns about a place; strength: its angular velocity there."""
    x, y = generator.uniform(-0.5, 0.5, 2)
    return governed(videos, vortex=sign(generator) * strength, vortex_x=x, vortex_y=y, vortex_radius=1.2)


def breakaway(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Friction grows by this share as a body becomes slow (Stribeck's law)."""
    return governed(videos, breakaway=strength, breakaway_speed=generator.uniform(0.2, 0.5))


def shaking(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """The table shakes to and fro; strength: the largest acceleration."""
    x, y = direction(generator)
    return governed(videos, shaking_x=strength * x, shaking_y=strength * y, shaking_rate=generator.uniform(0.4, 1.2))


def sticky_contacts(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Contacts slower than this speed do not rebound."""
    return governed(videos, sticking_speed=strength)


def placed_field(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """A force square to the velocity that grows with the place, as in a magnetic field; strength: its gradient."""
    x, y = direction(generator)
    return governed(videos, field_x=strength * x, field_y=strength * y)


def wear(videos: Videos, strength: float, generator: np.random.Generator) -> Videos:
    """Bodies remember: friction grows by this share with the way that a body has travelled."""
    return governed(videos, wear=strength, wear_length=generator.uniform(0.5, 1.0))


OTHERS: dict[str, Cause] = {
    "grain": Cause("grain", grain, "1", 0.95, catalogued=False),
    "cubic_drag": Cause("cubic_drag", cubic_drag, "s/m^2", 2.0, catalogued=False),
    "vortex": Cause("vortex", vortex, "rad/s", 8.0, catalogued=False),
    "breakaway": Cause("breakaway", breakaway, "1", 10.0, catalogued=False),
    "shaking": Cause("shaking", shaking, "m/s^2", 4.0, catalogued=False),
    "sticky_contacts": Cause("sticky_contacts", sticky_contacts, "m/s", 1.5, catalogued=False),
    "placed_field": Cause("placed_field", placed_field, "1/(m s)", 2.0, catalogued=False),
    "wear": Cause("wear", wear, "1", 10.0, catalogued=False),
}
"""Effects outside the catalogue by name; their verdict is `unknown`."""

ALL: dict[str, Cause] = CATALOGUE | VARIANTS | OTHERS
"""All that can be hidden."""

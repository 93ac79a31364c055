"""Data sets in which a cause can be found at all, and the true values of what is estimated of it."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from tests.discovery.data_set import ORDERS_FRICTION, ORDERS_RESTITUTION, DataSet, Truth, Wanted, draw
from tests.discovery.measurement import Measurement
from tests.discovery.scenes import ROLLING, SLIDING, Setting
from tests.discovery.videos import Video
from vrdp_prob.scene import Shape, Wall

SPINNING = ("magnus_curl", "contact_friction", "springing_contacts")
"""Causes that act by the spin, which is seen only where angles are measured."""
MET_OFTEN = ("obstacle_met_often", "wall_met_often")
"""Hidden things that many bodies shall meet, so that these must come about."""
BETWEEN_WALLS = ("restitution_between_walls",)
"""Causes that act in contacts, of which there are more between walls where bodies glide, and with no unknown mass."""
ARENA = 2.0
"""Half the side in m of the square between these walls."""
GLIDING = 0.2
"""Share of the usual friction and drag of a table on which bodies come about."""
WHICH = ("", "second_", "third_", "fourth_")
"""How names of parameters tell several walls apart."""
ROUGH = Measurement(outliers=0.05, dropout=0.1)
"""A poor tracker: gross errors and missing frames."""


def hide(
    ways: Sequence[str],
    *,
    seed: int,
    effect_size: float = 3.0,
    setting: Setting | None = None,
    measurement: Measurement | None = None,
) -> DataSet:
    """A data set with causes of one effect size, in a setting in which each of them shows.

    Parameters
    ----------
    ways
        Names of the causes; none for a null.
    seed
        Of everything that is drawn.
    effect_size
        What each leaves after a refit, in units of the noise.
    setting, measurement
        What kind of videos. Bodies have no friction or restitution of their own where that would hide a cause, tables
        brake less where bodies shall come about, walls are there where there shall be more contacts, and angles are
        measured where a cause acts by the spin.
    """
    setting, measurement = setting or Setting(), measurement or Measurement()
    if set(ways) & set(ORDERS_FRICTION):
        setting = replace(setting, friction_spread=0.0)
    if set(ways) & set(ORDERS_RESTITUTION):
        setting = replace(setting, restitution_spread=0.0)
    if set(ways) & set(SPINNING):
        measurement = replace(measurement, angles=True)
    if set(ways) & {*MET_OFTEN, *BETWEEN_WALLS}:
        setting = replace(setting, resistance=GLIDING * setting.resistance)
    if set(ways) & set(BETWEEN_WALLS):
        setting = replace(setting, arena=ARENA)
    wanted = [Wanted(way, effect_size=effect_size) for way in ways]
    return draw(wanted, seed=seed, setting=setting, measurement=measurement)


def true_values(truth: Truth, found: Mapping[str, float]) -> dict[str, float]:
    """True values of what discovery estimates, by its names, where both state the same number.

    Left out are numbers that need the scale of the masses, which tracks do not tell (the strength of a pair force), and
    those that the simulator divides among several parameters (restitution of hidden things, friction of materials).

    Parameters
    ----------
    truth
        What was hidden.
    found
        Estimates by name. Of two walls the truth is that of the one that is nearer to the estimate.
    """
    values: dict[str, float] = {}
    for cause in truth.causes:
        if cause.way in _OF_THE_TABLE:
            values |= _OF_THE_TABLE[cause.way](truth.videos[0])
        elif cause.way == "clock_error":
            values |= {f"lost_time[{name}]": cause.strength for name in _named(truth)}
        elif cause.way == "frames_dropped_often":
            values["dropped_frame_time"] = 1 / truth.videos[0].frame_rate
        elif cause.way == "irregular_frames":
            values["frame_jitter"] = cause.strength
        elif cause.way == "external_impulse":
            kicked = {name: video.laws for name, video in _named(truth).items() if np.isfinite(video.laws.kick_time)}
            for name, laws in kicked.items():
                body = chr(ord("a") + int(laws.kick_body))
                values |= {
                    f"impulse_time[{name}]": laws.kick_time,
                    f"impulse_x[{body} in {name}]": laws.kick_x,
                    f"impulse_y[{body} in {name}]": laws.kick_y,
                }
        elif cause.name == "wall":
            for which in WHICH:
                if f"{which}hidden_wall_distance" in found:
                    values |= _nearest_wall(truth.videos[0].hidden_walls, found, which)
    return {name: float(value) for name, value in values.items() if name in found}


def _named(truth: Truth) -> dict[str, Video]:
    return {f"v{k + 1:02d}": video for k, video in enumerate(truth.videos)}


def _nearest_wall(walls: Sequence[Wall], found: Mapping[str, float], which: str) -> dict[str, float]:
    """Distance (m) and direction (rad) of the wall that is nearest to one that was found, by its names."""
    names = [f"{which}{name}" for name in ("hidden_wall_distance", "hidden_wall_direction")]
    estimated = [found[name] for name in names]
    placed = [_placed(wall, estimated[1]) for wall in walls]
    return dict(zip(names, min(placed, key=lambda one: math.dist(one, estimated)), strict=True))


def _placed(wall: Wall, near: float) -> tuple[float, float]:
    """Distance (m) and direction (rad) of a wall, of the equal directions the one that is nearest to a given one."""
    direction = math.atan2(wall.x1 - wall.x2, wall.y2 - wall.y1)
    distance = wall.x1 * math.cos(direction) + wall.y1 * math.sin(direction)
    turns = round((near - direction) / math.pi)
    return distance * (-1) ** turns, direction + turns * math.pi


def _laws(**numbers: str) -> Callable[[Video], dict[str, float]]:
    """Values of estimates that are numbers of the laws, by the names of both."""
    return lambda video: {name: getattr(video.laws, number) for name, number in numbers.items()}


def _exponent(video: Video) -> dict[str, float]:
    """The power of the mass by which frictions differ, of bodies that differ in nothing else."""
    usual = np.where([shape is Shape.SPHERE for shape in video.shapes], ROLLING, SLIDING)
    return {"friction_mass_exponent": float(np.median(np.log(video.friction / usual) / np.log(video.mass)))}


def _disc(video: Video) -> dict[str, float]:
    disc = video.hidden_discs[0]
    return {"obstacle_x": disc.x, "obstacle_y": disc.y, "obstacle_radius": disc.radius}


def _lens(video: Video) -> dict[str, float]:
    x, y = video.centre
    return {"distortion": video.distortion, "lens_x": x, "lens_y": y}


_RESTITUTION = _laws(restitution_exponent="restitution_power", restitution_speed="restitution_speed")
_RUBBING = _laws(
    contact_friction="contact_friction",
    wall_friction="contact_friction",
    tangential_restitution="tangential_restitution",
)
_OF_THE_TABLE: Mapping[str, Callable[[Video], dict[str, float]]] = {
    "surface_tilt": _laws(tilt_x="tilt_x", tilt_y="tilt_y"),
    "linear_drag": _laws(linear_drag="linear_drag"),
    "wind": _laws(wind_x="wind_x", wind_y="wind_y"),
    "magnus_curl": _laws(curl="curl"),
    "bowl": _laws(bowl_stiffness="bowl", bowl_x="bowl_x", bowl_y="bowl_y"),
    "rotating_table": _laws(table_rotation="rotation", rotation_x="rotation_x", rotation_y="rotation_y"),
    "pair_force": _laws(pair_softening="pair_softening"),
    "friction_patch": _laws(
        patch_friction="patch_friction", patch_x="patch_x", patch_y="patch_y", patch_radius="patch_radius"
    ),
    "time_varying_friction": _laws(friction_trend="friction_trend"),
    "mass_dependent_friction": _exponent,
    "slip_to_roll": _laws(slip_friction="slip_friction"),
    "contact_friction": _RUBBING,
    "springing_contacts": _RUBBING,
    "speed_dependent_restitution": _RESTITUTION,
    "restitution_between_walls": _RESTITUTION,
    "hidden_obstacle": _disc,
    "obstacle_met_often": _disc,
    "lens_distortion": _lens,
    "contact_radius_error": lambda video: {"radius_error": video.touching - 1},
}
"""Causes whose numbers are the same in all videos."""

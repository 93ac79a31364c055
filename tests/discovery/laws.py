"""What moves the bodies of a hidden-effect video, as plain numbers that the compiled integrator takes.

Every number of `Laws` vanishes by default: bodies then have dry friction, drag in still air, a decaying spin and
frictionless contacts, and nothing else. SI units throughout.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

GRAVITY = 9.81


class Laws(NamedTuple):
    """Numbers of all laws of one video."""

    drag: float = 0.0
    spin_decay: float = 0.0
    # causes of the catalogue
    tilt_x: float = 0.0
    tilt_y: float = 0.0
    linear_drag: float = 0.0
    wind_x: float = 0.0
    wind_y: float = 0.0
    curl: float = 0.0
    bowl: float = 0.0
    bowl_x: float = 0.0
    bowl_y: float = 0.0
    rotation: float = 0.0
    rotation_x: float = 0.0
    rotation_y: float = 0.0
    pair_strength: float = 0.0
    pair_softening: float = 0.2
    patch_friction: float = 0.0
    patch_x: float = 0.0
    patch_y: float = 0.0
    patch_radius: float = 0.0
    friction_trend: float = 0.0
    slip_friction: float = 0.0
    contact_friction: float = 0.0
    tangential_restitution: float = 0.0
    restitution_power: float = 0.0
    restitution_speed: float = 0.5
    kick_time: float = np.inf
    kick_body: float = 0.0
    kick_x: float = 0.0
    kick_y: float = 0.0
    # effects outside the catalogue
    grain: float = 0.0
    grain_direction: float = 0.0
    cubic_drag: float = 0.0
    vortex: float = 0.0
    vortex_x: float = 0.0
    vortex_y: float = 0.0
    vortex_radius: float = 1.0
    breakaway: float = 0.0
    breakaway_speed: float = 0.3
    shaking_x: float = 0.0
    shaking_y: float = 0.0
    shaking_rate: float = 0.0
    sticking_speed: float = 0.0
    field_x: float = 0.0
    field_y: float = 0.0
    wear: float = 0.0
    wear_length: float = 1.0


class Things(NamedTuple):
    """All that can touch: first the bodies, then fixed discs, then walls (both with inverse mass 0).

    `radius` is the one at which things touch; `walls` has the ends x1, y1, x2, y2 of the last rows.
    """

    inverse_mass: Float[np.ndarray, "thing"]
    inverse_inertia: Float[np.ndarray, "thing"]
    radius: Float[np.ndarray, "thing"]
    square: Bool[np.ndarray, "thing"]
    restitution: Float[np.ndarray, "thing"]
    sphere: Bool[np.ndarray, "body"]
    friction: Float[np.ndarray, "body"]
    release: Float[np.ndarray, "body"]
    walls: Float[np.ndarray, "wall 4"]

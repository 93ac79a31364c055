# ruff: noqa: PLR0917  compiled functions take plain arrays by position
"""The laws of motion between contacts, one small compiled function each.

State of a thing: x, y, vx, vy, angle, spin, ux, uy (velocity at which a sphere would roll by its spin), way travelled.
`now` is the time in s since the video began.
"""

import numpy as np
from numba import njit

GRAVITY = 9.81
STILL = 1e-9
"""Speed in m/s below which a velocity has no direction."""
SOLID_SPHERE = 2.5
"""Mass times radius squared over the moment of inertia of a solid sphere."""


@njit(cache=True)
def tilt(laws):
    return GRAVITY * laws.tilt_x, GRAVITY * laws.tilt_y


@njit(cache=True)
def linear_drag(laws, body):
    return -laws.linear_drag * body[2], -laws.linear_drag * body[3]


@njit(cache=True)
def cubic_drag(laws, body):
    factor = -laws.cubic_drag * (body[2] ** 2 + body[3] ** 2)
    return factor * body[2], factor * body[3]


@njit(cache=True)
def air(laws, body):
    """Velocity of the air: wind, and a vortex that turns like a solid inside its radius and dies out beyond."""
    x, y = body[0] - laws.vortex_x, body[1] - laws.vortex_y
    turning = laws.vortex * np.exp(-(x * x + y * y) / (2 * laws.vortex_radius**2))
    return laws.wind_x - turning * y, laws.wind_y + turning * x


@njit(cache=True)
def air_drag(laws, body):
    flow_x, flow_y = air(laws, body)
    x, y = body[2] - flow_x, body[3] - flow_y
    factor = -laws.drag * np.sqrt(x * x + y * y)
    return factor * x, factor * y


@njit(cache=True)
def curl(laws, body):
    return -laws.curl * body[5] * body[3], laws.curl * body[5] * body[2]


@njit(cache=True)
def bowl(laws, body):
    return -laws.bowl * (body[0] - laws.bowl_x), -laws.bowl * (body[1] - laws.bowl_y)


@njit(cache=True)
def rotation(laws, body):
    """Coriolis and centrifugal acceleration; v x z is (vy, -vx)."""
    rate = laws.rotation
    x, y = body[0] - laws.rotation_x, body[1] - laws.rotation_y
    return 2 * rate * body[3] + rate * rate * x, -2 * rate * body[2] + rate * rate * y


@njit(cache=True)
def field(laws, body):
    """Force square to the velocity, as on a charge in a field that grows from 0 at the middle of the table."""
    strength = laws.field_x * body[0] + laws.field_y * body[1]
    return strength * body[3], -strength * body[2]


@njit(cache=True)
def shaking(laws, now):
    phase = np.sin(2 * np.pi * laws.shaking_rate * now)
    return laws.shaking_x * phase, laws.shaking_y * phase


@njit(cache=True)
def pair_pull(laws, state, k, count, released, inverse_mass):
    """Acceleration of a body by the attraction of all others that are there."""
    pull_x, pull_y = 0.0, 0.0
    if laws.pair_strength != 0.0:
        for other in range(count):
            if other != k and released[other]:
                x, y = state[other, 0] - state[k, 0], state[other, 1] - state[k, 1]
                factor = laws.pair_strength / (x * x + y * y + laws.pair_softening**2) ** 1.5
                pull_x += factor * x
                pull_y += factor * y
    return pull_x * inverse_mass, pull_y * inverse_mass


@njit(cache=True)
def on_patch(laws, body):
    return (body[0] - laws.patch_x) ** 2 + (body[1] - laws.patch_y) ** 2 < laws.patch_radius**2


@njit(cache=True)
def friction(laws, body, own, patch, now):
    """Friction coefficient of a body; it has the friction of a patch where `patch` says so."""
    speed = np.sqrt(body[2] ** 2 + body[3] ** 2)
    factor = max(0.0, 1 + laws.friction_trend * now)
    if patch:
        factor *= max(0.0, 1 + laws.patch_friction)
    if laws.grain != 0.0 and speed > STILL:
        factor *= 1 + laws.grain * np.cos(2 * (np.arctan2(body[3], body[2]) - laws.grain_direction))
    factor *= 1 + laws.breakaway * np.exp(-speed / laws.breakaway_speed)
    factor *= 1 + laws.wear * (1 - np.exp(-body[8] / laws.wear_length))
    return own * factor


@njit(cache=True)
def pushed(laws, state, k, count, released, inverse_mass, now):
    """Acceleration of a body by all but the table's friction."""
    body = state[k]
    x, y = pair_pull(laws, state, k, count, released, inverse_mass)
    for part in (
        tilt(laws),
        linear_drag(laws, body),
        cubic_drag(laws, body),
        air_drag(laws, body),
        curl(laws, body),
        bowl(laws, body),
        rotation(laws, body),
        field(laws, body),
        shaking(laws, now),
    ):
        x += part[0]
        y += part[1]
    return x, y


@njit(cache=True)
def moving_share(laws, sphere):
    """Share of a push that moves what does not slip; where the table can turn a sphere it turns with the rest."""
    return 1 / (1 + 1 / SOLID_SPHERE) if sphere and laws.slip_friction > 0 else 1.0


@njit(cache=True)
def against(x, y, start_x, start_y, amount):
    """Vector of a length against another one; past a turn back since the start it goes on as before the turn.

    So a step that reaches over a stop crosses it smoothly, and the stop is found by bisection.
    """
    length = np.sqrt(x * x + y * y)
    if length < STILL:
        return 0.0, 0.0
    if x * start_x + y * start_y < 0:
        amount = -amount
    return -amount * x / length, -amount * y / length

# ruff: noqa: PLR0917  compiled functions take plain arrays by position
"""The base motion between contacts and its contacts in closed form, for the refit of `refit.py`.

Here a state is x, y, vx, vy. Nothing of the integrator is used: it is what the refit is compared with.
"""

import numpy as np
from numba import njit

GRAVITY = 9.81


@njit(cache=True)
def base_motion(state, friction, drag, time):
    """State after a time of sliding in a straight line under dry friction and quadratic drag, to rest."""
    speed = np.sqrt(state[2] ** 2 + state[3] ** 2)
    if speed < 1e-9:
        return np.array([state[0], state[1], 0.0, 0.0])
    slowing = max(friction * GRAVITY, 1e-9)
    rate, ratio = np.sqrt(slowing * drag), np.sqrt(drag / slowing)
    start = np.arctan(speed * ratio)
    phase = start - rate * time
    if phase <= 0:
        way, final = -np.log(np.cos(start)) / drag, 0.0
    else:
        way, final = np.log(np.cos(phase) / np.cos(start)) / drag, np.tan(phase) / ratio
    x, y = state[2] / speed, state[3] / speed
    return np.array([state[0] + way * x, state[1] + way * y, final * x, final * y])


@njit(cache=True)
def base_contact(first, second, reach, mass, other_mass, restitution):
    """States of two discs as if they had met where their stated radii touch, at the same time after the contact."""
    x, y = first[0] - second[0], first[1] - second[1]
    vx, vy = first[2] - second[2], first[3] - second[3]
    square, middle = vx * vx + vy * vy, x * vx + y * vy
    inside = middle * middle - square * (x * x + y * y - reach * reach)
    shift = (-middle - np.sqrt(max(inside, 0.0))) / max(square, 1e-12)
    x, y = x + shift * vx, y + shift * vy
    length = np.sqrt(x * x + y * y)
    nx, ny = x / length, y / length
    impulse = -(1 + restitution) * (vx * nx + vy * ny) / (1 / mass + 1 / other_mass)
    a, b = impulse / mass, -impulse / other_mass
    return (
        np.array([first[0] - shift * a * nx, first[1] - shift * a * ny, first[2] + a * nx, first[3] + a * ny]),
        np.array([second[0] - shift * b * nx, second[1] - shift * b * ny, second[2] + b * nx, second[3] + b * ny]),
    )


@njit(cache=True)
def misfit(
    states, friction, drag, mass, restitution, radius, disc, piece_body, piece_time, seen, contacts, offset, weight
):
    """Residuals of one video: what contacts leave unexplained (weighted), then positions less base motion.

    `contacts` holds the bodies, the pieces before and the pieces after each contact, with -1 for the second at a wall;
    `offset` is added to the states before it. `seen` holds piece, time since the piece began, x and y of each
    observation.
    """
    result = np.zeros(8 * len(contacts) + 2 * len(seen))
    for k in range(len(contacts)):
        i, j, before_i, before_j, after_i, after_j = contacts[k]
        first = base_motion(states[before_i], friction[i], drag, piece_time[before_i]) + offset[k, 0]
        gap = states[after_i] - first
        if j < 0:
            result[8 * k : 8 * k + 2] = weight * gap[:2]
            continue
        second = base_motion(states[before_j], friction[j], drag, piece_time[before_j]) + offset[k, 1]
        other_gap = states[after_j] - second
        if disc[i] and disc[j]:
            share = restitution[i] * restitution[j]
            one, two = base_contact(first, second, radius[i] + radius[j], mass[i], mass[j], share)
            gap, other_gap = states[after_i] - one, states[after_j] - two
            result[8 * k : 8 * k + 4] = weight * gap
            result[8 * k + 4 : 8 * k + 8] = weight * other_gap
        else:
            result[8 * k : 8 * k + 2] = weight * gap[:2]
            result[8 * k + 2 : 8 * k + 4] = weight * other_gap[:2]
            result[8 * k + 4 : 8 * k + 6] = weight * (mass[i] * gap[2:] + mass[j] * other_gap[2:])
    for row in range(len(seen)):
        piece = int(seen[row, 0])
        place = base_motion(states[piece], friction[piece_body[piece]], drag, seen[row, 1])
        start = 8 * len(contacts) + 2 * row
        result[start], result[start + 1] = seen[row, 2] - place[0], seen[row, 3] - place[1]
    return result

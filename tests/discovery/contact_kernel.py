# ruff: noqa: PLR0917  compiled functions take plain arrays by position
"""Contacts of discs, squares and walls: gap, closing speed, and the impulse that parts them."""

import numpy as np
from numba import njit

from tests.inference.generator_kernel import from_square, nearest


@njit(cache=True)
def to_wall(state, i, radius, square, wall):
    """Gap between a body and a segment, normal from the wall to the body, and the touching point."""
    x, y = state[i, 0], state[i, 1]
    along_x, along_y = wall[2] - wall[0], wall[3] - wall[1]
    length = np.sqrt(along_x**2 + along_y**2)
    along_x, along_y = along_x / length, along_y / length
    if not square:
        share = min(max((x - wall[0]) * along_x + (y - wall[1]) * along_y, 0.0), length)
        px, py = wall[0] + share * along_x, wall[1] + share * along_y
        distance = max(np.sqrt((x - px) ** 2 + (y - py) ** 2), 1e-300)
        return distance - radius, (x - px) / distance, (y - py) / distance, px, py
    nx, ny = -along_y, along_x
    if (x - wall[0]) * nx + (y - wall[1]) * ny < 0:
        nx, ny = -nx, -ny
    best, best_x, best_y, point_x, point_y = np.inf, nx, ny, x, y
    for corner in range(4):
        angle = state[i, 4] + (corner + 0.5) * np.pi / 2
        px, py = x + np.sqrt(2.0) * radius * np.cos(angle), y + np.sqrt(2.0) * radius * np.sin(angle)
        gap = (px - wall[0]) * nx + (py - wall[1]) * ny
        if 0 <= (px - wall[0]) * along_x + (py - wall[1]) * along_y <= length and gap < best:
            best, point_x, point_y = gap, px, py
    for end in range(2):
        px, py = wall[2 * end], wall[2 * end + 1]
        gap, out_x, out_y = from_square(x, y, state[i, 4], radius, px, py)
        if gap < best:
            best, best_x, best_y, point_x, point_y = gap, -out_x, -out_y, px, py
    return best, best_x, best_y, point_x, point_y


@njit(cache=True)
def between(state, i, j, things):
    """Gap of two things (the first a body), normal from the second to the first, and the touching point."""
    first_wall = len(things.radius) - len(things.walls)
    if j >= first_wall:
        return to_wall(state, i, things.radius[i], things.square[i], things.walls[j - first_wall])
    return nearest(state, i, j, things.radius, things.square)


@njit(cache=True)
def far(state, i, j, things):
    """Whether two things are certainly apart."""
    first_wall = len(things.radius) - len(things.walls)
    if j >= first_wall:
        wall = things.walls[j - first_wall]
        across = (state[i, 0] - wall[0]) * (wall[3] - wall[1]) - (state[i, 1] - wall[1]) * (wall[2] - wall[0])
        return across**2 > 2.01 * things.radius[i] ** 2 * ((wall[2] - wall[0]) ** 2 + (wall[3] - wall[1]) ** 2)
    x, y = state[i, 0] - state[j, 0], state[i, 1] - state[j, 1]
    return x * x + y * y > 2.01 * (things.radius[i] + things.radius[j]) ** 2


@njit(cache=True)
def slip_at(state, i, px, py, tx, ty):
    """Speed of the touching point of a thing in a direction, and the lever of the direction."""
    lever = (px - state[i, 0]) * ty - (py - state[i, 1]) * tx
    return state[i, 2] * tx + state[i, 3] * ty + state[i, 5] * lever, lever


@njit(cache=True)
def opening_speed(state, i, j, things):
    """Gap of two things, and the speed at which it grows."""
    gap, nx, ny, px, py = between(state, i, j, things)
    return gap, slip_at(state, i, px, py, nx, ny)[0] - slip_at(state, j, px, py, nx, ny)[0]


@njit(cache=True)
def restitution(laws, closing, product):
    """Share of the closing speed with which two things part."""
    if closing < laws.sticking_speed:
        return 0.0
    return min(1.0, product * (1 + closing / laws.restitution_speed) ** -laws.restitution_power)


@njit(cache=True)
def mobility(things, i, j, lever_i, lever_j):
    """Change of the relative speed per impulse."""
    straight = things.inverse_mass[i] + things.inverse_mass[j]
    return straight + lever_i**2 * things.inverse_inertia[i] + lever_j**2 * things.inverse_inertia[j]


@njit(cache=True)
def apply(state, i, things, impulse, x, y, lever):
    state[i, 2] += impulse * things.inverse_mass[i] * x
    state[i, 3] += impulse * things.inverse_mass[i] * y
    state[i, 5] += impulse * things.inverse_inertia[i] * lever


@njit(cache=True)
def part(state, i, j, things, laws, slowest):
    """Impulse of a contact, in place; things that close slower than `slowest` do not bounce, and are set apart."""
    gap, nx, ny, px, py = between(state, i, j, things)
    speed_i, lever_i = slip_at(state, i, px, py, nx, ny)
    speed_j, lever_j = slip_at(state, j, px, py, nx, ny)
    closing = speed_j - speed_i
    presses = closing < slowest
    share = 0.0 if presses else restitution(laws, closing, things.restitution[i] * things.restitution[j])
    impulse = (1 + share) * closing / mobility(things, i, j, lever_i, lever_j)
    apply(state, i, things, impulse, nx, ny, lever_i)
    apply(state, j, things, -impulse, nx, ny, lever_j)
    rub(state, i, j, things, laws, laws.contact_friction * impulse, (nx, ny, px, py))
    if presses and gap < 0:
        total = things.inverse_mass[i] + things.inverse_mass[j]
        for thing, sign in ((i, 1.0), (j, -1.0)):
            state[thing, 0] -= sign * gap * things.inverse_mass[thing] / total * nx
            state[thing, 1] -= sign * gap * things.inverse_mass[thing] / total * ny


@njit(cache=True)
def rub(state, i, j, things, laws, limit, contact):
    """Tangential impulse of a contact, in place: against the sliding, at most the limit, at most what turns it back."""
    if limit == 0.0:
        return
    nx, ny, px, py = contact
    tx, ty = -ny, nx
    speed_i, lever_i = slip_at(state, i, px, py, tx, ty)
    speed_j, lever_j = slip_at(state, j, px, py, tx, ty)
    turning = (1 + laws.tangential_restitution) * (speed_j - speed_i) / mobility(things, i, j, lever_i, lever_j)
    impulse = min(max(turning, -limit), limit)
    apply(state, i, things, impulse, tx, ty, lever_i)
    apply(state, j, things, -impulse, tx, ty, lever_j)

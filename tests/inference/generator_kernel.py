# ruff: noqa: PLR0912, PLR0917  compiled functions take plain arrays, and inlining is left to the reader of one loop
"""The integrator of `generator.py`, compiled: small steps, and bisection where two outlines begin to overlap.

State of a body: x, y, vx, vy, angle, spin. SI units. Nothing of the simulator is used here.
"""

import numpy as np
from numba import njit

TOLERANCE = 1e-10
TOUCHING = 1e-8
SLOWEST = 5e-4
"""Bodies that close slower than this (m/s) press on each other and go on together, instead of bouncing without end."""


@njit(cache=True)
def integrate(
    state, release, mass, radius, square, restitution, deceleration, drag, spin_deceleration, times, step, longest
):
    """States at all times, and contacts (time, first, second) in order, at most `longest` of them."""
    count = len(state)
    states = np.empty((len(times), count, 6))
    contacts = np.empty((longest, 3))
    found = 0
    state = state.copy()
    now = times[0]
    touching = np.empty((count * count, 2), np.int64)
    for frame in range(len(times)):
        while now < times[frame] - 1e-12:
            size = min(step, times[frame] - now)
            for body in range(count):
                if release[body] > now + 1e-12:
                    size = min(size, release[body] - now)
            released = release <= now + 1e-9
            target = free(state, released, deceleration, drag, spin_deceleration, size)
            pairs = 0
            for i in range(count):
                for j in range(i + 1, count):
                    if released[i] and released[j] and overlapping(target, i, j, radius, square):
                        touching[pairs, 0], touching[pairs, 1] = i, j
                        pairs += 1
            if pairs == 0:
                state, now = target, now + size
                continue
            low, high = 0.0, size
            while high - low > TOLERANCE:
                middle = (low + high) / 2
                trial = free(state, released, deceleration, drag, spin_deceleration, middle)
                hit = False
                for k in range(pairs):
                    hit = hit or overlapping(trial, touching[k, 0], touching[k, 1], radius, square)
                if hit:
                    high = middle
                else:
                    low = middle
            touched = free(state, released, deceleration, drag, spin_deceleration, high)
            fastest = 0.0
            for k in range(pairs):
                i, j = touching[k, 0], touching[k, 1]
                if overlapping(touched, i, j, radius, square):
                    fastest = max(fastest, -closing_speed(touched, i, j, radius, square)[0])
            if fastest < SLOWEST:
                for k in range(pairs):
                    push(target, touching[k, 0], touching[k, 1], mass, radius, square, 0.0)
                state, now = target, now + size
                continue
            state, now = touched, now + high
            for k in range(pairs):
                i, j = touching[k, 0], touching[k, 1]
                gap, _, _, _, _ = nearest(state, i, j, radius, square)
                if gap < TOUCHING and closing_speed(state, i, j, radius, square)[0] < 0:
                    push(state, i, j, mass, radius, square, restitution[i] * restitution[j])
                    if found < longest:
                        contacts[found, 0], contacts[found, 1], contacts[found, 2] = now, i, j
                        found += 1
        states[frame] = state
    return states, contacts[:found]


@njit(cache=True)
def free(state, released, deceleration, drag, spin_deceleration, step):
    """One midpoint step of the free motion; a body that would turn back has stopped."""
    result = state.copy()
    for k in range(len(state)):
        if not released[k]:
            continue
        vx, vy = state[k, 2], state[k, 3]
        ax, ay = acceleration(vx, vy, deceleration[k], drag)
        goes_on = (vx + step * ax) * vx + (vy + step * ay) * vy > 0
        ax, ay = acceleration(vx + step / 2 * ax, vy + step / 2 * ay, deceleration[k], drag)
        new_x, new_y = vx + step * ax, vy + step * ay
        if goes_on:
            result[k, 0] += step * (vx + new_x) / 2
            result[k, 1] += step * (vy + new_y) / 2
            result[k, 2], result[k, 3] = new_x, new_y
        else:
            result[k, 2], result[k, 3] = 0.0, 0.0
        spin = np.sign(state[k, 5]) * max(abs(state[k, 5]) - spin_deceleration * step, 0.0)
        result[k, 4] += step * (state[k, 5] + spin) / 2
        result[k, 5] = spin
    return result


@njit(cache=True)
def acceleration(vx, vy, deceleration, drag):
    speed = np.sqrt(vx * vx + vy * vy)
    factor = deceleration / max(speed, 1e-300) + drag * speed
    return -factor * vx, -factor * vy


@njit(cache=True)
def overlapping(state, i, j, radius, square):
    """Whether two bodies overlap and still close."""
    dx, dy = state[i, 0] - state[j, 0], state[i, 1] - state[j, 1]
    if dx * dx + dy * dy > 2.01 * (radius[i] + radius[j]) ** 2:
        return False
    return nearest(state, i, j, radius, square)[0] < 0 and closing_speed(state, i, j, radius, square)[0] < 0


@njit(cache=True)
def from_square(x, y, angle, half, px, py):
    """Signed distance of a point from a square and the outward direction there."""
    cosine, sine = np.cos(angle), np.sin(angle)
    across, along = cosine * (px - x) + sine * (py - y), -sine * (px - x) + cosine * (py - y)
    beyond_x, beyond_y = abs(across) - half, abs(along) - half
    if beyond_x > 0 or beyond_y > 0:
        out_x, out_y = max(beyond_x, 0.0), max(beyond_y, 0.0)
        distance = np.sqrt(out_x * out_x + out_y * out_y)
        normal_x, normal_y = np.sign(across) * out_x / distance, np.sign(along) * out_y / distance
    else:
        distance = max(beyond_x, beyond_y)
        normal_x = np.sign(across) if beyond_x >= beyond_y else 0.0
        normal_y = 0.0 if beyond_x >= beyond_y else np.sign(along)
    return distance, cosine * normal_x - sine * normal_y, sine * normal_x + cosine * normal_y


@njit(cache=True)
def nearest(state, i, j, radius, square):
    """Gap, normal from j to i, and the contact point."""
    xi, yi, xj, yj = state[i, 0], state[i, 1], state[j, 0], state[j, 1]
    if not square[i] and not square[j]:
        dx, dy = xi - xj, yi - yj
        distance = np.sqrt(dx * dx + dy * dy)
        nx, ny = dx / distance, dy / distance
        return distance - radius[i] - radius[j], nx, ny, xj + radius[j] * nx, yj + radius[j] * ny
    if not square[i]:
        gap, nx, ny = from_square(xj, yj, state[j, 4], radius[j], xi, yi)
        return gap - radius[i], nx, ny, xi - radius[i] * nx, yi - radius[i] * ny
    if not square[j]:
        gap, nx, ny = from_square(xi, yi, state[i, 4], radius[i], xj, yj)
        return gap - radius[j], -nx, -ny, xj - radius[j] * nx, yj - radius[j] * ny
    best, best_x, best_y, point_x, point_y = np.inf, 0.0, 0.0, 0.0, 0.0
    for turn in range(2):
        a, b, sign = (j, i, 1.0) if turn == 0 else (i, j, -1.0)
        reach = np.sqrt(2.0) * radius[b]
        for corner in range(4):
            angle = state[b, 4] + (corner + 0.5) * np.pi / 2
            px, py = state[b, 0] + reach * np.cos(angle), state[b, 1] + reach * np.sin(angle)
            gap, nx, ny = from_square(state[a, 0], state[a, 1], state[a, 4], radius[a], px, py)
            if gap < best:
                best, best_x, best_y, point_x, point_y = gap, sign * nx, sign * ny, px, py
    return best, best_x, best_y, point_x, point_y


@njit(cache=True)
def closing_speed(state, i, j, radius, square):
    """Speed at which the contact opens (negative: closes), the normal, and both levers."""
    _, nx, ny, px, py = nearest(state, i, j, radius, square)
    lever_i = (px - state[i, 0]) * ny - (py - state[i, 1]) * nx
    lever_j = (px - state[j, 0]) * ny - (py - state[j, 1]) * nx
    speed = (state[i, 2] - state[j, 2]) * nx + (state[i, 3] - state[j, 3]) * ny
    return speed + state[i, 5] * lever_i - state[j, 5] * lever_j, nx, ny, lever_i, lever_j


@njit(cache=True)
def push(state, i, j, mass, radius, square, restitution):
    """Apply the impulse of a frictionless contact in place; discs have no lever, so only squares need an inertia."""
    speed, nx, ny, lever_i, lever_j = closing_speed(state, i, j, radius, square)
    inertia_i, inertia_j = 2 / 3 * mass[i] * radius[i] ** 2, 2 / 3 * mass[j] * radius[j] ** 2
    inverse = 1 / mass[i] + 1 / mass[j] + lever_i**2 / inertia_i + lever_j**2 / inertia_j
    impulse = -(1 + restitution) * speed / inverse
    state[i, 2] += impulse / mass[i] * nx
    state[i, 3] += impulse / mass[i] * ny
    state[j, 2] -= impulse / mass[j] * nx
    state[j, 3] -= impulse / mass[j] * ny
    state[i, 5] += impulse * lever_i / inertia_i
    state[j, 5] -= impulse * lever_j / inertia_j

# ruff: noqa: PLR0917, PLR0912  compiled functions take plain arrays by position; one loop holds the time
"""The integrator: Runge-Kutta steps of one size, cut by bisection where something happens inside a step.

What can happen: two things touch, a body stops or turns back, a sphere has begun to roll, a body comes onto a patch or
leaves it. A body at rest stays while what pushes it is at most its friction. Nothing of the simulator is used here.
"""

import numpy as np
from numba import njit

from tests.discovery.contact_kernel import far, opening_speed, part
from tests.discovery.laws_kernel import GRAVITY, SOLID_SPHERE, STILL, against, friction, moving_share, on_patch, pushed

COLUMNS = 9
RESTS, MOVES, SLIPS = 0, 1, 2
TOLERANCE = 1e-10
TOUCHING = 1e-8
SLOWEST = 5e-3
"""Things that close slower than this (m/s) press on each other and go on together, instead of bouncing without end."""
MOST_CUTS = 20_000


@njit(cache=True)
def rates(start, state, now, things, laws, mode, patch, released):
    """Time derivative of a state that is reached in the step from `start`."""
    result = np.zeros((len(mode), COLUMNS))
    for k in range(len(mode)):
        if not released[k]:
            continue
        body = state[k]
        result[k, 4] = body[5]
        result[k, 5] = -laws.spin_decay * np.sign(start[k, 5])
        if mode[k] == RESTS:
            continue
        result[k, 0], result[k, 1] = body[2], body[3]
        result[k, 8] = np.sqrt(body[2] ** 2 + body[3] ** 2)
        x, y = pushed(laws, state, k, len(mode), released, things.inverse_mass[k], now)
        if mode[k] == SLIPS:
            from_x, from_y = start[k, 2] - start[k, 6], start[k, 3] - start[k, 7]
            amount = laws.slip_friction * GRAVITY
            slip_x, slip_y = against(body[2] - body[6], body[3] - body[7], from_x, from_y, amount)
            result[k, 6], result[k, 7] = -SOLID_SPHERE * slip_x, -SOLID_SPHERE * slip_y
        else:
            amount = friction(laws, body, things.friction[k], patch[k], now) * GRAVITY
            share = moving_share(laws, things.sphere[k])
            x, y = share * x, share * y
            if result[k, 8] < STILL:
                slip_x, slip_y = against(x, y, x, y, min(amount, np.sqrt(x * x + y * y)))
            else:
                slip_x, slip_y = against(body[2], body[3], start[k, 2], start[k, 3], amount)
        result[k, 2], result[k, 3] = x + slip_x, y + slip_y
    return result


@njit(cache=True)
def step(state, now, size, things, laws, mode, patch, released):
    """State after a classical Runge-Kutta step."""
    count = len(mode)
    result = state.copy()
    first = rates(state, state, now, things, laws, mode, patch, released)
    result[:count] = state[:count] + size / 2 * first
    second = rates(state, result, now + size / 2, things, laws, mode, patch, released)
    result[:count] = state[:count] + size / 2 * second
    third = rates(state, result, now + size / 2, things, laws, mode, patch, released)
    result[:count] = state[:count] + size * third
    fourth = rates(state, result, now + size, things, laws, mode, patch, released)
    result[:count] = state[:count] + size / 6 * (first + 2 * second + 2 * third + fourth)
    for k in range(count):
        if result[k, 5] * state[k, 5] < 0:
            result[k, 5] = 0.0
        if mode[k] == MOVES:
            result[k, 6], result[k, 7] = result[k, 2], result[k, 3]
    return result


@njit(cache=True)
def held(state, k, now, things, laws, patch, released):
    """Whether friction holds a body that has no velocity."""
    x, y = pushed(laws, state, k, len(patch), released, things.inverse_mass[k], now)
    push = moving_share(laws, things.sphere[k]) * np.sqrt(x * x + y * y)
    return push <= friction(laws, state[k], things.friction[k], patch[k], now) * GRAVITY


@njit(cache=True)
def turned_back(x, y, start_x, start_y):
    moved = start_x**2 + start_y**2
    return (moved > 1e-16 and x * start_x + y * start_y <= 0) or x * x + y * y < 1e-14 < moved


@njit(cache=True)
def turns(start, state, k, mode):
    """Whether a body has turned back, or stopped."""
    return mode[k] == MOVES and turned_back(state[k, 2], state[k, 3], start[k, 2], start[k, 3])


@njit(cache=True)
def rolls(start, state, k, mode):
    slip_x, slip_y = state[k, 2] - state[k, 6], state[k, 3] - state[k, 7]
    return mode[k] == SLIPS and turned_back(slip_x, slip_y, start[k, 2] - start[k, 6], start[k, 3] - start[k, 7])


@njit(cache=True)
def closing(state, things, released):
    """The largest speed at which overlapping things close; negative where none do."""
    fastest = -1.0
    for i in range(len(released)):
        for j in range(i + 1, len(things.radius)):
            there = released[i] and (j >= len(released) or released[j])
            if there and not far(state, i, j, things):
                gap, opening = opening_speed(state, i, j, things)
                if gap < 0 and opening < 0:
                    fastest = max(fastest, -opening)
    return fastest


@njit(cache=True)
def happens(start, state, things, laws, mode, patch, released):
    """Whether something happened that cuts the step."""
    for k in range(len(mode)):
        if not released[k]:
            continue
        if on_patch(laws, state[k]) != patch[k] or rolls(start, state, k, mode) or turns(start, state, k, mode):
            return True
    return closing(state, things, released) >= SLOWEST


@njit(cache=True)
def settle(start, state, now, things, laws, mode, patch, released):
    """Change the ways of moving after what happened, contacts apart."""
    for k in range(len(mode)):
        if not released[k]:
            continue
        if turns(start, state, k, mode) and held(state, k, now, things, laws, patch, released):
            mode[k] = RESTS
            state[k, 2] = state[k, 3] = state[k, 6] = state[k, 7] = 0.0
        elif rolls(start, state, k, mode):
            mode[k] = MOVES
            state[k, 6], state[k, 7] = state[k, 2], state[k, 3]
        patch[k] = on_patch(laws, state[k])


@njit(cache=True)
def set_moving(state, k, laws, things, mode):
    """Way of moving of a body that something pushed."""
    slip = np.sqrt((state[k, 2] - state[k, 6]) ** 2 + (state[k, 3] - state[k, 7]) ** 2)
    mode[k] = SLIPS if things.sphere[k] and laws.slip_friction > 0 and slip > 1e-6 else MOVES


@njit(cache=True)
def bounce(state, now, things, laws, mode, released, contacts, around, found):
    """Part all things that touch and close; contacts that bounce are noted. Returns how many are noted then."""
    count = len(mode)
    for i in range(count):
        for j in range(i + 1, len(things.radius)):
            there = released[i] and (j >= count or released[j])
            if not there or far(state, i, j, things):
                continue
            gap, opening = opening_speed(state, i, j, things)
            if gap < TOUCHING and opening < 0:
                noted = opening <= -SLOWEST and found < len(contacts)
                if noted:
                    around[found, 0, 0], around[found, 0, 1] = state[i], state[j]
                part(state, i, j, things, laws, SLOWEST)
                set_moving(state, i, laws, things, mode)
                if j < count:
                    set_moving(state, j, laws, things, mode)
                if noted:
                    contacts[found, 0], contacts[found, 1], contacts[found, 2] = now, i, j
                    around[found, 1, 0], around[found, 1, 1] = state[i], state[j]
                    found += 1
    return found


@njit(cache=True)
def integrate(start, things, laws, times, size, most_contacts):
    """States of all things at all times, contacts (time, first, second), the states around them, and completeness."""
    state = start.copy()
    count = len(things.release)
    states = np.empty((len(times), count, COLUMNS))
    contacts, around = np.empty((most_contacts, 3)), np.empty((most_contacts, 2, 2, COLUMNS))
    mode, patch, released = np.zeros(count, np.int64), np.zeros(count, np.bool_), np.zeros(count, np.bool_)
    found, cuts, now, kicked = 0, 0, 0.0, False
    for frame in range(len(times)):
        while now < times[frame] - 1e-12:
            length = min(size, times[frame] - now)
            if not kicked and laws.kick_time > now + 1e-12:
                length = min(length, laws.kick_time - now)
            elif not kicked:
                kicked = True
                body = int(laws.kick_body)
                state[body, 2] += laws.kick_x
                state[body, 3] += laws.kick_y
                set_moving(state, body, laws, things, mode)
            for k in range(count):
                if not released[k] and things.release[k] > now + 1e-12:
                    length = min(length, things.release[k] - now)
                elif not released[k]:
                    released[k], patch[k] = True, on_patch(laws, state[k])
                    if state[k, 2] ** 2 + state[k, 3] ** 2 > 0:
                        set_moving(state, k, laws, things, mode)
            for k in range(count):
                if released[k] and mode[k] == RESTS and not held(state, k, now, things, laws, patch, released):
                    mode[k] = MOVES
            target = step(state, now, length, things, laws, mode, patch, released)
            if happens(state, target, things, laws, mode, patch, released):
                cuts += 1
                low = 0.0
                while length - low > TOLERANCE:
                    middle = (low + length) / 2
                    target = step(state, now, middle, things, laws, mode, patch, released)
                    if happens(state, target, things, laws, mode, patch, released):
                        length = middle
                    else:
                        low = middle
                target = step(state, now, length, things, laws, mode, patch, released)
                settle(state, target, now + length, things, laws, mode, patch, released)
            now += length
            found = bounce(target, now, things, laws, mode, released, contacts, around, found)
            state = target
            if cuts > MOST_CUTS or found == most_contacts:
                return states, contacts[:found], around[:found], False
        states[frame] = state[:count]
    return states, contacts[:found], around[:found], True

"""Two bodies that press on each other, from closed-form constraints and scipy's integrator; shares no code."""

import numpy as np
from scipy.integrate import solve_ivp

GRAVITY = 9.81


def _braking(velocity: np.ndarray, friction: float) -> np.ndarray:
    return -friction * GRAVITY * velocity / np.hypot(*velocity)


def two_discs(
    position: np.ndarray,
    velocity: np.ndarray,
    mass: np.ndarray,
    friction: np.ndarray,
    times: np.ndarray,
) -> tuple[np.ndarray, float]:
    """Positions [time, body, 2] of two discs in touch, and the time at which they part (infinity if they do not).

    Their distance is kept: with the unit vector n from the first to the second and the relative velocity w, which is
    across n, the force f along n follows from `n . (a2 - a1) + w^2 / distance = 0`.
    """
    distance = np.hypot(*(position[1] - position[0]))

    def force(state: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        place, speed = state[:4].reshape(2, 2), state[4:].reshape(2, 2)
        normal = (place[1] - place[0]) / np.hypot(*(place[1] - place[0]))
        own = np.array([_braking(speed[i], friction[i]) for i in range(2)])
        across = np.sum((speed[1] - speed[0]) ** 2) / distance
        return -(normal @ (own[1] - own[0]) + across) / (1 / mass).sum(), normal, own

    def rates(_: float, state: np.ndarray) -> np.ndarray:
        size, normal, own = force(state)
        own[0] -= size * normal / mass[0]
        own[1] += size * normal / mass[1]
        return np.concatenate([state[4:], own.ravel()])

    def parting(_: float, state: np.ndarray) -> float:
        return force(state)[0]

    parting.terminal = True
    start = np.concatenate([position.ravel(), velocity.ravel()])
    solution = solve_ivp(
        rates, (times[0], times[-1]), start, "DOP853", rtol=1e-12, atol=1e-13, events=parting, dense_output=True
    )
    parted = solution.t_events[0][0] if len(solution.t_events[0]) else np.inf
    return solution.sol(np.minimum(times, solution.t[-1]))[:4].T.reshape(-1, 2, 2), parted


def disc_on_side(
    state: np.ndarray,
    mass: np.ndarray,
    inertia: float,
    friction: np.ndarray,
    times: np.ndarray,
    *,
    spin_braking: float,
) -> np.ndarray:
    """States (x, y, angle of the square, x, y of the disc) [time, 5] of a disc that presses on a square's side.

    The side faces the direction (-1, 0) of the square. `state` has these five numbers and their rates. The gap is
    `m . (p - q) - const` with the side's normal m, the disc's centre p and the square's q, so with the tangent k (m
    turned by +90 degrees), the spin s and the relative velocity w: `m . (ap - aq) + s' k . (p - q) + 2 s k . w
    - s^2 m . (p - q) = 0`.
    """

    def rates(_: float, now: np.ndarray) -> np.ndarray:
        square, angle, disc = now[0:2], now[2], now[3:5]
        velocity, spin, other = now[5:7], now[7], now[8:10]
        normal = -np.array([np.cos(angle), np.sin(angle)])
        tangent = np.array([-normal[1], normal[0]])
        between, relative = disc - square, other - velocity
        own, own_disc = _braking(velocity, friction[0]), _braking(other, friction[1])
        turning = -np.sign(spin) * spin_braking
        lever = tangent @ between
        free = normal @ (own_disc - own) + turning * lever + 2 * spin * tangent @ relative - spin**2 * normal @ between
        size = -free / (1 / mass[0] + 1 / mass[1] + lever**2 / inertia)
        return np.concatenate(
            [
                now[5:],
                own - size * normal / mass[0],
                [turning + size * lever / inertia],
                own_disc + size * normal / mass[1],
            ]
        )

    solution = solve_ivp(rates, (times[0], times[-1]), state, "DOP853", rtol=1e-12, atol=1e-13, dense_output=True)
    return solution.sol(times)[:5].T

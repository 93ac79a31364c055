"""An independent simulator of discs: scipy's integrator with root finding, sharing no code with the project's."""

import numpy as np
from scipy.integrate import solve_ivp

GRAVITY = 9.81
REST = 1e-9
SLOWEST_REBOUND = 0.05


def rollout(scene: dict[str, np.ndarray], times: np.ndarray) -> tuple[np.ndarray, list[tuple[float, int, int]], float]:
    """Positions [time, body, 2], contacts (time, first, second), and the time of the first grazing one.

    The scene has `position` and `velocity` [body, 2], `mass`, `restitution`, `radius`, `friction` [body] and `drag`.
    """
    state = np.concatenate([scene["position"].ravel(), scene["velocity"].ravel()])
    count = len(scene["mass"])
    pairs = [(i, j) for i in range(count) for j in range(i + 1, count)]
    result = np.zeros((len(times), count, 2))
    contacts: list[tuple[float, int, int]] = []
    now, moving, grazing = times[0], np.linalg.norm(scene["velocity"], axis=1) > REST, np.inf
    while True:
        events = [_gap(i, j, scene, count) for i, j in pairs if moving[i] or moving[j]]
        events += [_stop(i, state, count) for i in range(count) if moving[i]]
        active = [pair for pair in pairs if moving[pair[0]] or moving[pair[1]]]
        stopping = [i for i in range(count) if moving[i]]
        solution = solve_ivp(
            _rates,
            (now, times[-1]),
            state,
            "DOP853",
            rtol=1e-11,
            atol=1e-12,
            events=events or None,
            dense_output=True,
            args=(scene, moving, count),
            max_step=0.02,
        )
        end = solution.t[-1]
        inside = (times >= now) & (times <= end)
        if inside.any():
            result[inside] = solution.sol(times[inside])[: 2 * count].T.reshape(-1, count, 2)
        grazing = min(grazing, _grazing(solution, active, scene, count))
        if solution.status != 1:
            return result, contacts, grazing
        state, now = solution.y[:, -1].copy(), end
        index = next(k for k, found in enumerate(solution.t_events) if len(found))
        if index < len(active):
            rebound = _collide(state, *active[index], scene, count)
            contacts.append((end, *active[index]))
            # So slow that both may meet again within a step of the root finding.
            grazing = min(grazing, end + 1e-9) if rebound < SLOWEST_REBOUND else grazing
            moving = np.linalg.norm(state[2 * count :].reshape(count, 2), axis=1) > REST
        else:
            moving = moving.copy()
            moving[stopping[index - len(active)]] = False
        velocity = state[2 * count :].reshape(count, 2)
        velocity[~moving] = 0


def _rates(_: float, state: np.ndarray, scene: dict[str, np.ndarray], moving: np.ndarray, count: int) -> np.ndarray:
    velocity = state[2 * count :].reshape(count, 2)
    speed = np.maximum(np.linalg.norm(velocity, axis=1), 1e-14)
    size = (scene["friction"] * GRAVITY + scene["drag"] * speed**2) * moving
    return np.concatenate([(velocity * moving[:, None]).ravel(), (-velocity / speed[:, None] * size[:, None]).ravel()])


def _gap(i: int, j: int, scene: dict[str, np.ndarray], count: int):
    def gap(_: float, state: np.ndarray, *__: object) -> float:
        place = state[: 2 * count].reshape(count, 2)
        return np.linalg.norm(place[j] - place[i]) - scene["radius"][i] - scene["radius"][j]

    gap.terminal, gap.direction = True, -1
    return gap


def _stop(i: int, start: np.ndarray, count: int):
    first = start[2 * count :].reshape(count, 2)[i].copy()

    def along(_: float, state: np.ndarray, *__: object) -> float:
        return state[2 * count :].reshape(count, 2)[i] @ first

    along.terminal, along.direction = True, -1
    return along


def _collide(state: np.ndarray, i: int, j: int, scene: dict[str, np.ndarray], count: int) -> float:
    place, velocity = state[: 2 * count].reshape(count, 2), state[2 * count :].reshape(count, 2)
    normal = (place[j] - place[i]) / np.linalg.norm(place[j] - place[i])
    closing = (velocity[i] - velocity[j]) @ normal
    mass = scene["mass"]
    impulse = (1 + scene["restitution"][i] * scene["restitution"][j]) * closing / (1 / mass[i] + 1 / mass[j])
    velocity[i] -= impulse / mass[i] * normal
    velocity[j] += impulse / mass[j] * normal
    return float((velocity[j] - velocity[i]) @ normal)


def _grazing(solution, pairs: list[tuple[int, int]], scene: dict[str, np.ndarray], count: int) -> float:
    """Time of the first approach within 1e-4 m of a contact that is none, or that closes slower than 0.02 m/s."""
    time = np.linspace(solution.t[0], solution.t[-1], 400)
    states = solution.sol(time)
    place = states[: 2 * count].T.reshape(-1, count, 2)
    first = np.inf
    for i, j in pairs:
        gap = np.linalg.norm(place[:, j] - place[:, i], axis=1) - scene["radius"][i] - scene["radius"][j]
        lowest = (gap[1:-1] < gap[:-2]) & (gap[1:-1] <= gap[2:]) & (gap[1:-1] < 1e-3)
        if lowest.any():
            first = min(first, time[1:-1][lowest][0])
        if gap[-1] < 1e-9 and abs(gap[-2] / (time[-1] - time[-2])) < 0.02:
            first = min(first, time[-1])
    return first

"""An independent event-driven simulator of discs, squares and walls; shares no code with the project's."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from tests.simulator import reference_geometry as geometry
from tests.simulator.reference_motion import Laws, Path, path
from tests.simulator.reference_search import NOTHING, Found, clear_from, first_contact, penetrates

GRID = 0.04
"""Longest interval in s between two samples of a gap."""
SLOWEST = 0.02
"""Closing speed in m/s below which a contact is in doubt: bodies in touch that close slower than 0.01 m/s may press."""
TOGETHER = 1e-6
"""Time in s within which two contacts of a body are one event."""
INERTIA = {"sphere": 2 / 5, "cylinder": 1 / 2, "cube": 2 / 3}


@dataclass(frozen=True)
class Scene:
    """Bodies and walls as plain numbers; walls are numbered after the bodies."""

    shapes: tuple[str, ...]
    position: np.ndarray
    velocity: np.ndarray
    angle: np.ndarray
    spin: np.ndarray
    release_time: np.ndarray
    mass: np.ndarray
    restitution: np.ndarray
    radius: np.ndarray
    parameters: Mapping[str, float]
    rolling_share: np.ndarray
    walls: np.ndarray
    wall_restitution: np.ndarray


@dataclass(frozen=True)
class Contact:
    """A contact; `second` counts on from the bodies for a wall."""

    time: float
    first: int
    second: int


@dataclass
class Result:
    """States [time, body, (x, y, angle, vx, vy, spin)], contacts, and the time from which on all is in doubt.

    The last contact may be at that time: bodies that do not part leave in doubt what comes next.
    """

    states: np.ndarray
    contacts: list[Contact] = field(default_factory=list)
    doubtful_from: float = np.inf


def rollout(scene: Scene, times: np.ndarray, *, closed: bool = False) -> Result:
    """Simulate a scene until the first event that is in doubt; `closed` uses closed forms instead of an integrator."""
    return _Simulation(scene, np.asarray(times, dtype=float), closed).run()


class _Simulation:
    def __init__(self, scene: Scene, times: np.ndarray, closed: bool) -> None:
        count, self.horizon = len(scene.shapes), float(times[-1])
        self.scene, self.times, self.count, self.closed = scene, times, count, closed
        outline = {"cube": geometry.square, "cylinder": geometry.disc, "sphere": geometry.disc}
        self.outlines = [outline[shape](size) for shape, size in zip(scene.shapes, scene.radius, strict=True)]
        self.outlines += [geometry.wall(line) for line in scene.walls]
        self.reach = np.array([outline.reach for outline in self.outlines])
        self.laws = [Laws.of(shape, scene.parameters) for shape in scene.shapes]
        self.inverse_mass = np.concatenate([1 / scene.mass, np.zeros(len(scene.walls))])
        factors = np.array([INERTIA[shape] for shape in scene.shapes])
        inertia = factors * scene.mass * scene.radius**2
        self.inverse_inertia = np.concatenate([1 / inertia, np.zeros(len(scene.walls))])
        self.restitution = np.concatenate([scene.restitution, scene.wall_restitution])
        self.grid = np.arange(times[0], self.horizon + GRID, GRID).clip(max=self.horizon)
        self.paths: list[Path] = []
        self.samples: list[np.ndarray] = []
        self.last_contact = np.full(count, -np.inf)
        self.found: dict[tuple[int, int], Found] = {}
        self.result = Result(np.zeros((len(times), count, 6)))

    def run(self) -> Result:
        for body in range(self.count):
            self._release(body)
        everything = range(self.count + len(self.scene.walls))
        for i in range(self.count):
            for j in everything[i + 1 :]:
                self.found[i, j] = self._search(i, j, max(self._born(i), self._born(j)), met=False)
        while True:
            doubt = min(min((one.doubt for one in self.found.values()), default=np.inf), self._doubtful_paths())
            times = [(one.contact, pair) for pair, one in self.found.items()]
            time, (i, j) = min(times, default=(np.inf, (0, 0)))
            if min(time, doubt) > self.horizon:
                break
            if doubt <= time or not self._collide(i, j, time):
                self.result.doubtful_from = min(doubt, time)
                break
        for body in range(self.count):
            self._write(body)
        return self.result

    def _born(self, body: int) -> float:
        return max(self.times[0], self.scene.release_time[body]) if body < self.count else self.times[0]

    def _doubtful_paths(self) -> float:
        return min(path.doubtful_from for path in self.paths)

    def _release(self, body: int) -> None:
        scene = self.scene
        velocity = scene.velocity[body]
        along, across = scene.rolling_share[body]
        rolling = along * velocity + across * np.array([-velocity[1], velocity[0]])
        state = np.array([*scene.position[body], scene.angle[body], *velocity, scene.spin[body], *rolling])
        self.paths.append(self._path(body, scene.release_time[body], state))
        self.samples.append(self.paths[body].at(self.grid))

    def _path(self, body: int, time: float, state: np.ndarray) -> Path:
        return path(time, state, self.laws[body], self.horizon, closed=self.closed)

    def _poses(self, body: int, times: np.ndarray) -> np.ndarray:
        if body >= self.count:
            return np.zeros((*times.shape, 3))
        return self.paths[body].at(times)[..., :3]

    def _gap(self, i: int, j: int, times: np.ndarray) -> np.ndarray:
        return geometry.gap(self.outlines[i], self.outlines[j], self._poses(i, times), self._poses(j, times))

    def _fastest(self, body: int, start: float) -> float:
        """Bound on the speed of any point of a body from a time on."""
        if body >= self.count:
            return 0.0
        states = self.samples[body][self.grid >= start - GRID]
        speed, spin = np.hypot(states[:, 3], states[:, 4]).max(initial=0.0), np.abs(states[:, 5]).max(initial=0.0)
        # Between two samples no law here changes a speed by more.
        return float(1.02 * speed + 0.1 + spin * self.reach[body])

    def _search(self, i: int, j: int, time: float, *, met: bool) -> Found:
        """Next contact of a pair from a time on; `met` where it is in touch then."""
        if time >= self.horizon:
            return NOTHING
        gap = partial(self._gap, i, j)
        if met:
            opened = clear_from(gap, time, self.horizon)
            if isinstance(opened, Found):
                return opened
            time = opened
        fastest = self._fastest(i, time) + self._fastest(j, time)
        edges = np.concatenate([[time], self.grid[self.grid > time]])
        low, high = edges[:-1], edges[1:]
        if j < self.count:
            # The circles around both are apart for most of the time.
            later = self.grid > time
            first = np.concatenate([self._poses(i, edges[:1])[:, :2], self.samples[i][later, :2]])
            second = np.concatenate([self._poses(j, edges[:1])[:, :2], self.samples[j][later, :2]])
            apart = np.hypot(*(first - second).T) - self.reach[i] - self.reach[j]
            near = apart[:-1] + apart[1:] - fastest * (high - low) < 1e-3
            low, high = low[near], high[near]
        return first_contact(gap, low, high, fastest)

    def _write(self, body: int) -> None:
        """Write the states of a body from the start of its path on; before its release it is shown as released."""
        start = self.paths[body].start
        rows = self.times >= (start if start > self.scene.release_time[body] else -np.inf)
        self.result.states[rows, body] = self.paths[body].at(self.times[rows])[:, :6]

    def _collide(self, i: int, j: int, time: float) -> bool:
        """Change the velocities of two bodies that meet; False where this is in doubt."""
        gap = partial(self._gap, i, j)
        movers = [body for body in (i, j) if body < self.count]
        here = np.array([time])
        states = [self.paths[body].at(here)[0] if body < self.count else np.zeros(8) for body in (i, j)]
        touch = geometry.touch(self.outlines[i], self.outlines[j], states[0][:3], states[1][:3])
        if touch.doubtful or not penetrates(gap, time) or (time - self.last_contact[movers] < TOGETHER).any():
            return False
        closing = self._impulse(i, j, states, touch)
        if closing < SLOWEST:
            return False
        self.result.contacts.append(Contact(time, i, j))
        for body in movers:
            self._write(body)
            self.last_contact[body] = time
            self.paths[body] = self._path(body, time, states[0 if body == i else 1])
            self.samples[body] = self.paths[body].at(self.grid)
        for pair in self.found:
            if pair[0] in movers or pair[1] in movers:
                since = max(time, self._born(pair[0]), self._born(pair[1]))
                self.found[pair] = self._search(*pair, since, met=pair == (i, j))
        return True

    def _impulse(self, i: int, j: int, states: list[np.ndarray], touch: geometry.Touch) -> float:
        """Change both states by the impulse of a contact; returns the closing speed.

        With the inverse masses m, the inverse inertias k and the arms r across, an impulse J changes the relative
        velocity at the touching point by the matrix sum(m 1 + k r r^T) times J.

        The horizontal axis of a sphere that rolls at u is z x u / R. On the first body the point at R n moves with
        omega x R n = -(u n) z, on the second that at -R n with (u n) z. An impulse P z up on the second changes omega
        by its lever's torque over (2/5) M R^2, so each u n by (5/2) P / M.
        """
        arms = [np.array([-(touch.point - state[:2])[1], (touch.point - state[:2])[0]]) for state in states]
        inverse = sum(
            self.inverse_mass[body] * np.eye(2) + self.inverse_inertia[body] * np.outer(arm, arm)
            for body, arm in zip((i, j), arms, strict=True)
        )
        velocities = [state[3:5] + state[5] * arm for state, arm in zip(states, arms, strict=True)]
        normal, relative = touch.normal, velocities[1] - velocities[0]
        closing = -relative @ normal
        bounce = min(1.0, self.restitution[i] * self.restitution[j])
        size = (1 + bounce) * closing / (normal @ inverse @ normal)
        tangent = np.array([-normal[1], normal[0]])
        coefficient = "contact_friction" if max(i, j) < self.count else "wall_friction"
        limit = self.scene.parameters.get(coefficient, 0.0) * size
        share = 1 + self.scene.parameters.get("tangential_restitution", 0.0)
        rolling = [(body, state) for body, state in zip((i, j), states, strict=True) if self._rolls(body)]
        slide = np.array(
            [tangent @ (relative + inverse @ normal * size), sum(state[6:8] @ normal for _, state in rolling)]
        )
        softness = np.array([tangent @ inverse @ tangent, sum(2.5 * self.inverse_mass[body] for body, _ in rolling)])
        speed = np.hypot(*slide)
        across, upward = [
            -sliding * min(share / soft, limit / speed) if sliding else 0.0
            for sliding, soft in zip(slide, softness, strict=True)
        ]
        impulse = size * normal + across * tangent
        for body, state, arm, sign in zip((i, j), states, arms, (-1, 1), strict=True):
            state[3:5] += sign * self.inverse_mass[body] * impulse
            state[5] += sign * self.inverse_inertia[body] * (arm @ impulse)
            if self._rolls(body):
                state[6:8] += 2.5 * self.inverse_mass[body] * upward * normal
        return float(closing)

    def _rolls(self, body: int) -> bool:
        """Whether a body has a spin about horizontal axes."""
        return body < self.count and self.laws[body].slip_friction is not None

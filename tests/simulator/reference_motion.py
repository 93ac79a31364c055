"""Free motion of one body, in closed form and integrated by scipy; no code of the project.

A state is (x, y, angle, vx, vy, spin, ux, uy); u is the velocity at which a sphere would roll with its present spin.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.integrate import OdeSolution, solve_ivp

GRAVITY = 9.81
REST = 1e-9
"""Speed in m/s that counts as none."""
NEARLY = 1e-8
"""Speed in m/s at which a motion whose direction turns ever faster is taken to its end."""
ACCURACY = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-13, "max_step": 0.25, "dense_output": True}


@dataclass(frozen=True)
class Laws:
    """Accelerations of one body in SI units."""

    friction: float
    air_drag: float = 0.0
    spin_braking: float = 0.0
    linear_drag: float = 0.0
    tilt: tuple[float, float] = (0.0, 0.0)
    slip_friction: float | None = None

    @classmethod
    def of(cls, shape: str, parameters: Mapping[str, float]) -> "Laws":
        """Laws of a body from its shape and the named parameters of the scene."""
        sphere = shape == "sphere"
        slip = parameters.get("slip_friction")
        return cls(
            friction=GRAVITY * parameters["rolling_resistance" if sphere else "sliding_friction"],
            air_drag=parameters["air_drag"],
            spin_braking=parameters["angular_drag"],
            linear_drag=parameters.get("linear_drag", 0.0),
            tilt=(GRAVITY * parameters.get("tilt_x", 0.0), GRAVITY * parameters.get("tilt_y", 0.0)),
            slip_friction=GRAVITY * slip if sphere and slip is not None else None,
        )

    @property
    def rolling_share(self) -> float:
        """Share of an outer force that accelerates a body; a solid sphere that rolls puts 2/7 into its spin."""
        return 1.0 if self.slip_friction is None else 5 / 7

    @property
    def plain(self) -> bool:
        """Whether the body moves by friction and air drag alone, along a straight line."""
        return self.linear_drag == 0 and self.tilt == (0.0, 0.0) and self.slip_friction is None


@dataclass(frozen=True)
class Path:
    """Motion from a time on, until a contact ends it."""

    start: float
    state: np.ndarray
    laws: Laws
    horizon: float

    def at(self, times: np.ndarray) -> np.ndarray:
        """States [time, 8]."""
        after = np.maximum(np.asarray(times, dtype=float) - self.start, 0.0)
        result = np.zeros((*after.shape, 8))
        result[..., [0, 1, 3, 4, 6, 7]] = self.plane(after)
        spin, braking = self.state[5], self.laws.spin_braking
        lasting = np.minimum(after, abs(spin) / braking) if braking > 0 else after
        result[..., 5] = np.where(lasting < after, 0.0, spin - np.sign(spin) * braking * lasting)
        result[..., 2] = self.state[2] + spin * lasting - np.sign(spin) * braking * lasting**2 / 2
        return result

    def plane(self, after: np.ndarray) -> np.ndarray:
        """(x, y, vx, vy, ux, uy) at times after the start."""
        raise NotImplementedError

    @property
    def doubtful_from(self) -> float:
        """Time from which on it is in doubt whether the body rests."""
        return np.inf


@dataclass(frozen=True)
class ClosedPath(Path):
    """Friction and quadratic drag: v' = -(f + c v^2) along a line has v = sqrt(f/c) tan(const - sqrt(f c) t)."""

    def plane(self, after: np.ndarray) -> np.ndarray:
        velocity = self.state[3:5]
        speed = np.hypot(*velocity)
        result = np.zeros((*after.shape, 6))
        result[..., 0:2] = self.state[0:2]
        if speed <= REST:
            return result
        friction, drag = max(self.laws.friction, 1e-12), max(self.laws.air_drag, 1e-9)
        rate, first = np.sqrt(friction * drag), np.arctan(speed * np.sqrt(drag / friction))
        phase = np.maximum(first - rate * after, 0.0)
        way = np.log(np.cos(phase) / np.cos(first)) / drag
        result[..., 0:2] += way[..., None] * velocity / speed
        result[..., 2:4] = (np.sqrt(friction / drag) * np.tan(phase))[..., None] * velocity / speed
        return result


@dataclass(frozen=True)
class _Piece:
    start: float
    solution: OdeSolution
    slips: bool


def _direction(angle: np.ndarray | float) -> np.ndarray:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


@dataclass(frozen=True)
class IntegratedPath(Path):
    """All laws, integrated in polar coordinates of the velocity (or of the slip), in which a stop is smooth.

    Times of the pieces count from the start of the path.
    """

    doubts: list[float] = field(default_factory=list)

    @property
    def doubtful_from(self) -> float:
        self.pieces  # noqa: B018  (finds the doubts)
        return min(self.doubts, default=np.inf)

    @cached_property
    def pieces(self) -> list[_Piece]:
        """Slipping, rolling or sliding, and nothing after the stop."""
        pieces: list[_Piece] = []
        now, place, velocity, rolling = 0.0, self.state[0:2], self.state[3:5], self.state[6:8]
        end = self.horizon - self.start
        while now < end:
            slips = self.laws.slip_friction is not None and np.hypot(*(velocity - rolling)) > REST
            if not slips and self._rests(velocity):
                break
            solved = self._slip(now, end, place, velocity, rolling) if slips else self._glide(now, end, place, velocity)
            pieces.append(_Piece(now, solved.sol, slips))
            now = solved.t[-1]
            last = self._unfold(solved.y[:, -1], slips)
            # The slip vanishes while v + (2/5) u goes on smoothly.
            place, velocity = last[0:2], (last[2:4] + 0.4 * last[4:6]) / 1.4 if slips else last[2:4]
            if not slips and solved.status == 1:
                if not self._rests(0 * velocity):
                    self.doubts.append(self.start + now)
                velocity = 0 * velocity
            rolling = velocity
            if not slips and solved.status == 1:
                pieces.append(_Piece(now, _still(np.concatenate([place, np.zeros(4)])), True))
                break
        return pieces

    def _rests(self, velocity: np.ndarray) -> bool:
        return bool(
            np.hypot(*velocity) <= REST and self.laws.rolling_share * np.hypot(*self.laws.tilt) <= self.laws.friction
        )

    def _external(self, velocity: np.ndarray) -> np.ndarray:
        return np.array(self.laws.tilt) - (self.laws.linear_drag + self.laws.air_drag * np.hypot(*velocity)) * velocity

    def _glide(self, now: float, end: float, place: np.ndarray, velocity: np.ndarray):
        """Friction against the velocity, in (x, y, speed, heading)."""
        laws, share, tilted = self.laws, self.laws.rolling_share, self.laws.tilt != (0.0, 0.0)
        tilt_x, tilt_y = laws.tilt

        def rates(_: float, y: np.ndarray) -> list[float]:
            speed, cosine, sine = y[2], np.cos(y[3]), np.sin(y[3])
            drag = (laws.linear_drag + laws.air_drag * abs(speed)) * speed
            turning = (tilt_y * cosine - tilt_x * sine) / max(speed, 1e-12) if tilted else 0.0
            along = share * (tilt_x * cosine + tilt_y * sine - drag) - laws.friction
            return [speed * cosine, speed * sine, along, share * turning]

        def stops(_: float, y: np.ndarray) -> float:
            return y[2] - (NEARLY if tilted else 0.0)

        stops.terminal, stops.direction = True, -1
        speed = np.hypot(*velocity)
        heading = np.arctan2(*(velocity if speed > REST else laws.tilt)[::-1])
        return solve_ivp(rates, (now, end), [*place, speed, heading], events=stops, **ACCURACY)

    def _slip(self, now: float, end: float, place: np.ndarray, velocity: np.ndarray, rolling: np.ndarray):
        """Friction against the slip v - u, in (x, y, vx, vy, length of the slip, its heading)."""

        def rates(_: float, y: np.ndarray) -> list[float]:
            external, ahead = self._external(y[2:4]), _direction(y[5])
            acceleration = external - self.laws.slip_friction * ahead
            shrinking = external @ ahead - 3.5 * self.laws.slip_friction
            turning = (external[1] * ahead[0] - external[0] * ahead[1]) / max(y[4], 1e-12)
            return [y[2], y[3], *acceleration, shrinking, turning]

        def rolls(_: float, y: np.ndarray) -> float:
            return y[4] - NEARLY

        rolls.terminal, rolls.direction = True, -1
        slip = velocity - rolling
        start = [*place, *velocity, np.hypot(*slip), np.arctan2(slip[1], slip[0])]
        return solve_ivp(rates, (now, end), start, events=rolls, **ACCURACY)

    def _unfold(self, y: np.ndarray, slips: bool) -> np.ndarray:
        """(x, y, vx, vy, ux, uy) from the coordinates of a piece [coordinate, ...]."""
        if slips:
            velocity = y[2:4]
            return np.concatenate([y[0:4], velocity - y[4] * _direction(y[5]).T])
        velocity = y[2] * _direction(y[3]).T
        return np.concatenate([y[0:2], velocity, velocity])

    def plane(self, after: np.ndarray) -> np.ndarray:
        flat = after.ravel()
        result = np.zeros((len(flat), 6))
        result[:, 0:2] = self.state[0:2]
        for index, piece in enumerate(self.pieces):
            until = self.pieces[index + 1].start if index + 1 < len(self.pieces) else np.inf
            inside = (flat >= piece.start) & (flat < until)
            if inside.any():
                result[inside] = self._unfold(piece.solution(flat[inside]), piece.slips).T
        return result.reshape(*after.shape, 6)


def _still(values: np.ndarray):
    """A solution that stays; its slip is 0."""
    return lambda times: np.repeat(values[:, None], len(times), axis=1)


def path(start: float, state: np.ndarray, laws: Laws, horizon: float, *, closed: bool) -> Path:
    """Motion from a state on; `closed` asks for the closed form, which only plain laws have."""
    if closed and not laws.plain:
        raise ValueError("only friction and air drag have a closed form here")
    return (ClosedPath if closed else IntegratedPath)(start, state, laws, horizon)

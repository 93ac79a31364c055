"""Missing accelerations that are looked for in free flight: patterns over the plane, the speed, the time, the spin."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from vrdp_prob.discovery.fitted_motion import FittedMotion
from vrdp_prob.scene import Body, Shape, Tracks

SOFTENING = 0.2
"""Distance in m below which a force between bodies no longer grows."""
SLOWEST_SHAKING, MOST_SHAKINGS = 0.5, 16
"""Periods in the longest video of the slowest shaking that is looked for, and how many multiples of it at most."""
FASTEST_SHAKING = 0.25
"""Shaking is looked for up to this share of the frame rate."""
DECAY = 0.4
"""Share of the typical speed over which what acts on slow bodies alone fades."""

Field = Callable[[FittedMotion], Float[np.ndarray, "time body 2"]]


@dataclass(frozen=True)
class Pattern:
    """A pattern of accelerations.

    Parameters
    ----------
    name
        Name, unique among all patterns.
    field
        Accelerations for amplitude 1, of all bodies at all frames.
    unit
        Unit of the amplitude; the product with the field is in m/s^2.
    """

    name: str
    field: Field
    unit: str


@dataclass(frozen=True)
class Scales:
    """Typical numbers of some videos, by which patterns are scaled.

    Parameters
    ----------
    speed
        Median speed in m/s of what moves.
    middle
        Middle in m of the places where bodies moved.
    materials
        All materials that are stated.
    shapes
        All shapes.
    weighed
        Whether all masses are stated.
    turning
        Whether angles are measured.
    longest, step
        Duration of the longest video, and typical time between frames, in s.
    own_friction
        Whether every body has a friction of its own, so that what it is made of does not show in the residuals.
    """

    speed: float
    middle: Float[np.ndarray, "2"]
    materials: tuple[str, ...]
    shapes: frozenset[Shape]
    weighed: bool
    turning: bool
    longest: float
    step: float
    own_friction: bool

    @property
    def frequencies(self) -> dict[str, float]:
        """Frequencies in Hz of shaking that is looked for, by the name of their patterns."""
        slowest = SLOWEST_SHAKING / self.longest
        count = max(0, min(MOST_SHAKINGS, int(FASTEST_SHAKING / self.step / slowest)))
        return {f"shaking {k}": k * slowest for k in range(1, count + 1)}

    @classmethod
    def of(cls, motions: Sequence[FittedMotion], *, own_friction: bool) -> "Scales":
        """Those of some motions."""
        seen = [motion.moving & motion.tracks.seen for motion in motions]
        speeds = np.concatenate([m.speed[s] for m, s in zip(motions, seen, strict=True)])
        places = np.concatenate([m.position[s] for m, s in zip(motions, seen, strict=True)])
        bodies = [body for motion in motions for body in motion.tracks.bodies]
        return cls(
            float(np.median(speeds)) if len(speeds) else 1.0,
            np.median(places, axis=0) if len(places) else np.zeros(2),
            tuple(sorted({body.material for body in bodies if body.material is not None})),
            frozenset(body.shape for body in bodies),
            all(body.mass is not None for body in bodies),
            all(motion.tracks.angles is not None for motion in motions),
            max(float(motion.times[-1] - motion.times[0]) for motion in motions),
            float(np.median(np.concatenate([np.diff(motion.times) for motion in motions]))),
            own_friction,
        )


def patterns(scales: Scales) -> Iterator[Pattern]:
    """All patterns that videos of such scales can show."""
    for axis, letter in enumerate("xy"):
        yield Pattern(f"push {letter}", _push(axis), "m/s^2")
        yield Pattern(f"push {letter} speed", _push(axis, lambda m: m.speed), "1/s")
        for other, name in enumerate("xy"):
            yield Pattern(f"push {letter} {name}", _push(axis, _place(scales, other)), "1/s^2")
    for name, factor, unit in _factors(scales):
        yield Pattern(f"along {name}", _along(factor), unit)
    yield Pattern("across", _across(lambda m: np.ones_like(m.speed)), "m/s^2")
    yield Pattern("across speed", _across(lambda m: m.speed), "1/s")
    for axis, letter in enumerate("xy"):
        yield Pattern(f"across speed {letter}", _across(_turning(_place(scales, axis))), "1/(m s)")
    yield Pattern("across speed time", _across(_turning(_clock)), "1/s^2")
    yield Pattern("across cosine", _across(_heading(np.cos)), "m/s^2")
    yield Pattern("across sine", _across(_heading(np.sin)), "m/s^2")
    if scales.turning:
        yield Pattern("across speed spin", _across(_turning(lambda m: m.spin)), "1")
    unit = "m^3/s^2 kg" if scales.weighed else "m^3/s^2"
    yield Pattern("others square", _towards_others(2, weighed=scales.weighed), unit)
    yield from _shaking(scales)
    yield Pattern("others", _towards_others(1, weighed=scales.weighed), "m^2/s^2")


def _shaking(scales: Scales) -> Iterator[Pattern]:
    """Pushes to and fro, at several frequencies and in both phases."""
    for name, frequency in scales.frequencies.items():
        rate = 2 * np.pi * frequency
        for axis, letter in enumerate("xy"):
            yield Pattern(f"{name} cosine {letter}", _push(axis, _wave(np.cos, rate)), "m/s^2")
            yield Pattern(f"{name} sine {letter}", _push(axis, _wave(np.sin, rate)), "m/s^2")


Factor = Callable[[FittedMotion], Float[np.ndarray, "time body"]]


def _factors(scales: Scales) -> Iterator[tuple[str, Factor, str]]:
    """What an acceleration along the velocity may depend on."""
    yield "speed", lambda m: m.speed, "1/s"
    yield "slowness", lambda m: np.exp(-m.speed / (DECAY * scales.speed)), "m/s^2"
    yield "cosine", _heading(np.cos), "m/s^2"
    yield "sine", _heading(np.sin), "m/s^2"
    yield "x", _place(scales, 0), "1/s^2"
    yield "y", _place(scales, 1), "1/s^2"
    yield "distance", lambda m: _place(scales, 0)(m) ** 2 + _place(scales, 1)(m) ** 2, "1/(m s^2)"
    yield "time", _clock, "m/s^3"
    yield "way", _way, "1/s^2"
    if scales.turning:
        yield "spin", lambda m: np.abs(m.spin), "m/s"
    if scales.own_friction:
        return
    if {Shape.CUBE, Shape.CYLINDER} <= scales.shapes:
        yield "cube", _of_body(lambda body: float(body.shape is Shape.CUBE)), "m/s^2"
    for material in scales.materials[1:]:
        yield f"material {material}", _of_body(_is_made_of(material)), "m/s^2"
    if scales.weighed:
        yield "mass", _of_body(lambda body: float(np.log(body.mass or 1.0))), "m/s^2"


def _push(axis: int, factor: Factor | None = None) -> Field:
    def field(motion: FittedMotion) -> Float[np.ndarray, "time body 2"]:
        size = np.ones_like(motion.speed) if factor is None else factor(motion)
        return size[..., None] * np.eye(2)[axis]

    return field


def _along(factor: Factor) -> Field:
    return lambda motion: factor(motion)[..., None] * motion.direction


def _across(factor: Factor) -> Field:
    return lambda motion: factor(motion)[..., None] * motion.sideways


def _wave(function: Callable[..., Float[np.ndarray, "..."]], rate: float) -> Factor:
    return lambda motion: function(rate * _clock(motion))


def _turning(factor: Factor) -> Factor:
    return lambda motion: factor(motion) * motion.speed


def _place(scales: Scales, axis: int) -> Factor:
    return lambda motion: motion.position[..., axis] - scales.middle[axis]


def _clock(motion: FittedMotion) -> Float[np.ndarray, "time body"]:
    """Time since the first frame in s."""
    return np.broadcast_to((motion.times - motion.times[0])[:, None], motion.speed.shape)


def _way(motion: FittedMotion) -> Float[np.ndarray, "time body"]:
    """Way travelled since the first frame in m."""
    steps = np.diff(motion.times, prepend=motion.times[0])[:, None]
    return np.cumsum(steps * motion.speed, axis=0)


def _heading(function: Callable[..., Float[np.ndarray, "..."]]) -> Factor:
    """Function of twice the direction of motion, which is alike for both senses."""
    return lambda motion: function(2 * np.arctan2(motion.velocity[..., 1], motion.velocity[..., 0]))


def _of_body(value: Callable[[Body], float]) -> Factor:
    def factor(motion: FittedMotion) -> Float[np.ndarray, "time body"]:
        return np.broadcast_to(np.array([value(body) for body in motion.tracks.bodies]), motion.speed.shape)

    return factor


def _is_made_of(material: str) -> Callable[[Body], float]:
    return lambda body: float(body.material == material)


def _towards_others(power: int, *, weighed: bool) -> Field:
    """Towards all other bodies that are there, falling with a power of their distance."""

    def field(motion: FittedMotion) -> Float[np.ndarray, "time body 2"]:
        apart = motion.position[:, None] - motion.position[:, :, None]
        squares = (apart**2).sum(axis=-1) + SOFTENING**2
        here = _there(motion.tracks)[:, None, :, None]
        pull = (here * apart / squares[..., None] ** ((power + 1) / 2)).sum(axis=2)
        return pull / motion.mass[:, None] if weighed and power > 1 else pull

    return field


def _there(tracks: Tracks) -> Float[np.ndarray, "time body"]:
    """1 from the first to the last frame in which a body was seen, else 0."""
    times = tracks.times[:, None]
    return ((times >= tracks.first_seen) & (times <= tracks.last_seen)).astype(float)

"""Missing accelerations that are looked for in free flight: patterns over the plane, the speed, the time, the spin."""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from vrdp_prob.discovery.residuals.fitted_motion import FittedMotion
from vrdp_prob.scene import Body, Shape, Tracks

SOFTENING = 0.2
"""Distance in m below which a force between bodies no longer grows."""
SLOWEST_SHAKING, MOST_SHAKINGS = 0.5, 16
"""Periods in the longest video of the slowest shaking that is looked for, and how many multiples of it at most."""
FASTEST_SHAKING = 0.25
"""Shaking is looked for up to this share of the frame rate."""
FLAT = 0.01
"""Bodies move along a line where their places spread across it by a smaller share of what they do along it."""
DECAY = 0.4
"""Share of the typical speed over which what acts on slow bodies alone fades."""

CLOSENESS = f"sum {SOFTENING**2:.2g}/(r^2 + {SOFTENING:g}^2)"
"""How near others are, as part of a formula: 1 for each that were at the very place of a body."""

SYMBOLS = (
    "SI units; v velocity, u = v/|v|, n is u turned to the left, phi the direction of v, ex and ey along the axes, t "
    "time since the first frame, s way travelled, omega spin, r to each other body, m mass"
)
"""What the symbols of formulas mean."""

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
    formula
        The field as part of a formula in SI units (see `SYMBOLS`).
    beside_contacts
        Whether it may show where something else is asked; not where it is strongest as bodies meet, and would be taken
        for what happens at contacts.
    """

    name: str
    field: Field
    formula: str
    beside_contacts: bool = True


@dataclass(frozen=True)
class Scales:
    """Typical numbers of some videos, by which patterns are scaled.

    Parameters
    ----------
    speed
        Median speed in m/s of what moves.
    middle
        Middle in m of the places where bodies moved.
    axes
        Axes along which these places differ: both, unless everything moves along one.
    materials
        The materials to tell from the rest: all that are stated, less the first where every body's is.
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
    axes: tuple[int, ...]
    materials: tuple[str, ...]
    shapes: frozenset[Shape]
    weighed: bool
    turning: bool
    longest: float
    step: float
    own_friction: bool

    @property
    def place_words(self) -> tuple[str, str]:
        """The place relative to the middle, along x and y, as part of a formula."""
        x, y = (
            f"({letter} {'-' if value >= 0 else '+'} {abs(value):.2f})"
            for letter, value in zip("xy", self.middle, strict=True)
        )
        return x, y

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
            spanned(places),
            told_apart(bodies),
            frozenset(body.shape for body in bodies),
            all(body.mass is not None for body in bodies),
            all(motion.tracks.turning_told for motion in motions),
            max(float(motion.times[-1] - motion.times[0]) for motion in motions),
            float(np.median(np.concatenate([np.diff(motion.times) for motion in motions]))),
            own_friction,
        )


def spanned(places: Float[np.ndarray, "place 2"]) -> tuple[int, ...]:
    """Axes along which places differ; one of them where everything moves along it."""
    spread = places.std(axis=0) if len(places) else np.ones(2)
    return tuple(int(axis) for axis in np.flatnonzero(spread >= FLAT * spread.max()))


def told_apart(bodies: Sequence[Body]) -> tuple[str, ...]:
    """Materials to tell from the rest: what nobody stated is none of them."""
    materials = {body.material for body in bodies}
    stated = sorted(material for material in materials if material is not None)
    return tuple(stated if None in materials else stated[1:])


def patterns(scales: Scales) -> Iterator[Pattern]:
    """All patterns that videos of such scales can show."""
    places = scales.place_words
    for axis, letter in enumerate("xy"):
        yield Pattern(f"push {letter}", _push(axis), f"e{letter}")
        yield Pattern(f"push {letter} speed", _push(axis, lambda m: m.speed), f"|v| e{letter}")
        for other in scales.axes:
            yield Pattern(
                f"push {letter} {'xy'[other]}", _push(axis, _place(scales, other)), f"{places[other]} e{letter}"
            )
    for name, factor, words in _factors(scales):
        yield Pattern(f"along {name}", _along(factor), f"{words} u")
    yield Pattern("along others", _along(_closeness), f"{CLOSENESS} u", beside_contacts=False)
    yield Pattern("across", _across(lambda m: np.ones_like(m.speed)), "n")
    yield Pattern("across speed", _across(lambda m: m.speed), "|v| n")
    for axis in scales.axes:
        yield Pattern(f"across speed {'xy'[axis]}", _across(_turning(_place(scales, axis))), f"{places[axis]} |v| n")
    yield Pattern("across speed time", _across(_turning(_clock)), "t |v| n")
    yield Pattern("across cosine", _across(_heading(np.cos)), "cos(2 phi) n")
    yield Pattern("across sine", _across(_heading(np.sin)), "sin(2 phi) n")
    if scales.turning:
        yield Pattern("across speed spin", _across(_turning(lambda m: m.spin)), "omega |v| n")
    for name, factor, words in _of_bodies(scales, scales.shapes):
        yield Pattern(f"across speed {name}", _across(_turning(factor)), f"{words} |v| n")
    yield Pattern("across others", _across(_closeness), f"{CLOSENESS} n", beside_contacts=False)
    mass = "/m" if scales.weighed else ""
    softened = f"(r^2 + {SOFTENING:g}^2)"
    yield Pattern("others square", _towards_others(2, weighed=scales.weighed), f"sum r/{softened}^1.5{mass}")
    yield from _shaking(scales)
    yield Pattern("others", _towards_others(1, weighed=scales.weighed), f"sum r/{softened}")


def _shaking(scales: Scales) -> Iterator[Pattern]:
    """Pushes to and fro, at several frequencies and in both phases."""
    for name, frequency in scales.frequencies.items():
        rate = 2 * np.pi * frequency
        for axis, letter in enumerate("xy"):
            for phase, function in (("cosine", np.cos), ("sine", np.sin)):
                words = f"{phase[:3]}({rate:.2f} t) e{letter}"
                yield Pattern(f"{name} {phase} {letter}", _push(axis, _wave(function, rate)), words)


Factor = Callable[[FittedMotion], Float[np.ndarray, "time body"]]


def _factors(scales: Scales) -> Iterator[tuple[str, Factor, str]]:
    """What an acceleration along the velocity may depend on, and the words of a formula for it."""
    decay = DECAY * scales.speed
    words = [scales.place_words[axis] for axis in scales.axes]
    yield "speed", lambda m: m.speed, "|v|"
    yield "slowness", lambda m: np.exp(-m.speed / decay), f"exp(-|v|/{decay:.2g})"
    yield "cosine", _heading(np.cos), "cos(2 phi)"
    yield "sine", _heading(np.sin), "sin(2 phi)"
    for axis, word in zip(scales.axes, words, strict=True):
        yield "xy"[axis], _place(scales, axis), word
    squares = " + ".join(f"{word}^2" for word in words)
    yield "distance", _square_distance(scales), f"({squares})"
    yield "time", _clock, "t"
    yield "way", way_travelled, "s"
    if scales.turning:
        yield "spin", lambda m: np.abs(m.spin), "|omega|"
    if not scales.own_friction:  # the friction of spheres is another number in any case
        yield from _of_bodies(scales, scales.shapes - {Shape.SPHERE})


def _of_bodies(scales: Scales, shapes: Collection[Shape]) -> Iterator[tuple[str, Factor, str]]:
    """What bodies are, by which an acceleration may differ between them: one of some shapes, a material, a mass."""
    for shape in [one for one in Shape if one in shapes][:-1]:
        yield str(shape), _of_body(_has(shape)), f"[{shape}]"
    for material in scales.materials:
        yield f"material {material}", _of_body(_is_made_of(material)), f"[{material}]"
    if scales.weighed:
        yield "mass", _of_body(lambda body: float(np.log(body.mass or 1.0))), "log(m)"


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


def _square_distance(scales: Scales) -> Factor:
    """Square of the distance from the middle, along the axes along which bodies move."""
    axes = list(scales.axes)
    return lambda motion: ((motion.position - scales.middle)[..., axes] ** 2).sum(axis=-1)


def _clock(motion: FittedMotion) -> Float[np.ndarray, "time body"]:
    """Time since the first frame in s."""
    return np.broadcast_to((motion.times - motion.times[0])[:, None], motion.speed.shape)


def way_travelled(motion: FittedMotion) -> Float[np.ndarray, "time body"]:
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


def _has(shape: Shape) -> Callable[[Body], float]:
    return lambda body: float(body.shape is shape)


def _is_made_of(material: str) -> Callable[[Body], float]:
    return lambda body: float(body.material == material)


def _towards_others(power: int, *, weighed: bool) -> Field:
    """Towards all other bodies that are there, falling with a power of their distance."""

    def field(motion: FittedMotion) -> Float[np.ndarray, "time body 2"]:
        apart, squares = _apart(motion)
        here = there(motion.tracks)[:, None, :, None]
        pull = (here * apart / squares[..., None] ** ((power + 1) / 2)).sum(axis=2)
        return pull / motion.mass[:, None] if weighed and power > 1 else pull

    return field


def _apart(motion: FittedMotion) -> tuple[Float[np.ndarray, "time body other 2"], Float[np.ndarray, "time body other"]]:
    """The way from each body to each one, and the softened squares of their distances."""
    apart = motion.position[:, None] - motion.position[:, :, None]
    return apart, (apart**2).sum(axis=-1) + SOFTENING**2


def _closeness(motion: FittedMotion) -> Float[np.ndarray, "time body"]:
    """How near others are that are there, see `CLOSENESS`."""
    _, squares = _apart(motion)
    others = there(motion.tracks)[:, None] & ~np.eye(squares.shape[1], dtype=bool)
    found: np.ndarray = (others * SOFTENING**2 / squares).sum(axis=2)
    return found


def there(tracks: Tracks) -> Bool[np.ndarray, "time body"]:
    """Whether a body is there: from the first to the last frame in which it was seen."""
    times = tracks.times[:, None]
    found: np.ndarray = (times >= tracks.first_seen) & (times <= tracks.last_seen)
    return found

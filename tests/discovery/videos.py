"""One video before it is measured: bodies, laws and fixed things, and its exact motion."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from tests.discovery import motion_kernel
from tests.discovery.laws import Laws, Things
from vrdp_prob.scene import Shape, Wall

STEP = 1e-3
"""Step of the integrator in s."""
MOST_CONTACTS = 400
INERTIA = {Shape.SPHERE: 2 / 5, Shape.CYLINDER: 1 / 2, Shape.CUBE: 2 / 3}
"""Moment of inertia about the vertical over mass times radius squared (half side squared for a cube)."""


class UnendingMotionError(RuntimeError):
    """A motion in which bodies touch or stop without end."""


@dataclass(frozen=True)
class Disc:
    """A fixed disc that nobody sees: place and radius in m, restitution factor."""

    x: float
    y: float
    radius: float
    restitution: float


@dataclass(frozen=True)
class Video:
    """What is true of one video.

    Parameters
    ----------
    shapes, materials
        Solid and material of each body.
    position, velocity, angle, spin
        State at the release, in m, m/s, rad, rad/s.
    release
        Time in s at which each body comes in, 0 for those that are there from the start.
    mass, radius, restitution, friction
        Of each body: kg, m, and the factors of restitution and friction; `radius` is the one that is stated.
    laws
        All that moves the bodies.
    touching
        Factor of the radii at which bodies touch.
    rolling
        Velocity at which a sphere would roll by its spin when it is released, over its velocity.
    walls, hidden_walls, hidden_discs
        Walls that are stated, and walls and discs that are not.
    frame_rate, frames
        Frames per second by the time stamps, and their number.
    late
        True time of each frame less its stamp, in s.
    distortion
        Of the lens: recorded place r' = r (1 + distortion |r|^2) about `centre`, in 1/m^2.
    centre, view
        Middle of the picture and half of its side in m; what is outside is not seen.
    """

    shapes: tuple[Shape, ...]
    materials: tuple[str, ...]
    position: Float[np.ndarray, "body 2"]
    velocity: Float[np.ndarray, "body 2"]
    angle: Float[np.ndarray, "body"]
    spin: Float[np.ndarray, "body"]
    release: Float[np.ndarray, "body"]
    mass: Float[np.ndarray, "body"]
    radius: Float[np.ndarray, "body"]
    restitution: Float[np.ndarray, "body"]
    friction: Float[np.ndarray, "body"]
    frames: int
    frame_rate: float = 25.0
    laws: Laws = field(default_factory=Laws)
    touching: float = 1.0
    rolling: float = 0.0
    walls: tuple[Wall, ...] = ()
    hidden_walls: tuple[Wall, ...] = ()
    hidden_discs: tuple[Disc, ...] = ()
    late: Float[np.ndarray, "time"] | None = None
    distortion: float = 0.0
    centre: tuple[float, float] = (0.0, 0.0)
    view: float = 4.0

    @property
    def stamps(self) -> Float[np.ndarray, "time"]:
        """Time stamps of the frames in s."""
        return np.arange(self.frames) / self.frame_rate

    @property
    def times(self) -> Float[np.ndarray, "time"]:
        """True times of the frames in s."""
        return self.stamps if self.late is None else self.stamps + self.late

    @cached_property
    def motion(self) -> "Motion":
        """The exact motion, integrated once."""
        return move(self)

    @property
    def in_view(self) -> Bool[np.ndarray, "time body"]:
        """Whether the middle of a body is in the picture; it is also where it has yet to come in."""
        apart = np.abs(recorded(self, self.motion.states[..., :2]) - np.array(self.centre))
        return np.asarray((apart < self.view).all(axis=-1))

    def governed_by(self, **numbers: float) -> "Video":
        """The video with other numbers in its laws."""
        return replace(self, laws=self.laws._replace(**numbers))


@dataclass(frozen=True)
class Motion:
    """The motion of a video.

    Parameters
    ----------
    states
        x, y, vx, vy, angle, spin, the two components of a sphere's rolling velocity, and the way travelled, in SI
        units, at the true times of the frames. A body that is not yet released is where it will come in.
    contact_times, pairs
        Time in s of each contact that bounced, and who met: bodies, then fixed discs, then stated and hidden walls.
    around
        States of both right before and right after each contact.
    """

    states: Float[np.ndarray, "time body 9"]
    contact_times: Float[np.ndarray, "contact"]
    pairs: Int[np.ndarray, "contact 2"]
    around: Float[np.ndarray, "contact 2 2 9"]


def things_of(video: Video) -> Things:
    """All that can touch in a video."""
    walls = (*video.walls, *video.hidden_walls)
    fixed = len(video.hidden_discs) + len(walls)
    size = video.touching * video.radius
    share = np.array([INERTIA[shape] for shape in video.shapes])
    nothing = np.zeros(fixed)
    squares: Bool[np.ndarray, "thing"] = np.array([shape is Shape.CUBE for shape in video.shapes] + [False] * fixed)
    return Things(
        inverse_mass=np.concatenate([1 / video.mass, nothing]),
        inverse_inertia=np.concatenate([1 / (share * video.mass * video.radius**2), nothing]),
        radius=np.array([*size, *(disc.radius for disc in video.hidden_discs), *(0.0 for _ in walls)]),
        square=squares,
        restitution=np.array(
            [*video.restitution, *(disc.restitution for disc in video.hidden_discs), *map(_restitution, walls)]
        ),
        sphere=np.array([shape is Shape.SPHERE for shape in video.shapes]),
        friction=np.ascontiguousarray(video.friction, dtype=float),
        release=np.ascontiguousarray(video.release, dtype=float),
        walls=np.array([[wall.x1, wall.y1, wall.x2, wall.y2] for wall in walls], dtype=float).reshape(-1, 4),
    )


def move(video: Video, times: Float[np.ndarray, "time"] | None = None, step: float = STEP) -> Motion:
    """Motion at the given true times (s), by default those of the frames.

    Raises
    ------
    UnendingMotionError
        If bodies touch or stop so often that the integrator gives up.
    """
    things = things_of(video)
    count = len(video.shapes)
    start = np.zeros((len(things.radius), motion_kernel.COLUMNS))
    start[:count, :2], start[:count, 2:4] = video.position, video.velocity
    start[:count, 4], start[:count, 5] = video.angle, video.spin
    start[:count, 6:8] = video.rolling * video.velocity
    start[count : count + len(video.hidden_discs), :2] = np.reshape([(d.x, d.y) for d in video.hidden_discs], (-1, 2))
    laws = Laws(*(float(number) for number in video.laws))
    when = video.times if times is None else np.asarray(times, dtype=float)
    states, contacts, around, complete = motion_kernel.integrate(start, things, laws, when, step, MOST_CONTACTS)
    if not complete:
        raise UnendingMotionError("the integrator gave up: bodies touch or stop without end; change the scene.")
    return Motion(states, contacts[:, 0], contacts[:, 1:].astype(int), around)


def recorded(video: Video, places: Float[np.ndarray, "*many 2"]) -> Float[np.ndarray, "*many 2"]:
    """Places in m as the lens shows them."""
    apart = places - np.array(video.centre)
    return places + video.distortion * (apart**2).sum(axis=-1, keepdims=True) * apart


def _restitution(wall: Wall) -> float:
    if wall.restitution is None:
        raise ValueError("a wall of a generated video needs its true restitution; whether it is stated is told later.")
    return wall.restitution

"""What a physical cause may do: the hooks of an effect.

An effect overrides the hooks it needs and leaves the others. There are two sorts.

*Laws* (`acceleration`, `friction_factor`, `tangential_impulse`, ...) are plain functions of numbers written with
`vrdp_prob.models.simulator.mathematics`; they are compiled, with their derivative, from that one text. A law must not
branch with `if` on its arguments; use `mathematics.where`.

*Arrangements* (`obstacles`, `contact_radius`, `measured_times`, ...) are functions of tensors with the axis `world`,
through which torch differentiates.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import FunctionType
from typing import ClassVar

from jaxtyping import Float
from torch import Tensor

from vrdp_prob.models.effects.unmet import Unmet
from vrdp_prob.models.parameters import Parameter
from vrdp_prob.models.simulator.formula import Scalar
from vrdp_prob.models.simulator.obstacle import Obstacle
from vrdp_prob.scene import Tracks


@dataclass(frozen=True)
class BodyView:
    """A body as a law sees it, in SI units.

    Parameters
    ----------
    x, y, angle
        Position in m and angle in rad.
    vx, vy, spin
        Velocity in m/s and angular velocity in rad/s.
    speed
        Length of the velocity in m/s. While dry friction stops a body it is negative past the stop, so that a law
        which is smooth up to the stop stays smooth there (the motion past it is never used).
    mass, inverse_mass, inverse_inertia
        Mass in kg, 1/mass and 1/(moment of inertia about the vertical axis); the inverses are 0 for what is fixed.
    restitution
        Restitution factor.
    radius
        Radius in m (half side for a cube).
    is_sphere
        1 for a sphere, else 0.
    parameters
        The body's own values of parameters with scope `body` that effects added.
    slip_x, slip_y, slip_speed
        Slip of a sphere against the table in m/s and its length (as `speed` is one), in models where spheres slip.
    side
        By the name of each effect with a `boundary`: 1 on the side where it is positive, else -1. Only where a body
        moves, not in a contact.
    """

    x: Scalar
    y: Scalar
    angle: Scalar
    vx: Scalar
    vy: Scalar
    spin: Scalar
    speed: Scalar
    mass: Scalar
    inverse_mass: Scalar
    inverse_inertia: Scalar
    restitution: Scalar
    radius: Scalar
    is_sphere: Scalar
    parameters: Mapping[str, Scalar] = field(default_factory=dict)
    slip_x: Scalar = 0.0
    slip_y: Scalar = 0.0
    slip_speed: Scalar = 0.0
    side: Mapping[str, Scalar] = field(default_factory=dict)


@dataclass(frozen=True)
class ContactView:
    """A contact as a law sees it, after its normal impulse was found.

    Parameters
    ----------
    closing_speed
        Speed in m/s at which the two touching points approach each other along the normal.
    normal_impulse
        Impulse along the normal in kg m/s, positive.
    tangential_speed
        Speed in m/s of the second body's touching point relative to the first's along the tangent, before the contact.
    tangential_speed_after_normal
        The same after the normal impulse alone.
    tangential_inverse_mass
        Change of the tangential speed per tangential impulse, in 1/kg.
    vertical_speed
        Speed in m/s at which the second body's touching point moves upwards relative to the first's, by which spheres
        roll; in models where spheres slip, else 0.
    vertical_inverse_mass
        Change of the vertical speed per vertical impulse, in 1/kg; 0 where neither body is such a sphere.
    """

    closing_speed: Scalar
    normal_impulse: Scalar
    tangential_speed: Scalar
    tangential_speed_after_normal: Scalar
    tangential_inverse_mass: Scalar
    vertical_speed: Scalar = 0.0
    vertical_inverse_mass: Scalar = 0.0


@dataclass(frozen=True)
class Effect:
    """One physical cause; derive from it and override hooks."""

    name: ClassVar[str]
    """Name in the catalogue of causes."""
    cause: ClassVar[str | None] = None
    """Name of the cause that the effect is a further way of; None where the effect is the cause itself."""
    follows: ClassVar[str | None] = None
    """Name of the effect beside which alone it is looked for, as a second wall is beside a first one; None without."""
    sentence: ClassVar[str]
    """One sentence a person can read."""
    signed_sentences: ClassVar[tuple[str, str] | None] = None
    """The sentence where the strength, the one parameter in `vanishes_at`, is positive, and where it is negative."""
    sign_of_law: ClassVar[int | None] = None
    """Sign of its one strength where that tells of something else with the other one; None where its law has both."""
    law: ClassVar[str]
    """The law as text, for reports and model files."""
    source: ClassVar[str]
    """Where the law comes from."""
    parameters: ClassVar[tuple[Parameter, ...]] = ()
    """Its parameters."""
    vanishes_at: ClassVar[Mapping[str, float]] = {}
    """Values of parameters at which the effect is gone, so that the model without it is nested."""
    also_vanishes: ClassVar[Mapping[str, str]] = {}
    """Where else nothing is seen of the effect, by a strength and in words that follow an upper bound of it."""
    vanishes_like: ClassVar[Mapping[str, str]] = {}
    """Parameters, each with the one of another effect that leaves nothing of this one where both are equal."""
    told_by_differences: ClassVar[frozenset[str]] = frozenset()
    """Parameters that tell of the effect only as far as they differ: another one may have what they have in common."""
    reads_video_start: ClassVar[bool] = False
    """Whether its laws read `vrdp_prob.models.parameters.VIDEO_START` beside their parameters."""
    stepwise: ClassVar[frozenset[str]] = frozenset()
    """Parameters on which the motion depends in steps, without a slope: they are found by a scan, and held there."""
    least_start: ClassVar[Mapping[str, float]] = {}
    """Values of parameters below which no refit begins, where the motion has no slope beyond."""

    @classmethod
    def cause_name(cls) -> str:
        """Name of the cause that it is, or is a way of."""
        return cls.cause or cls.name

    @classmethod
    def way(cls) -> str | None:
        """Its name where it is a further way of a cause."""
        return cls.name if cls.cause else None

    @classmethod
    def overrides(cls, hook: str) -> bool:
        """Whether the effect has its own version of a hook."""
        return getattr(cls, hook) is not getattr(Effect, hook)

    @classmethod
    def does_something(cls) -> bool:
        """Whether the effect has its own version of any hook that changes what happens or is measured."""
        return any(cls.overrides(name) for name in _hooks() if name not in _OF_THE_SEARCH)

    def search_points(self, videos: Sequence[Tracks]) -> Sequence[Mapping[str, float]]:
        """Values of parameters from which a search for the effect begins, for an effect that has a place or a time.

        Parameters that are left out begin at the value at which the effect vanishes, or at their default. Of an effect
        that happens once in a video these are asked for each video by itself.
        """
        return ({},)

    def expected(self, videos: Sequence[Tracks]) -> Mapping[str, Parameter]:
        """Parameters by name, with what is believed of them where it is known where and when bodies were seen.

        For an effect that has a place or a time, or goes with the time between frames. What its parameters state holds
        for a scene around the origin that begins at 0 s; a search takes these instead, so that it does not matter where
        the origin lies.
        """
        return {}

    def unmet(self, videos: Sequence[Tracks]) -> Mapping[str, Unmet]:
        """How large what stands in the way may be and no body has met it, by the names of parameters.

        For an effect that has no strength, but which a body feels that comes where it is.
        """
        return {}

    def acceleration(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> tuple[Scalar, Scalar]:
        """Acceleration of a body in m/s^2, dry friction apart."""
        return 0.0, 0.0

    def friction_factor(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> Scalar:
        """Factor of the friction coefficient of a body; the coefficient is the product over all effects."""
        return 1.0

    def spin_deceleration(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> Scalar:
        """Rate in rad/s^2 at which the spin about the vertical decays to rest (not past it)."""
        return 0.0

    def slip_friction(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> Scalar:
        """Friction coefficient of a sphere while it slips on the table.

        Where an effect has this, spheres have a spin about horizontal axes. They slip after their release and after
        every contact until they roll; `friction_factor` then acts while they roll. The largest of all effects counts.
        """
        return 0.0

    def pair_force(
        self, time: Scalar, first: BodyView, second: BodyView, parameters: Mapping[str, Scalar]
    ) -> tuple[Scalar, Scalar]:
        """Force in N of the second body on the first, at a distance; its opposite acts on the second.

        It is called once for each pair, in the order of the bodies, so it must be odd: exchanging the bodies must turn
        its sign.
        """
        return 0.0, 0.0

    def kick_time(self, parameters: Mapping[str, Scalar]) -> Scalar:
        """Time in s at which the effect changes velocities at once; an effect with `kick` must have it."""
        raise NotImplementedError("a kick needs its time; write this method.")

    def kick(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> tuple[Scalar, Scalar, Scalar]:
        """Change of (vx, vy, spin) of a body in m/s and rad/s at the time of the kick."""
        return 0.0, 0.0, 0.0

    def boundary(self, body: BodyView, parameters: Mapping[str, Scalar]) -> Scalar:
        """Number whose sign says on which side of a boundary a body is; laws read it as `body.side[name]`.

        Motion goes exactly up to the boundary before another law holds, so a law may jump there.
        """
        return 1.0

    def restitution(
        self,
        closing_speed: Scalar,
        restitution: Scalar,
        first: BodyView,
        second: BodyView,
        parameters: Mapping[str, Scalar],
    ) -> Scalar:
        """Coefficient of restitution of a contact, from what earlier effects of the model made of it."""
        return restitution

    def tangential_impulse(
        self, contact: ContactView, first: BodyView, second: BodyView, parameters: Mapping[str, Scalar]
    ) -> Scalar:
        """Impulse in kg m/s on the second body along the tangent of a contact."""
        return 0.0

    def vertical_impulse(
        self, contact: ContactView, first: BodyView, second: BodyView, parameters: Mapping[str, Scalar]
    ) -> Scalar:
        """Upward impulse in kg m/s on the second body of a contact; the table keeps both bodies on it.

        It changes how spheres roll, in models where they slip, and nothing else.
        """
        return 0.0

    def obstacles(self, parameters: Mapping[str, Float[Tensor, "..."]]) -> Sequence[Obstacle]:
        """Fixed discs and straight walls that the effect adds to a scene."""
        return ()

    @property
    def obstacle_restitutions(self) -> tuple[str, ...]:
        """Names of the parameters that are the restitutions of its `obstacles`, in their order."""
        return ()

    def contact_radius(
        self, radius: Float[Tensor, "world body"], parameters: Mapping[str, Float[Tensor, "..."]]
    ) -> Float[Tensor, "world body"]:
        """Radius in m (half side) at which bodies touch, from what earlier effects of the model made of it."""
        return radius

    def rolling_velocity(
        self, velocity: Float[Tensor, "world body 2"], parameters: Mapping[str, Float[Tensor, "..."]]
    ) -> Float[Tensor, "world body 2"] | None:
        """Velocity in m/s with which each sphere would roll by the spin that it is released with; None without."""
        return None

    def measured_times(
        self, times: Float[Tensor, "world time"], parameters: Mapping[str, Float[Tensor, "..."]]
    ) -> Float[Tensor, "world time"]:
        """True times in s of the frames, from their time stamps."""
        return times

    def frame_jitter(self, parameters: Mapping[str, Float[Tensor, "..."]]) -> Float[Tensor, "world"] | None:
        """Standard deviation in s of the true times of frames about `measured_times`, each by itself; None without.

        The effect has `vrdp_prob.models.parameters.FRAME_JITTER` and no other parameter.
        """
        return None

    def measured_positions(
        self,
        positions: Float[Tensor, "world time body 2"],
        times: Float[Tensor, "world time"],
        parameters: Mapping[str, Float[Tensor, "..."]],
    ) -> Float[Tensor, "world time body 2"]:
        """Positions in m as they are measured, from the true ones."""
        return positions


_OF_THE_SEARCH = ("search_points", "expected", "unmet")


def _hooks() -> list[str]:
    """Names of all hooks."""
    return [
        name for name, value in vars(Effect).items() if isinstance(value, FunctionType) and not name.startswith("_")
    ]

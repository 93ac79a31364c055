"""What a physical cause may do: the hooks of an effect.

An effect overrides the hooks it needs and leaves the others. Hooks that are laws (`acceleration`, `friction_factor`,
...) are plain functions of numbers written with `vrdp_prob.models.simulator.mathematics`; they are compiled, with their
derivative, from that one text. A law must not branch with `if` on its arguments; use `mathematics.where`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from vrdp_prob.models.parameters import Parameter
from vrdp_prob.models.simulator.formula import Scalar


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
    """

    closing_speed: Scalar
    normal_impulse: Scalar
    tangential_speed: Scalar
    tangential_speed_after_normal: Scalar
    tangential_inverse_mass: Scalar


@dataclass(frozen=True)
class Effect:
    """One physical cause; derive from it and override hooks."""

    name: ClassVar[str]
    """Name in the catalogue of causes."""
    sentence: ClassVar[str]
    """One sentence a person can read."""
    law: ClassVar[str]
    """The law as text, for reports and model files."""
    source: ClassVar[str]
    """Where the law comes from."""
    parameters: ClassVar[tuple[Parameter, ...]] = ()
    """Its parameters."""
    vanishes_at: ClassVar[Mapping[str, float]] = {}
    """Values of parameters at which the effect is gone, so that the model without it is nested."""

    @classmethod
    def overrides(cls, hook: str) -> bool:
        """Whether the effect has its own version of a hook."""
        return getattr(cls, hook) is not getattr(Effect, hook)

    def acceleration(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> tuple[Scalar, Scalar]:
        """Acceleration of a body in m/s^2, dry friction apart."""
        return 0.0, 0.0

    def friction_factor(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> Scalar:
        """Factor of the friction coefficient of a body; the coefficient is the product over all effects."""
        return 1.0

    def spin_deceleration(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> Scalar:
        """Rate in rad/s^2 at which the spin about the vertical decays to rest (not past it)."""
        return 0.0

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

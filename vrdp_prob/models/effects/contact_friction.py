"""Friction between two bodies that touch."""

import math
from collections.abc import Mapping
from typing import ClassVar

from vrdp_prob.models.effects.effect import BodyView, ContactView, Effect
from vrdp_prob.models.parameters import Parameter, Prior, Transform
from vrdp_prob.models.simulator.formula import Scalar
from vrdp_prob.models.simulator.mathematics import length, maximum, minimum, where

CONTACT_FRICTION = Parameter(
    "contact_friction",
    "1",
    "friction coefficient between two bodies that touch",
    Transform.LOG,
    Prior(math.log(0.1), 1.0),
    default=0.1,
)
WALL_FRICTION = Parameter(
    "wall_friction",
    "1",
    "friction coefficient between a body and something fixed that it touches",
    Transform.LOG,
    Prior(math.log(0.1), 1.0),
    default=0.1,
    needs_walls=True,
)
LEAST_INVERSE_MASS, SLOWEST_SLIDE = 1e-9, 1e-12
"""In 1/kg and m/s: by what denominators that vanish are replaced."""


class ContactFriction(Effect):
    """An impulse across the normal that exchanges spin, up to sticking.

    Where spheres slip on the table, the touching point of a rolling sphere moves up or down, too: a ball that rolls
    into a wall loses some of its rolling.
    """

    name: ClassVar = "contact_friction"
    sentence: ClassVar = "Bodies that touch rub on each other and exchange spin."
    law: ClassVar = (
        "|J_t| <= contact_friction J_n (wall_friction J_n at what is fixed), against the sliding where they touch, "
        "also as spheres roll, up to sticking"
    )
    source: ClassVar = "Coulomb friction in an impact: J. B. Keller, Impact with friction, J. Appl. Mech. 53 (1986)"
    parameters: ClassVar[tuple[Parameter, ...]] = (CONTACT_FRICTION, WALL_FRICTION)
    vanishes_at: ClassVar = {"contact_friction": 0.0, "wall_friction": 0.0}

    def tangential_impulse(
        self, contact: ContactView, first: BodyView, second: BodyView, parameters: Mapping[str, Scalar]
    ) -> Scalar:
        """Impulse in kg m/s on the second body along the tangent."""
        slide, inverse_mass = contact.tangential_speed_after_normal, contact.tangential_inverse_mass
        coefficient = _coefficient(first, second, parameters)
        return -slide * self._impulse_per_slide(contact, inverse_mass, coefficient, parameters)

    def vertical_impulse(
        self, contact: ContactView, first: BodyView, second: BodyView, parameters: Mapping[str, Scalar]
    ) -> Scalar:
        """Upward impulse in kg m/s on the second body."""
        slide, inverse_mass = contact.vertical_speed, contact.vertical_inverse_mass
        coefficient = _coefficient(first, second, parameters)
        return -slide * self._impulse_per_slide(contact, inverse_mass, coefficient, parameters)

    def _impulse_per_slide(
        self, contact: ContactView, inverse_mass: Scalar, coefficient: Scalar, parameters: Mapping[str, Scalar]
    ) -> Scalar:
        """Impulse in kg by the speed of sliding in one direction."""
        return impulse_per_slide(contact, inverse_mass, coefficient)


def _coefficient(first: BodyView, second: BodyView, parameters: Mapping[str, Scalar]) -> Scalar:
    """Friction coefficient of what touches."""
    both_move = first.inverse_mass * second.inverse_mass > 0.0
    return where(both_move, parameters["contact_friction"], parameters["wall_friction"])


def impulse_per_slide(contact: ContactView, inverse_mass: Scalar, coefficient: Scalar, share: Scalar = 1.0) -> Scalar:
    """Impulse in kg by the speed of sliding in one direction that it changes, or what friction can give.

    While a body slides friction acts against the whole sliding, along the tangent and up or down.

    Parameters
    ----------
    contact
        The contact.
    inverse_mass
        Change of that speed per impulse, in 1/kg.
    coefficient
        Friction coefficient of what touches.
    share
        Change of the speed in units of it: 1 where it ends.
    """
    slide = length(contact.tangential_speed_after_normal, contact.vertical_speed)
    limit = coefficient * contact.normal_impulse
    return minimum(share / maximum(inverse_mass, LEAST_INVERSE_MASS), limit / maximum(slide, SLOWEST_SLIDE))

"""Friction between two bodies that touch."""

import math
from collections.abc import Mapping
from typing import ClassVar

from vrdp_prob.models.effects.effect import BodyView, ContactView, Effect
from vrdp_prob.models.parameters import Parameter, Prior, Transform
from vrdp_prob.models.simulator.formula import Scalar
from vrdp_prob.models.simulator.mathematics import maximum, minimum

CONTACT_FRICTION = Parameter(
    "contact_friction",
    "1",
    "friction coefficient between two bodies that touch",
    Transform.LOG,
    Prior(math.log(0.1), 1.0),
    default=0.1,
)


class ContactFriction(Effect):
    """A tangential impulse that exchanges spin, up to sticking."""

    name: ClassVar = "contact_friction"
    sentence: ClassVar = "Bodies that touch rub on each other and exchange spin."
    law: ClassVar = "|J_t| <= contact_friction J_n, against the sliding at the touching point, up to sticking"
    source: ClassVar = "Coulomb friction in an impact: J. B. Keller, Impact with friction, J. Appl. Mech. 53 (1986)"
    parameters: ClassVar = (CONTACT_FRICTION,)
    vanishes_at: ClassVar = {"contact_friction": 0.0}

    def tangential_impulse(
        self, contact: ContactView, first: BodyView, second: BodyView, parameters: Mapping[str, Scalar]
    ) -> Scalar:
        """Impulse in kg m/s on the second body along the tangent."""
        limit = parameters["contact_friction"] * contact.normal_impulse
        sticking = -contact.tangential_speed_after_normal / contact.tangential_inverse_mass
        return maximum(-limit, minimum(limit, sticking))

"""Contacts that spring back along the tangent."""

from collections.abc import Mapping
from typing import ClassVar

from vrdp_prob.models.effects.contact_friction import (
    CONTACT_FRICTION,
    WALL_FRICTION,
    ContactFriction,
    impulse_per_slide,
)
from vrdp_prob.models.effects.effect import ContactView
from vrdp_prob.models.parameters import Parameter, Prior, Transform
from vrdp_prob.models.simulator.formula import Scalar
from vrdp_prob.models.simulator.mathematics import maximum, minimum

TANGENTIAL_RESTITUTION = Parameter(
    "tangential_restitution",
    "1",
    "share of its sliding with which a touching point that sticks leaves the other way about",
    Transform.IDENTITY,
    Prior(0.0, 0.4),
    default=0.0,
)


class TangentialRestitution(ContactFriction):
    """What gives way along the tangent while bodies stick springs back when they part.

    It is what friction does beyond sticking, and acts beside `ContactFriction`, whose coefficients it has.
    """

    name: ClassVar = "tangential_restitution"
    cause: ClassVar = ContactFriction.name
    follows: ClassVar = ContactFriction.name
    sentence: ClassVar = "Bodies that stick where they touch spring back across the contact, and leave with more spin."
    law: ClassVar = (
        "J_t = (1 + tangential_restitution) times what makes them stick, as far as |J_t| <= contact_friction J_n "
        "(wall_friction J_n at what is fixed)"
    )
    source: ClassVar = (
        "Walton and Braun, J. Rheol. 30 (1986); measured by Foerster, Louge, Chang and Allia, Phys. Fluids 6 (1994)"
    )
    parameters: ClassVar = (CONTACT_FRICTION, WALL_FRICTION, TANGENTIAL_RESTITUTION)
    vanishes_at: ClassVar = {"tangential_restitution": 0.0}
    sign_of_law: ClassVar = +1

    def _impulse_per_slide(
        self, contact: ContactView, inverse_mass: Scalar, coefficient: Scalar, parameters: Mapping[str, Scalar]
    ) -> Scalar:
        """Impulse in kg by the speed of sliding, beyond that of friction up to sticking."""
        share = minimum(2.0, maximum(0.0, 1 + parameters["tangential_restitution"]))
        springing = impulse_per_slide(contact, inverse_mass, coefficient, share)
        return springing - impulse_per_slide(contact, inverse_mass, coefficient)

"""Friction that depends on the mass."""

from collections.abc import Mapping
from typing import ClassVar

from vrdp_prob.models.effects.effect import BodyView, Effect
from vrdp_prob.models.parameters import Parameter, Prior, Transform
from vrdp_prob.models.simulator.formula import Scalar
from vrdp_prob.models.simulator.mathematics import exp, log

MASS_EXPONENT = Parameter(
    "friction_mass_exponent",
    "1",
    "power of the mass with which the friction coefficient grows",
    Transform.IDENTITY,
    Prior(0.0, 0.5),
    default=0.0,
)


class MassDependentFriction(Effect):
    """A friction coefficient that is a power of the mass."""

    name: ClassVar = "mass_dependent_friction"
    sentence: ClassVar = "The table slows heavy bodies more than light ones, or less."
    signed_sentences: ClassVar = (
        "The table slows heavy bodies more than light ones.",
        "The table slows light bodies more than heavy ones.",
    )
    law: ClassVar = "mu_i = mu (m_i / 1 kg)^friction_mass_exponent"
    source: ClassVar = (
        "Amontons' law has the exponent 0; contacts that yield elastically have -1/3 (Bowden and Tabor, 1950)"
    )
    parameters: ClassVar = (MASS_EXPONENT,)
    vanishes_at: ClassVar = {"friction_mass_exponent": 0.0}

    def friction_factor(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> Scalar:
        """Factor of the friction, 1 for 1 kg."""
        return exp(parameters["friction_mass_exponent"] * log(body.mass))

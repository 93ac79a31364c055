"""Friction that depends on the material."""

from collections.abc import Mapping
from typing import ClassVar

from vrdp_prob.models.effects.effect import BodyView, Effect
from vrdp_prob.models.parameters import Parameter, Prior, Scope, Transform
from vrdp_prob.models.simulator.formula import Scalar

MATERIAL_RATIO = Parameter(
    "material_friction_ratio",
    "1",
    "friction of the bodies of a material over the friction that all bodies share",
    Transform.LOG,
    Prior(0.0, 0.5),
    default=1.0,
    scope=Scope.MATERIAL,
)


class MaterialFriction(Effect):
    """Every material has a friction of its own, around the shared one."""

    name: ClassVar = "material_friction"
    sentence: ClassVar = "The table slows bodies of one material more than those of another."
    law: ClassVar = "mu_i = mu material_friction_ratio of the material of body i"
    source: ClassVar = "dry friction of two materials (Amontons)"
    parameters: ClassVar = (MATERIAL_RATIO,)
    vanishes_at: ClassVar = {"material_friction_ratio": 1.0}
    told_by_differences: ClassVar = frozenset({"material_friction_ratio"})

    def friction_factor(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> Scalar:
        """Ratio to the shared friction."""
        return body.parameters["material_friction_ratio"]

"""Friction that differs from body to body."""

from collections.abc import Mapping
from typing import ClassVar

from vrdp_prob.models.effects.effect import BodyView, Effect
from vrdp_prob.models.parameters import Parameter, Prior, Scope, Transform
from vrdp_prob.models.simulator.formula import Scalar

FRICTION_RATIO = Parameter(
    "friction_ratio",
    "1",
    "friction of a body over the friction that its video's bodies share",
    Transform.LOG,
    Prior(0.0, 0.5),
    default=1.0,
    scope=Scope.BODY,
)


class BodyFriction(Effect):
    """Every body has a friction of its own, around the shared one."""

    name: ClassVar = "body_friction"
    sentence: ClassVar = "The table slows some bodies more than others."
    law: ClassVar = "mu_i = mu friction_ratio_i"
    source: ClassVar = "the measured pucks: resistance differs from disc to disc"
    parameters: ClassVar = (FRICTION_RATIO,)
    vanishes_at: ClassVar = {"friction_ratio": 1.0}

    def friction_factor(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> Scalar:
        """Ratio to the shared friction."""
        return body.parameters["friction_ratio"]

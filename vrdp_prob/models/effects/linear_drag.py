"""Drag proportional to the speed."""

import math
from collections.abc import Mapping
from typing import ClassVar

from vrdp_prob.models.effects.effect import BodyView, Effect
from vrdp_prob.models.parameters import Parameter, Prior, Transform
from vrdp_prob.models.simulator.formula import Scalar

LINEAR_DRAG = Parameter(
    "linear_drag", "1/s", "deceleration per speed", Transform.LOG, Prior(math.log(0.05), 1.0), default=0.05
)


class LinearDrag(Effect):
    """Deceleration that grows with the speed, as in a viscous film."""

    name: ClassVar = "linear_drag"
    sentence: ClassVar = "Bodies are slowed in proportion to their speed."
    law: ClassVar = "a = -linear_drag v"
    source: ClassVar = "viscous friction (Stokes)"
    parameters: ClassVar = (LINEAR_DRAG,)
    vanishes_at: ClassVar = {"linear_drag": 0.0}

    def acceleration(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> tuple[Scalar, Scalar]:
        """Acceleration in m/s^2 against the velocity."""
        return -parameters["linear_drag"] * body.vx, -parameters["linear_drag"] * body.vy

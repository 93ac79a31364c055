"""Drag of the air, quadratic in the speed."""

from collections.abc import Mapping
from typing import ClassVar

from vrdp_prob.models.effects.effect import BodyView, Effect
from vrdp_prob.models.parameters import AIR_DRAG
from vrdp_prob.models.simulator.formula import Scalar


class AirDrag(Effect):
    """Deceleration that grows with the square of the speed."""

    name: ClassVar = "air_drag"
    sentence: ClassVar = "Fast bodies are slowed by the air."
    law: ClassVar = "a = -air_drag |v| v"
    source: ClassVar = "Ding et al., NeurIPS 2021 (VRDP), section 3.3, lambda_3"
    parameters: ClassVar = (AIR_DRAG,)
    vanishes_at: ClassVar = {"air_drag": 0.0}

    def acceleration(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> tuple[Scalar, Scalar]:
        """Acceleration in m/s^2 against the velocity."""
        factor = -parameters["air_drag"] * body.speed
        return factor * body.vx, factor * body.vy

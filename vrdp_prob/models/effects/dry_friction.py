"""Dry friction with the table."""

from collections.abc import Mapping
from typing import ClassVar

from vrdp_prob.models.effects.effect import BodyView, Effect
from vrdp_prob.models.parameters import ROLLING_RESISTANCE, SLIDING_FRICTION
from vrdp_prob.models.simulator.formula import Scalar


class DryFriction(Effect):
    """Friction against the direction of motion, to rest and not past it."""

    name: ClassVar = "dry_friction"
    sentence: ClassVar = "Sliding and rolling bodies are slowed at a constant rate by the table until they rest."
    law: ClassVar = "a = -mu g v/|v|; mu is sliding_friction, for spheres rolling_resistance"
    source: ClassVar = "Ding et al., NeurIPS 2021 (VRDP), section 3.3, lambda_1 and lambda_2"
    parameters: ClassVar = (SLIDING_FRICTION, ROLLING_RESISTANCE)
    vanishes_at: ClassVar = {"sliding_friction": 0.0, "rolling_resistance": 0.0}

    def friction_factor(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> Scalar:
        """Friction coefficient of the body."""
        sliding, rolling = parameters["sliding_friction"], parameters["rolling_resistance"]
        return body.is_sphere * rolling + (1 - body.is_sphere) * sliding

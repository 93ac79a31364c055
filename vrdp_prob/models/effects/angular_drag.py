"""Decay of the spin about the vertical."""

from collections.abc import Mapping
from typing import ClassVar

from vrdp_prob.models.effects.effect import BodyView, Effect
from vrdp_prob.models.parameters import ANGULAR_DRAG
from vrdp_prob.models.simulator.formula import Scalar


class AngularDrag(Effect):
    """The spin about the vertical decays at a constant rate, to rest and not past it."""

    name: ClassVar = "angular_drag"
    sentence: ClassVar = "Spinning bodies stop spinning at a constant rate."
    law: ClassVar = "d(omega)/dt = -angular_drag sign(omega)"
    source: ClassVar = "Ding et al., NeurIPS 2021 (VRDP), appendix on the physics engine"
    parameters: ClassVar = (ANGULAR_DRAG,)
    vanishes_at: ClassVar = {"angular_drag": 0.0}

    def spin_deceleration(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> Scalar:
        """Rate of decay in rad/s^2."""
        return parameters["angular_drag"]

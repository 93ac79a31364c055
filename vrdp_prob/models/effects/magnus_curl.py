"""Paths that spin bends."""

from collections.abc import Mapping
from typing import ClassVar

from vrdp_prob.models.effects.effect import BodyView, Effect
from vrdp_prob.models.parameters import Parameter, Prior, Transform
from vrdp_prob.models.simulator.formula import Scalar

CURL = Parameter(
    "curl", "1", "acceleration across the path per spin and speed", Transform.IDENTITY, Prior(0.0, 0.1), 0.0
)


class MagnusCurl(Effect):
    """An acceleration across the velocity, in proportion to spin and speed."""

    name: ClassVar = "magnus_curl"
    sentence: ClassVar = "Spinning bodies run in curves."
    law: ClassVar = "a = curl spin (z x v)"
    source: ClassVar = "Magnus, Annalen der Physik 164 (1853)"
    parameters: ClassVar = (CURL,)
    vanishes_at: ClassVar = {"curl": 0.0}

    def acceleration(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> tuple[Scalar, Scalar]:
        """Acceleration in m/s^2 to the left of the path where curl and spin are positive."""
        factor = parameters["curl"] * body.spin
        return -factor * body.vy, factor * body.vx

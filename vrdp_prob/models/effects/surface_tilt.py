"""A table that is not level."""

from collections.abc import Mapping
from typing import ClassVar

from vrdp_prob.models.effects.effect import BodyView, Effect
from vrdp_prob.models.parameters import GRAVITY, Parameter, Prior, Transform
from vrdp_prob.models.simulator.formula import Scalar

TILT_X = Parameter(
    "tilt_x", "1", "sine of the table's slope, component in which x falls", Transform.IDENTITY, Prior(0.0, 0.02), 0.0
)
TILT_Y = Parameter(
    "tilt_y", "1", "sine of the table's slope, component in which y falls", Transform.IDENTITY, Prior(0.0, 0.02), 0.0
)


class SurfaceTilt(Effect):
    """The same acceleration for all bodies, in one direction."""

    name: ClassVar = "surface_tilt"
    sentence: ClassVar = "The table is not level: everything is drawn in one direction."
    law: ClassVar = "a = g (tilt_x, tilt_y), the vector (tilt_x, tilt_y) has the length sin(theta)"
    source: ClassVar = "gravity along an inclined plane"
    parameters: ClassVar = (TILT_X, TILT_Y)
    vanishes_at: ClassVar = {"tilt_x": 0.0, "tilt_y": 0.0}

    def acceleration(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> tuple[Scalar, Scalar]:
        """Acceleration in m/s^2 down the slope."""
        return GRAVITY * parameters["tilt_x"], GRAVITY * parameters["tilt_y"]

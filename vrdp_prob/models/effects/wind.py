"""Air that moves."""

from collections.abc import Mapping
from typing import ClassVar

from vrdp_prob.models.effects.effect import BodyView, Effect
from vrdp_prob.models.parameters import AIR_DRAG, Parameter, Prior, Transform
from vrdp_prob.models.simulator.formula import Scalar
from vrdp_prob.models.simulator.mathematics import length

WIND_X = Parameter("wind_x", "m/s", "velocity of the air along x", Transform.IDENTITY, Prior(0.0, 2.0), 0.0)
WIND_Y = Parameter("wind_y", "m/s", "velocity of the air along y", Transform.IDENTITY, Prior(0.0, 2.0), 0.0)


class Wind(Effect):
    """What moving air adds to the drag of still air, which `air_drag` has."""

    name: ClassVar = "wind"
    sentence: ClassVar = "The air moves and carries bodies along."
    law: ClassVar = "drag a = -air_drag |v - w| (v - w) with the wind w = (wind_x, wind_y)"
    source: ClassVar = "Galilean invariance of the drag law"
    parameters: ClassVar = (AIR_DRAG, WIND_X, WIND_Y)
    vanishes_at: ClassVar = {"wind_x": 0.0, "wind_y": 0.0}

    def acceleration(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> tuple[Scalar, Scalar]:
        """Drag in m/s^2 relative to the air, less that in still air."""
        x, y = body.vx - parameters["wind_x"], body.vy - parameters["wind_y"]
        relative, still = length(x, y), length(body.vx, body.vy)
        drag = parameters["air_drag"]
        return drag * (still * body.vx - relative * x), drag * (still * body.vy - relative * y)

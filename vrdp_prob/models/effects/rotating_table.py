"""A table, and a camera with it, that turns."""

from collections.abc import Mapping, Sequence
from typing import ClassVar

from vrdp_prob.models.effects.effect import BodyView, Effect
from vrdp_prob.models.effects.places import Region
from vrdp_prob.models.parameters import Parameter, Prior, Transform
from vrdp_prob.models.simulator.formula import Scalar
from vrdp_prob.scene import Tracks

TABLE_ROTATION = Parameter(
    "table_rotation", "rad/s", "rate at which table and camera turn", Transform.IDENTITY, Prior(0.0, 0.3), default=0.0
)
ROTATION_X = Parameter("rotation_x", "m", "x of the axis of rotation", Transform.IDENTITY, Prior(0.0, 1.0), 0.0)
ROTATION_Y = Parameter("rotation_y", "m", "y of the axis of rotation", Transform.IDENTITY, Prior(0.0, 1.0), 0.0)

REACH = 0.5
"""Standard deviation of each coordinate of its place, in half widths of the region where bodies were seen."""


class RotatingTable(Effect):
    """Coriolis and centrifugal acceleration, as seen from the turning table."""

    name: ClassVar = "rotating_table"
    sentence: ClassVar = "The table turns, and the camera with it: paths bend."
    law: ClassVar = "a = 2 W v x z + W^2 (x - x0), W = table_rotation, x0 = (rotation_x, rotation_y)"
    source: ClassVar = "Coriolis, Journal de l'Ecole polytechnique 15 (1835)"
    parameters: ClassVar = (TABLE_ROTATION, ROTATION_X, ROTATION_Y)
    vanishes_at: ClassVar = {"table_rotation": 0.0}

    def expected(self, videos: Sequence[Tracks]) -> Mapping[str, Parameter]:
        """The axis is somewhere in or around the region where bodies were seen."""
        return Region.of(videos).expected(ROTATION_X, ROTATION_Y, REACH)

    def acceleration(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> tuple[Scalar, Scalar]:
        """Acceleration in m/s^2 in the frame of the table."""
        rate = parameters["table_rotation"]
        x, y = body.x - parameters["rotation_x"], body.y - parameters["rotation_y"]
        return 2 * rate * body.vy + rate * rate * x, -2 * rate * body.vx + rate * rate * y

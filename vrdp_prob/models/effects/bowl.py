"""A table that is curved."""

from collections.abc import Mapping, Sequence
from typing import ClassVar

from vrdp_prob.models.effects.effect import BodyView, Effect
from vrdp_prob.models.effects.places import Region, places_around
from vrdp_prob.models.parameters import Parameter, Prior, Transform
from vrdp_prob.models.simulator.formula import Scalar
from vrdp_prob.scene import Tracks

BOWL_STIFFNESS = Parameter(
    "bowl_stiffness",
    "1/s^2",
    "acceleration towards the middle per distance; away from it where negative",
    Transform.IDENTITY,
    Prior(0.0, 0.2),
    default=0.0,
)
BOWL_X = Parameter(
    "bowl_x", "m", "x of the lowest (or highest) point", Transform.IDENTITY, Prior(0.0, 1.0), default=0.0
)
BOWL_Y = Parameter(
    "bowl_y", "m", "y of the lowest (or highest) point", Transform.IDENTITY, Prior(0.0, 1.0), default=0.0
)


SEARCH_SHARES = (-1.0, -0.5, 0.0, 0.5, 1.0)
"""Where the middle is looked for, in half widths of the region where bodies were seen."""

REACH = 0.5
"""Standard deviation of each coordinate of its place, in half widths of the region where bodies were seen."""


class Bowl(Effect):
    """A pull towards one point, in proportion to the distance."""

    name: ClassVar = "bowl"
    sentence: ClassVar = "The table is a shallow bowl or dome: bodies are drawn to one point or away from it."
    signed_sentences: ClassVar = (
        "The table is a shallow bowl: bodies are drawn to one point.",
        "The table is a shallow dome: bodies are drawn away from one point.",
    )
    law: ClassVar = "a = -bowl_stiffness (x - (bowl_x, bowl_y))"
    source: ClassVar = "gravity on a paraboloid, small slopes: bowl_stiffness is g over the radius of curvature"
    parameters: ClassVar = (BOWL_STIFFNESS, BOWL_X, BOWL_Y)
    vanishes_at: ClassVar = {"bowl_stiffness": 0.0}

    def expected(self, videos: Sequence[Tracks]) -> Mapping[str, Parameter]:
        """The middle is somewhere in or around the region where bodies were seen."""
        return Region.of(videos).expected(BOWL_X, BOWL_Y, REACH)

    def search_points(self, videos: Sequence[Tracks]) -> Sequence[Mapping[str, float]]:
        """Middles in and around the region where bodies were seen."""
        return [{"bowl_x": x, "bowl_y": y} for x, y in places_around(videos, SEARCH_SHARES)]

    def acceleration(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> tuple[Scalar, Scalar]:
        """Acceleration in m/s^2 towards the lowest point."""
        stiffness = parameters["bowl_stiffness"]
        return stiffness * (parameters["bowl_x"] - body.x), stiffness * (parameters["bowl_y"] - body.y)

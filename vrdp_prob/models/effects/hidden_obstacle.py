"""Something fixed that nobody sees."""

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

from jaxtyping import Float
from torch import Tensor

from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.places import Region
from vrdp_prob.models.effects.unmet import Unmet, largest_disc
from vrdp_prob.models.parameters import Parameter, Prior, Transform, restitution_parameter
from vrdp_prob.models.simulator.obstacle import Obstacle
from vrdp_prob.scene import Tracks

OBSTACLE_X = Parameter("obstacle_x", "m", "x of the obstacle", Transform.IDENTITY, Prior(0.0, 2.0), default=0.0)
OBSTACLE_Y = Parameter("obstacle_y", "m", "y of the obstacle", Transform.IDENTITY, Prior(0.0, 2.0), default=0.0)
OBSTACLE_RADIUS = Parameter(
    "obstacle_radius", "m", "radius of the obstacle", Transform.LOG, Prior(math.log(0.2), 0.7), default=0.2
)
OBSTACLE_RESTITUTION = restitution_parameter("obstacle_restitution", "restitution factor of the obstacle")

REACH, SIZE = 1.0, 0.07
"""Standard deviation of each coordinate of its place, and its radius, in half widths of the region where bodies were
seen."""


class HiddenObstacle(Effect):
    """A fixed disc that bodies bounce off."""

    name: ClassVar = "hidden_obstacle"
    sentence: ClassVar = "Something that cannot be seen stands in the way."
    law: ClassVar = "a fixed disc at (obstacle_x, obstacle_y) with obstacle_radius; e = r obstacle_restitution"
    source: ClassVar = "contact with a body of infinite mass"
    parameters: ClassVar = (OBSTACLE_X, OBSTACLE_Y, OBSTACLE_RADIUS, OBSTACLE_RESTITUTION)

    def expected(self, videos: Sequence[Tracks]) -> Mapping[str, Parameter]:
        """The obstacle is somewhere where bodies were seen, and small beside that."""
        region = Region.of(videos)
        return region.expected(OBSTACLE_X, OBSTACLE_Y, REACH) | region.expected_size(OBSTACLE_RADIUS, SIZE)

    def unmet(self, videos: Sequence[Tracks]) -> Mapping[str, Unmet]:
        """A disc is met by all that pass within its radius."""
        return {OBSTACLE_RADIUS.name: largest_disc(videos)}

    def obstacles(self, parameters: Mapping[str, Float[Tensor, "..."]]) -> Sequence[Obstacle]:
        """The disc."""
        names = ("obstacle_x", "obstacle_y", "obstacle_radius", "obstacle_restitution")
        return (Obstacle.disc(*(parameters[name] for name in names)),)

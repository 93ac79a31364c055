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


def _parameters(which: str = "") -> tuple[Parameter, Parameter, Parameter, Parameter]:
    """Place, radius and restitution of a disc, the names with a word that tells it from others."""
    x, y = (
        Parameter(f"{which}obstacle_{axis}", "m", f"{axis} of the obstacle", Transform.IDENTITY, Prior(0.0, 2.0), 0.0)
        for axis in "xy"
    )
    radius = Parameter(
        f"{which}obstacle_radius", "m", "radius of the obstacle", Transform.LOG, Prior(math.log(0.2), 0.7), default=0.2
    )
    return x, y, radius, restitution_parameter(f"{which}obstacle_restitution", "restitution factor of the obstacle")


def _law(which: str = "") -> str:
    return (
        f"a fixed disc at ({which}obstacle_x, {which}obstacle_y) with {which}obstacle_radius; "
        f"e = r {which}obstacle_restitution"
    )


REACH, SIZE = 1.0, 0.07
"""Standard deviation of each coordinate of its place, and its radius, in half widths of the region where bodies were
seen."""


class HiddenObstacle(Effect):
    """A fixed disc that bodies bounce off."""

    name: ClassVar = "hidden_obstacle"
    sentence: ClassVar = "Something that cannot be seen stands in the way."
    law: ClassVar = _law()
    source: ClassVar = "contact with a body of infinite mass"
    parameters: ClassVar = _parameters()

    def start(self, place: tuple[float, float], radius: float, restitution: float) -> dict[str, float]:
        """Values of its parameters in m and 1."""
        return dict(zip((one.name for one in self.parameters), (*place, radius, restitution), strict=True))

    def expected(self, videos: Sequence[Tracks]) -> Mapping[str, Parameter]:
        """The obstacle is somewhere where bodies were seen, and small beside that."""
        region, (x, y, radius, _) = Region.of(videos), self.parameters
        return region.expected(x, y, REACH) | region.expected_size(radius, SIZE)

    def unmet(self, videos: Sequence[Tracks]) -> Mapping[str, Unmet]:
        """A disc is met by all that pass within its radius."""
        return {self.parameters[2].name: largest_disc(videos)}

    @property
    def obstacle_restitutions(self) -> tuple[str, ...]:
        """Its one restitution."""
        return (self.parameters[-1].name,)

    def obstacles(self, parameters: Mapping[str, Float[Tensor, "..."]]) -> Sequence[Obstacle]:
        """The disc."""
        return (Obstacle.disc(*(parameters[one.name] for one in self.parameters)),)


class SecondHiddenObstacle(HiddenObstacle):
    """A second disc beside the first."""

    name: ClassVar = "second_hidden_obstacle"
    cause: ClassVar = HiddenObstacle.name
    follows: ClassVar = HiddenObstacle.name
    sentence: ClassVar = "Something further that cannot be seen stands in the way."
    law: ClassVar = _law("second_")
    parameters: ClassVar = _parameters("second_")

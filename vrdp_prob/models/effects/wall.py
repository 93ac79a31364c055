"""A straight wall that nobody sees."""

from collections.abc import Mapping, Sequence
from typing import ClassVar

import torch
from jaxtyping import Float
from torch import Tensor

from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.places import Region
from vrdp_prob.models.effects.unmet import Unmet, deepest_wall
from vrdp_prob.models.parameters import Parameter, Prior, Transform, restitution_parameter
from vrdp_prob.models.simulator.obstacle import Obstacle
from vrdp_prob.scene import Tracks

HALF_LENGTH = 20.0
"""Half the length of the wall in m: it ends nowhere that a body gets to."""


def _parameters(which: str = "") -> tuple[Parameter, Parameter, Parameter]:
    """Distance, direction and restitution of a wall, the names with a word that tells it from others."""
    return (
        Parameter(
            f"{which}hidden_wall_distance",
            "m",
            "distance of the wall from the origin",
            Transform.IDENTITY,
            Prior(0.0, 3.0),
            default=3.0,
        ),
        Parameter(
            f"{which}hidden_wall_direction",
            "rad",
            "direction from the origin to the wall, square to it",
            Transform.IDENTITY,
            Prior(0.0, 2.0),
            default=0.0,
        ),
        restitution_parameter(f"{which}hidden_wall_restitution", "restitution factor of the wall"),
    )


def _law(which: str = "") -> str:
    return (
        f"bodies touch the line x cos(a) + y sin(a) = {which}hidden_wall_distance with "
        f"a = {which}hidden_wall_direction; e = r {which}hidden_wall_restitution"
    )


REACH = 1.5
"""Standard deviation of its distance from the middle of the region where bodies were seen, in half widths of that."""


class Wall(Effect):
    """A fixed straight wall that bodies bounce off."""

    name: ClassVar = "wall"
    sentence: ClassVar = "A wall that cannot be seen throws bodies back."
    law: ClassVar = _law()
    source: ClassVar = "contact with a body of infinite mass"
    parameters: ClassVar = _parameters()

    def start(self, distance: float, direction: float, restitution: float) -> dict[str, float]:
        """Values of its parameters in m, rad and 1."""
        return dict(zip((one.name for one in self.parameters), (distance, direction, restitution), strict=True))

    def expected(self, videos: Sequence[Tracks]) -> Mapping[str, Parameter]:
        """The wall is somewhere in or around the region where bodies were seen."""
        return Region.of(videos).expected_distance(self.parameters[0], REACH)

    def unmet(self, videos: Sequence[Tracks]) -> Mapping[str, Unmet]:
        """No path goes through a wall."""
        return {self.parameters[0].name: deepest_wall(videos)}

    @property
    def obstacle_restitutions(self) -> tuple[str, ...]:
        """Its one restitution."""
        return (self.parameters[-1].name,)

    def obstacles(self, parameters: Mapping[str, Float[Tensor, "..."]]) -> Sequence[Obstacle]:
        """The wall."""
        distance, direction, restitution = (parameters[one.name] for one in self.parameters)
        x, y = torch.cos(direction), torch.sin(direction)
        ends = [
            coordinate
            for side in (-HALF_LENGTH, HALF_LENGTH)
            for coordinate in (distance * x - side * y, distance * y + side * x)
        ]
        return (Obstacle.walls(torch.stack(ends, dim=-1)[:, None], restitution[:, None]),)


class SecondWall(Wall):
    """A second wall beside the first."""

    name: ClassVar = "second_wall"
    cause: ClassVar = Wall.name
    follows: ClassVar = Wall.name
    sentence: ClassVar = "A further wall that cannot be seen throws bodies back."
    law: ClassVar = _law("second_")
    parameters: ClassVar = _parameters("second_")


class ThirdWall(Wall):
    """A third wall beside the second."""

    name: ClassVar = "third_wall"
    cause: ClassVar = Wall.name
    follows: ClassVar = SecondWall.name
    sentence: ClassVar = "A further wall that cannot be seen throws bodies back."
    law: ClassVar = _law("third_")
    parameters: ClassVar = _parameters("third_")


class FourthWall(Wall):
    """A fourth wall beside the third, with which a table is enclosed."""

    name: ClassVar = "fourth_wall"
    cause: ClassVar = Wall.name
    follows: ClassVar = ThirdWall.name
    sentence: ClassVar = "A further wall that cannot be seen throws bodies back."
    law: ClassVar = _law("fourth_")
    parameters: ClassVar = _parameters("fourth_")

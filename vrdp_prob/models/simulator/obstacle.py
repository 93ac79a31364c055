"""Fixed things that an effect adds to a scene."""

from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor

from vrdp_prob.models.simulator.outline import Outline


@dataclass(frozen=True)
class Obstacle:
    """A fixed disc or straight wall; gradients flow through all its tensors.

    Parameters
    ----------
    outline
        `Outline.DISC` or `Outline.WALL`.
    x, y, angle
        Position of its middle in m, and direction of a wall in rad.
    extent
        Radius of a disc or half the length of a wall, in m.
    restitution
        Restitution factor.
    """

    outline: Outline
    x: Float[Tensor, "world"]
    y: Float[Tensor, "world"]
    angle: Float[Tensor, "world"]
    extent: Float[Tensor, "world"]
    restitution: Float[Tensor, "world"]

    @classmethod
    def disc(
        cls,
        x: Float[Tensor, "world"],
        y: Float[Tensor, "world"],
        radius: Float[Tensor, "world"],
        restitution: Float[Tensor, "world"],
    ) -> "Obstacle":
        """A disc about (x, y)."""
        return cls(Outline.DISC, x, y, torch.zeros_like(x), radius, restitution)

    @classmethod
    def wall(
        cls,
        begin: tuple[Float[Tensor, "world"], Float[Tensor, "world"]],
        end: tuple[Float[Tensor, "world"], Float[Tensor, "world"]],
        restitution: Float[Tensor, "world"],
    ) -> "Obstacle":
        """A straight wall between two points; both its sides reflect."""
        along_x, along_y = end[0] - begin[0], end[1] - begin[1]
        return cls(
            Outline.WALL,
            (begin[0] + end[0]) / 2,
            (begin[1] + end[1]) / 2,
            torch.atan2(along_y, along_x),
            torch.hypot(along_x, along_y) / 2,
            restitution,
        )

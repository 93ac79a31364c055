"""Fixed things that an effect adds to a scene."""

from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor

from vrdp_prob.models.simulator.outline import Outline


@dataclass(frozen=True)
class Obstacle:
    """Fixed discs or straight walls, one or several alike; gradients flow through all tensors.

    Parameters
    ----------
    outline
        `Outline.DISC` or `Outline.WALL`.
    x, y, angle
        Position of the middle in m, and direction of a wall in rad.
    extent
        Radius of a disc or half the length of a wall, in m.
    restitution
        Restitution factor.
    """

    outline: Outline
    x: Float[Tensor, "world thing"]
    y: Float[Tensor, "world thing"]
    angle: Float[Tensor, "world thing"]
    extent: Float[Tensor, "world thing"]
    restitution: Float[Tensor, "world thing"]

    @classmethod
    def disc(
        cls,
        x: Float[Tensor, "world"],
        y: Float[Tensor, "world"],
        radius: Float[Tensor, "world"],
        restitution: Float[Tensor, "world"],
    ) -> "Obstacle":
        """A disc about (x, y)."""
        columns = [values[:, None] for values in (x, y, torch.zeros_like(x), radius, restitution)]
        return cls(Outline.DISC, *columns)

    @classmethod
    def walls(cls, lines: Float[Tensor, "world_or_one wall 4"], restitution: Float[Tensor, "world wall"]) -> "Obstacle":
        """Straight walls between end points (x1, y1, x2, y2) in m; both sides reflect."""
        x1, y1, x2, y2 = lines.expand(len(restitution), -1, -1).unbind(-1)
        angle, extent = torch.atan2(y2 - y1, x2 - x1), torch.hypot(x2 - x1, y2 - y1) / 2
        return cls(Outline.WALL, (x1 + x2) / 2, (y1 + y2) / 2, angle, extent, restitution)

"""What of a video's worlds is known beforehand, and the worlds that it makes of inferred quantities."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from vrdp_prob.models.parameters import VIDEO_START
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.scene import Shape, Tracks

UNKNOWN_RADIUS = 1e-6
"""Radius in m of a body whose radius is not known: it meets nothing."""

Quantities = Mapping[str, Float[Tensor, "point owner"]]
"""Values of the inferred quantities by name: one column per body (or wall), or a single one where it is shared."""


@dataclass(frozen=True)
class Scenery:
    """Bodies and walls of a video, without what is inferred of them.

    Parameters
    ----------
    shapes
        Shape of each body.
    release_time
        Time in s at which each body appears.
    radius
        Radius in m (half side of a cube).
    walls
        End points (x1, y1, x2, y2) in m.
    start
        Time stamp in s of the first frame.
    inertia
        Known moments of inertia (kg m^2), NaN where they follow from mass and shape; None where none is known.
    """

    shapes: tuple[Shape, ...]
    release_time: Float[Tensor, "body"]
    radius: Float[Tensor, "body"]
    walls: Float[Tensor, "wall 4"]
    start: float
    inertia: Float[Tensor, "body"] | None

    @classmethod
    def of(cls, tracks: Tracks) -> "Scenery":
        """The scenery of a video."""
        radii = [UNKNOWN_RADIUS if body.radius is None else body.radius for body in tracks.bodies]
        walls = np.array([(wall.x1, wall.y1, wall.x2, wall.y2) for wall in tracks.walls]).reshape(-1, 4)
        known = [float("nan") if body.inertia is None else body.inertia for body in tracks.bodies]
        return cls(
            shapes=tuple(body.shape for body in tracks.bodies),
            release_time=torch.from_numpy(tracks.first_seen),
            radius=torch.tensor(radii, dtype=torch.float64),
            walls=torch.from_numpy(walls),
            start=float(tracks.times[0]),
            inertia=None if np.isnan(known).all() else torch.tensor(known, dtype=torch.float64),
        )

    def worlds(self, model: PhysicsModel, quantities: Quantities) -> Worlds:
        """The worlds of some values of all quantities."""
        count = len(quantities["x"])
        start = torch.full((count,), self.start, dtype=torch.float64)
        return Worlds(
            shapes=self.shapes,
            position=torch.stack([quantities["x"], quantities["y"]], dim=-1),
            velocity=torch.stack([quantities["velocity_x"], quantities["velocity_y"]], dim=-1),
            angle=quantities["angle"],
            spin=quantities["spin"],
            release_time=self.release_time.expand(count, -1),
            mass=quantities["mass"],
            restitution=quantities["restitution"],
            radius=self.radius.expand(count, -1),
            present=torch.ones(count, len(self.shapes), dtype=torch.bool),
            parameters={
                one.name: quantities[one.name][:, 0] if one.scope.per_video else quantities[one.name]
                for one in model.parameters
            }
            | ({VIDEO_START: start} if VIDEO_START in model.layout.shared else {}),
            walls=self.walls,
            wall_restitution=quantities["wall_restitution"],
            inertia=None if self.inertia is None else self.inertia.expand(count, -1),
        )

"""From worlds to the arrays of the compiled kernel, by tensor operations that carry gradients."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor

from vrdp_prob.errors import InputError
from vrdp_prob.models.simulator.laws import CONSTANTS, Layout
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.scene import Shape

DISC, SQUARE, WALL = 0, 1, 2


@dataclass(frozen=True)
class KernelArrays:
    """Arrays of the kernel; walls are bodies that cannot move, after all others.

    Parameters
    ----------
    kinds
        Outline of each body (0 disc, 1 square, 2 wall), whether it cannot move, and whether it is there at all.
    bodies, shared, start
        Constants of the bodies, parameters of the worlds, states at release with the release times in s.
    """

    kinds: Int[np.ndarray, "world all 3"]
    bodies: Float[Tensor, "world all constant"]
    shared: Float[Tensor, "world parameter"]
    start: Float[Tensor, "world all state_and_time"]


def kernel_arrays(worlds: Worlds, layout: Layout, first_time: float) -> KernelArrays:
    """Arrays of a batch.

    Raises
    ------
    InputError
        If a parameter of the model is missing.
    """
    missing = [name for name in (*layout.shared, *layout.constants[len(CONSTANTS) :]) if name not in worlds.parameters]
    if missing:
        raise InputError(f"worlds: the model needs the parameter {missing[0]}; add it to 'parameters'.")
    shared = [worlds.parameters[name].to(torch.float64) for name in layout.shared]
    bodies, start = _body_constants(worlds, layout), _body_starts(worlds)
    if len(worlds.walls):
        walls = worlds.walls.to(torch.float64)
        bodies = torch.cat([bodies, _wall_constants(worlds, walls, layout)], dim=1)
        start = torch.cat([start, _wall_starts(worlds, walls, first_time)], dim=1)
    return KernelArrays(
        kinds=_kinds(worlds),
        bodies=bodies,
        shared=torch.stack(shared, dim=-1) if shared else torch.zeros(len(worlds), 0, dtype=torch.float64),
        start=start,
    )


def _kinds(worlds: Worlds) -> Int[np.ndarray, "world all 3"]:
    count = len(worlds.shapes)
    kinds = np.zeros((len(worlds), count + len(worlds.walls), 3), dtype=np.int64)
    kinds[:, :count, 0] = [DISC if shape.is_disc else SQUARE for shape in worlds.shapes]
    kinds[:, :count, 2] = worlds.present.cpu().numpy()
    kinds[:, count:] = (WALL, 1, 1)
    return kinds


def _body_constants(worlds: Worlds, layout: Layout) -> Float[Tensor, "world body constant"]:
    mass = worlds.mass.to(torch.float64)
    sphere = torch.tensor([shape is Shape.SPHERE for shape in worlds.shapes], dtype=torch.float64)
    columns = [
        mass,
        1 / mass,
        1 / worlds.moment_of_inertia.to(torch.float64),
        worlds.restitution.to(torch.float64),
        worlds.radius.to(torch.float64),
        sphere.expand_as(mass),
        *(worlds.parameters[name].to(torch.float64) for name in layout.constants[len(CONSTANTS) :]),
    ]
    return torch.stack(columns, dim=-1)


def _body_starts(worlds: Worlds) -> Float[Tensor, "world body state_and_time"]:
    columns = [worlds.angle, worlds.velocity, worlds.spin, worlds.release_time]
    parts = [worlds.position, *(part if part.ndim == 3 else part[..., None] for part in columns)]
    return torch.cat([part.to(torch.float64) for part in parts], dim=-1)


def _wall_constants(
    worlds: Worlds, walls: Float[Tensor, "wall 4"], layout: Layout
) -> Float[Tensor, "world wall constant"]:
    half_length = (walls[:, 2:] - walls[:, :2]).norm(dim=-1) / 2
    constants = torch.zeros(len(worlds), len(walls), len(layout.constants), dtype=torch.float64)
    constants[..., CONSTANTS.index("mass")] = 1.0
    columns = list(constants.unbind(-1))
    columns[CONSTANTS.index("restitution")] = worlds.restitution_of_walls.to(torch.float64)
    columns[CONSTANTS.index("radius")] = half_length.expand(len(worlds), -1)
    return torch.stack(columns, dim=-1)


def _wall_starts(
    worlds: Worlds, walls: Float[Tensor, "wall 4"], first_time: float
) -> Float[Tensor, "world wall state_and_time"]:
    middle = (walls[:, 2:] + walls[:, :2]) / 2
    along = walls[:, 2:] - walls[:, :2]
    angle = torch.atan2(along[:, 1], along[:, 0])
    still = torch.zeros(len(walls), 3, dtype=torch.float64)
    states = torch.cat([middle, angle[:, None], still], dim=-1).expand(len(worlds), -1, -1)
    earliest = worlds.release_time.detach().min(dim=1).values.clamp(max=first_time).to(torch.float64)
    return torch.cat([states, earliest[:, None, None].expand(-1, len(walls), 1)], dim=-1)

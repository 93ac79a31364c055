"""From worlds to the arrays of the compiled kernel, by tensor operations that carry gradients."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor

from vrdp_prob.errors import InputError
from vrdp_prob.models.parameters import VIDEO_START
from vrdp_prob.models.simulator.laws import CONSTANTS, Layout
from vrdp_prob.models.simulator.motion import slips
from vrdp_prob.models.simulator.obstacle import Obstacle
from vrdp_prob.models.simulator.outline import Outline
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.scene import Shape

if TYPE_CHECKING:
    from vrdp_prob.models.effects.effect import Effect


@dataclass(frozen=True)
class KernelArrays:
    """Arrays of the kernel; walls and obstacles are bodies that cannot move, after all others.

    Parameters
    ----------
    kinds
        Outline of each body, whether it cannot move, and whether it is there at all.
    bodies, shared, start
        Constants of the bodies, parameters of the worlds, states at release with the release times in s.
    """

    kinds: Int[np.ndarray, "world all 3"]
    bodies: Float[Tensor, "world all constant"]
    shared: Float[Tensor, "world parameter"]
    start: Float[Tensor, "world all state_and_time"]


def kernel_arrays(worlds: Worlds, effects: "Sequence[Effect]", layout: Layout, first_time: float) -> KernelArrays:
    """Arrays of a batch.

    Raises
    ------
    InputError
        If a parameter of the model is missing.
    """
    known = {VIDEO_START: torch.zeros(len(worlds)), **worlds.parameters}
    missing = [name for name in (*layout.shared, *layout.constants[len(CONSTANTS) :]) if name not in known]
    if missing:
        raise InputError(f"worlds: the model needs the parameter {missing[0]}; add it to 'parameters'.")
    shared = [known[name].to(torch.float64) for name in layout.shared]
    bodies, start = _body_constants(worlds, effects, layout), _body_starts(worlds, effects)
    fixed = fixed_things(worlds, effects)
    if fixed:
        earliest = worlds.release_time.detach().min(dim=1).values.clamp(max=first_time).to(torch.float64)
        bodies = torch.cat([bodies, *(_fixed_constants(things, layout) for things in fixed)], dim=1)
        start = torch.cat([start, *(_fixed_start(things, earliest, start.shape[-1]) for things in fixed)], dim=1)
    return KernelArrays(
        kinds=_kinds(worlds, fixed),
        bodies=bodies,
        shared=torch.stack(shared, dim=-1) if shared else torch.zeros(len(worlds), 0, dtype=torch.float64),
        start=start,
    )


def fixed_things(worlds: Worlds, effects: "Sequence[Effect]") -> list[Obstacle]:
    """Walls of the worlds, then what effects add."""
    found = [obstacle for effect in effects for obstacle in effect.obstacles(worlds.parameters)]
    if not len(worlds.walls):
        return found
    return [Obstacle.walls(worlds.walls.to(torch.float64)[None], worlds.restitution_of_walls), *found]


def _kinds(worlds: Worlds, fixed: Sequence[Obstacle]) -> Int[np.ndarray, "world all 3"]:
    count = len(worlds.shapes)
    outlines = [things.outline for things in fixed for _ in range(things.x.shape[1])]
    kinds = np.zeros((len(worlds), count + len(outlines), 3), dtype=np.int64)
    kinds[:, :count, 0] = [Outline.DISC if shape.is_disc else Outline.SQUARE for shape in worlds.shapes]
    kinds[:, :count, 2] = worlds.present.cpu().numpy()
    kinds[:, count:, 0], kinds[:, count:, 1:] = outlines, 1
    return kinds


def _body_constants(
    worlds: Worlds, effects: "Sequence[Effect]", layout: Layout
) -> Float[Tensor, "world body constant"]:
    mass, radius = worlds.mass.to(torch.float64), worlds.radius.to(torch.float64)
    for effect in effects:
        radius = effect.contact_radius(radius, worlds.parameters)
    columns = [
        mass,
        1 / mass,
        1 / worlds.moment_of_inertia.to(torch.float64),
        worlds.restitution.to(torch.float64),
        radius,
        _is_sphere(worlds).expand_as(mass),
        *(worlds.parameters[name].to(torch.float64) for name in layout.constants[len(CONSTANTS) :]),
    ]
    return torch.stack(columns, dim=-1)


def _is_sphere(worlds: Worlds) -> Float[Tensor, "body"]:
    return torch.tensor([shape is Shape.SPHERE for shape in worlds.shapes], dtype=torch.float64)


def _body_starts(worlds: Worlds, effects: "Sequence[Effect]") -> Float[Tensor, "world body state_and_time"]:
    columns = [worlds.angle[..., None], worlds.velocity, worlds.spin[..., None]]
    rolling = torch.zeros_like(worlds.velocity)
    if slips(effects):
        stated = [effect.rolling_velocity(worlds.velocity, worlds.parameters) for effect in effects]
        of_spheres = ([rolling] + [value for value in (*stated, worlds.rolling) if value is not None])[-1]
        rolling = torch.where(_is_sphere(worlds)[:, None] > 0, of_spheres, worlds.velocity)
    parts = [worlds.position, *columns, rolling, worlds.release_time[..., None]]
    return torch.cat([part.to(torch.float64) for part in parts], dim=-1)


def _fixed_constants(things: Obstacle, layout: Layout) -> Float[Tensor, "world thing constant"]:
    nothing = torch.zeros_like(things.extent, dtype=torch.float64)
    columns = [nothing] * len(layout.constants)
    columns[CONSTANTS.index("mass")] = nothing + 1.0
    columns[CONSTANTS.index("restitution")] = things.restitution.to(torch.float64)
    columns[CONSTANTS.index("radius")] = things.extent.to(torch.float64)
    return torch.stack(columns, dim=-1)


def _fixed_start(
    things: Obstacle, earliest: Float[Tensor, "world"], columns: int
) -> Float[Tensor, "world thing state_and_time"]:
    still = [torch.zeros_like(things.x, dtype=torch.float64)] * (columns - 4)
    place = [value.to(torch.float64) for value in (things.x, things.y, things.angle)]
    return torch.stack([*place, *still, earliest[:, None].expand_as(things.x)], dim=-1)

"""What the effects of a model do to the measurement: the clock that stamps the frames, the lens that sees positions."""

from collections.abc import Mapping

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from vrdp_prob.models.physics import PhysicsModel

Parameters = Mapping[str, Float[Tensor, "..."]]
"""Parameters of a model by name, of each world (and body)."""


def changes_clock(model: PhysicsModel) -> bool:
    """Whether the true times of frames differ from their stamps."""
    return any(effect.overrides("measured_times") for effect in model.effects)


def jitters(model: PhysicsModel) -> bool:
    """Whether frames come early or late by chance."""
    return any(effect.overrides("frame_jitter") for effect in model.effects)


def changes_positions(model: PhysicsModel) -> bool:
    """Whether measured positions differ from the true ones."""
    return any(effect.overrides("measured_positions") for effect in model.effects)


def true_times(
    model: PhysicsModel, parameters: Parameters, stamps: Float[Tensor, "world time"]
) -> tuple[Float[Tensor, "world time"], Bool[Tensor, "world"]]:
    """True times in s of frames with time stamps, and whether they increase (else they are the stamps)."""
    times = stamps
    for effect in model.effects:
        times = effect.measured_times(times, parameters)
    increasing = (times.detach().diff(dim=1) > 0).all(dim=1) & torch.isfinite(times.detach()).all(dim=1)
    return torch.where(increasing[:, None], times, stamps), increasing


def measured_positions(
    model: PhysicsModel,
    parameters: Parameters,
    positions: Float[Tensor, "world time body 2"],
    times: Float[Tensor, "world_or_one time"],
) -> Float[Tensor, "world time body 2"]:
    """Positions in m as they are measured."""
    for effect in model.effects:
        positions = effect.measured_positions(positions, times.expand(len(positions), -1), parameters)
    return positions


def frame_jitter(model: PhysicsModel, parameters: Parameters) -> Float[Tensor, "world"]:
    """Standard deviation in s of the true times of frames, of a model in which they come early or late by chance."""
    found = [effect.frame_jitter(parameters) for effect in model.effects]
    return torch.stack([one for one in found if one is not None]).square().sum(dim=0).sqrt()

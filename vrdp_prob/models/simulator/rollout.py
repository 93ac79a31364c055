"""Simulate a batch of worlds: the result, and the gradient through the compiled kernel."""

from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from vrdp_prob.errors import InputError
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.arrays import KernelArrays, kernel_arrays
from vrdp_prob.models.simulator.events import EventTable, Tapes
from vrdp_prob.models.simulator.outcome import Outcome
from vrdp_prob.models.simulator.worlds import Worlds

EVENT_LIMIT = 10_000
"""Events of one world after which its simulation breaks off, unless the caller says otherwise."""


@dataclass(frozen=True)
class Rollout:
    """What happened in a batch of worlds; gradients flow through `trajectory` and `velocity`.

    Parameters
    ----------
    times
        Times in s.
    trajectory
        x and y in m and angle in rad; before its release a body is shown in the state it is released with, and so is a
        removed body.
    velocity
        Velocity in m/s and spin in rad/s.
    exists
        Whether a body is present and released.
    events
        Collisions, contacts with walls, and stops.
    outcome
        How the simulation of each world ended.
    """

    times: Float[Tensor, "time"]
    trajectory: Float[Tensor, "world time body 3"]
    velocity: Float[Tensor, "world time body 3"]
    exists: Bool[Tensor, "world time body"]
    events: EventTable
    outcome: tuple[Outcome, ...]

    @property
    def fine(self) -> Bool[np.ndarray, "world"]:
        """Whether each world was simulated without trouble."""
        return np.array([outcome is Outcome.OK for outcome in self.outcome], dtype=bool)


def simulate(
    worlds: Worlds,
    times: Float[Tensor, "time"],
    model: PhysicsModel | None = None,
    *,
    event_limit: int = EVENT_LIMIT,
) -> Rollout:
    """Simulate worlds to given times.

    Parameters
    ----------
    worlds
        The worlds; their tensors may be of any floating type and device, the computation is in float64 on the CPU.
    times
        Times in s, increasing.
    model
        The physics, the base model where none is given.
    event_limit
        Events of one world after which its simulation breaks off with the outcome `EVENT_LIMIT`.

    Returns
    -------
    The rollout, in the floating type and on the device of `worlds.position`. It is differentiable once by all tensors
    of the worlds and by the times; the derivative holds the order of events fixed.

    Raises
    ------
    InputError
        If the times are not finite and increasing, or a parameter of the model is missing.
    """
    model = model if model is not None else PhysicsModel.base()
    detached = times.detach()
    if len(times) == 0 or not torch.isfinite(detached).all() or (detached.diff() <= 0).any():
        raise InputError("simulate: the times must be finite and increasing, at least one.")
    arrays = kernel_arrays(worlds, model.layout, float(detached[0]))
    flat = (arrays.bodies, arrays.shared, arrays.start, arrays.release, times.to(torch.float64))
    run = _Run(model.kernel, arrays, event_limit)
    states = _Simulation.apply(run, *(tensor.cpu() for tensor in flat))
    states = states[:, :, : len(worlds.shapes)].to(worlds.position)
    released = times.to(worlds.release_time)[None, :, None] >= worlds.release_time[:, None, :]
    return Rollout(
        times=times,
        trajectory=states[..., :3],
        velocity=states[..., 3:],
        exists=released.detach() & worlds.present[:, None, :],
        events=EventTable.of(run.tapes, len(worlds.shapes)),
        outcome=tuple(Outcome(int(code)) for code in run.outcomes),
    )


class _Run:
    """One call of the kernel, and what its derivative needs to know of it."""

    def __init__(self, kernel: ModuleType, arrays: KernelArrays, event_limit: int) -> None:
        self.kernel, self.arrays, self.event_limit = kernel, arrays, event_limit
        self.outcomes: Int[np.ndarray, "world"] = np.zeros(len(arrays.present), dtype=np.int64)
        self.tapes: Tapes

    def forward(self, inputs: tuple[Tensor, ...]) -> Tensor:
        bodies, shared, start, release, times = (np.ascontiguousarray(tensor.numpy()) for tensor in inputs)
        arrays = self.arrays
        states = np.empty((len(bodies), len(times), *start.shape[1:]))
        self.tapes = Tapes(
            *self.kernel.rollout_batch(
                arrays.shape,
                arrays.fixed,
                bodies,
                shared,
                start,
                release,
                arrays.present,
                times,
                self.event_limit,
                states,
                self.outcomes,
            )
        )
        return torch.from_numpy(states)


class _Simulation(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, run: _Run, *inputs: Tensor) -> Tensor:
        ctx.run = run
        ctx.save_for_backward(*inputs)
        return run.forward(tuple(tensor.detach() for tensor in inputs))

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx: Any, *bars: Tensor) -> tuple[Tensor | None, ...]:
        inputs = ctx.saved_tensors
        return None, *(_differences(ctx.run, inputs, index, bars[0]) for index in range(len(inputs)))


def _differences(run: _Run, inputs: tuple[Tensor, ...], index: int, bar: Tensor) -> Tensor:
    step = 1e-6
    gradient = torch.zeros_like(inputs[index])
    per_world = index < len(inputs) - 1
    flat = gradient.view(len(gradient), -1) if per_world else gradient.view(1, -1)
    for column in range(flat.shape[1]):
        values = []
        for sign in (1, -1):
            moved = [tensor.clone() for tensor in inputs]
            moved[index].view(flat.shape[0], -1)[:, column] += sign * step
            values.append((_Run(run.kernel, run.arrays, run.event_limit).forward(tuple(moved)) * bar).sum((1, 2, 3)))
        difference = (values[0] - values[1]) / (2 * step)
        flat[:, column] = difference if per_world else difference.sum()
    return gradient

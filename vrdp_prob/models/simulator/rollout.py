"""Simulate a batch of worlds: the result, and the gradient through the compiled kernel."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from types import ModuleType
from typing import Any

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from vrdp_prob.errors import InputError
from vrdp_prob.models.parameters import Scope
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.arrays import KernelArrays, kernel_arrays
from vrdp_prob.models.simulator.events import EventTable, Tapes
from vrdp_prob.models.simulator.outcome import Outcome
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.scene import Shape

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
    outcome
        How the simulation of each world ended.
    tapes
        What the kernel recorded.
    """

    times: Float[Tensor, "time"]
    trajectory: Float[Tensor, "world time body 3"]
    velocity: Float[Tensor, "world time body 3"]
    exists: Bool[Tensor, "world time body"]
    outcome: tuple[Outcome, ...]
    tapes: Tapes

    @cached_property
    def events(self) -> EventTable:
        """Collisions, contacts with walls, and stops."""
        return EventTable.of(self.tapes, self.exists.shape[-1])

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
    flat = (arrays.bodies, arrays.shared, arrays.start, times.to(torch.float64))
    run = _Run(model.kernel, arrays, event_limit)
    # torch does not annotate Function.apply.
    states: Tensor = _Simulation.apply(run, *(tensor.cpu() for tensor in flat))  # type: ignore[no-untyped-call]
    states = states[:, :, : len(worlds.shapes)].to(worlds.position)
    released = times.to(worlds.release_time)[None, :, None] >= worlds.release_time[:, None, :]
    return Rollout(
        times=times,
        trajectory=states[..., :3],
        velocity=states[..., 3:],
        exists=released.detach() & worlds.present[:, None, :],
        outcome=tuple(Outcome(int(code)) for code in run.outcomes),
        tapes=run.tapes,
    )


class _Run:
    """One call of the kernel, and what its derivative needs to know of it."""

    def __init__(self, kernel: ModuleType, arrays: KernelArrays, event_limit: int) -> None:
        self.kernel, self.kinds, self.event_limit = kernel, arrays.kinds, event_limit
        self.outcomes: Int[np.ndarray, "world"] = np.zeros(len(arrays.kinds), dtype=np.int64)
        self.tapes: Tapes

    def forward(self, inputs: Sequence[Tensor]) -> Tensor:
        """States [world, time, body, state] of bodies and walls."""
        bodies, shared, start, times = (tensor.detach().contiguous().numpy() for tensor in inputs)
        states = np.empty((*self.kinds.shape[:1], len(times), self.kinds.shape[1], start.shape[2] - 1))
        rows = self.kernel.rollout_batch(
            self.kinds, bodies, shared, start, times, self.event_limit, states, self.outcomes
        )
        self.tapes = Tapes(*rows)
        return torch.from_numpy(states)

    def backward(self, inputs: Sequence[Tensor], bar: Tensor) -> tuple[Tensor, ...]:
        """Derivative by all inputs of the sum of states times `bar`."""
        arrays = [tensor.detach().contiguous().numpy() for tensor in inputs]
        bars = [np.zeros_like(array) for array in arrays]
        self.kernel.reverse_batch(
            self.kinds, *arrays, self.outcomes, *self.tapes, bar.to(torch.float64).contiguous().numpy(), *bars
        )
        return tuple(torch.from_numpy(array) for array in bars)


class _Simulation(torch.autograd.Function):
    """The kernel as a differentiable function of the tensors `bodies`, `shared`, `start` and `times`."""

    @staticmethod
    def forward(ctx: Any, run: _Run, *inputs: Tensor) -> Tensor:
        ctx.run = run
        ctx.save_for_backward(*inputs)
        return run.forward(inputs)

    @staticmethod
    def backward(ctx: Any, bar: Tensor) -> tuple[Tensor | None, ...]:
        # Grad mode is on in a backward pass only where somebody wants to differentiate its result.
        if torch.is_grad_enabled():
            raise RuntimeError("simulate has a first derivative only; call backward or grad with create_graph=False.")
        return None, *ctx.run.backward(ctx.saved_tensors, bar)


def compile_model(model: PhysicsModel | None = None) -> None:
    """Compile the kernel of a model and its derivative now rather than in the first simulation.

    The compiled code is kept in the user's cache, so this takes its half a minute once per machine and set of effects.

    Parameters
    ----------
    model
        The physics, the base model where none is given.
    """
    physics = PhysicsModel.base() if model is None else model
    one = torch.ones(1, 1, dtype=torch.float64)
    own = [parameter for parameter in physics.parameters if parameter.scope is Scope.BODY]
    shared = [parameter for parameter in physics.parameters if parameter.scope is Scope.SHARED]
    worlds = Worlds(
        shapes=(Shape.CUBE,),
        position=torch.zeros(1, 1, 2, dtype=torch.float64),
        velocity=torch.ones(1, 1, 2, dtype=torch.float64, requires_grad=True),
        angle=0 * one,
        spin=one,
        release_time=0 * one,
        mass=one,
        restitution=one,
        radius=one,
        present=torch.ones(1, 1, dtype=torch.bool),
        parameters={
            **{parameter.name: parameter.default * one for parameter in own},
            **{parameter.name: parameter.default * one[0] for parameter in shared},
        },
    )
    rollout = simulate(worlds, torch.tensor([0.0, 0.1], dtype=torch.float64), physics)
    torch.autograd.grad(rollout.trajectory.sum(), worlds.velocity)

"""Simulate a batch of worlds: the result, and the gradient through the compiled kernel."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from typing import Any

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from vrdp_prob.errors import InputError
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.arrays import KernelArrays, kernel_arrays
from vrdp_prob.models.simulator.events import EventTable, Tapes
from vrdp_prob.models.simulator.kernel import Kernel
from vrdp_prob.models.simulator.outcome import OUTCOMES, Outcome
from vrdp_prob.models.simulator.work import record_work
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.scene import Shape

EVENT_LIMIT = 10_000
"""Events of one world after which its simulation breaks off, unless the caller says otherwise."""
FIRST_ROWS = 64
"""Rows of the tape per world and body for which there is room at first."""


@dataclass(frozen=True)
class Rollout:
    """What happened in a batch of worlds; gradients flow through `trajectory` and `velocity`.

    Parameters
    ----------
    times
        Times in s, one row where they are the same in all worlds.
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
    wall_count
        Number of walls of the scene; what effects add comes after them.
    """

    times: Float[Tensor, "world_or_one time"]
    trajectory: Float[Tensor, "world time body 3"]
    velocity: Float[Tensor, "world time body 3"]
    exists: Bool[Tensor, "world time body"]
    outcome: tuple[Outcome, ...]
    tapes: Tapes
    wall_count: int

    @cached_property
    def events(self) -> EventTable:
        """Collisions, contacts with walls and obstacles, stops, and what else changed the motion at once."""
        return EventTable.of(self.tapes, self.exists.shape[-1], self.wall_count)

    @property
    def fine(self) -> Bool[np.ndarray, "world"]:
        """Whether each world was simulated without trouble."""
        return np.array([outcome is Outcome.OK for outcome in self.outcome], dtype=bool)


def simulate(
    worlds: Worlds,
    times: Float[Tensor, "time"] | Float[Tensor, "world time"],
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
        Times in s, increasing; of all worlds, or of each.
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
    rows = times[None] if times.ndim == 1 else times
    _check(rows.detach(), len(worlds))
    arrays = kernel_arrays(worlds.on_processor(), model.effects, model.layout, float(rows.detach().min()))
    flat = (arrays.bodies, arrays.shared, arrays.start, rows.to(torch.float64))
    run = _Run(model.kernel, arrays, len(worlds.shapes), event_limit)
    # torch does not annotate Function.apply.
    states: tuple[Tensor, Tensor] = _Simulation.apply(  # type: ignore[no-untyped-call]
        run, *(tensor.cpu() for tensor in flat)
    )
    released = rows.to(worlds.release_time)[:, :, None] >= worlds.release_time[:, None, :]
    return Rollout(
        times=rows,
        trajectory=states[0].to(worlds.position),
        velocity=states[1].to(worlds.position),
        exists=released.detach() & worlds.present[:, None, :],
        outcome=tuple(OUTCOMES[code] for code in run.outcomes.tolist()),
        tapes=run.tapes,
        wall_count=len(worlds.walls),
    )


def _check(times: Float[Tensor, "world_or_one time"], world_count: int) -> None:
    if times.shape[1] == 0 or not torch.isfinite(times).all() or (times.diff(dim=1) <= 0).any():
        raise InputError("simulate: the times must be finite and increasing, at least one.")
    if len(times) not in (1, world_count):
        raise InputError(
            f"simulate: there are times of {len(times)} worlds, but {world_count} worlds; give one row each."
        )


class _Run:
    """One call of the kernel, and what its derivative needs to know of it."""

    def __init__(self, kernel: Kernel, arrays: KernelArrays, shown: int, event_limit: int) -> None:
        self.kernel, self.kinds, self.event_limit = kernel, arrays.kinds, event_limit
        self.outcomes: Int[np.ndarray, "world"] = np.zeros(len(arrays.kinds), dtype=np.int64)
        self.tapes: Tapes
        functions, bodies = kernel.functions, arrays.kinds.shape[1]
        phase, touches = functions.SIDES + kernel.boundary_count, functions.TOUCHES_PER_BODY * bodies
        self._sizes = {
            "body": bodies,
            "shown": shown,
            "constant": arrays.bodies.shape[2],
            "parameter": arrays.shared.shape[1],
            "entry": len(kernel.model),
            "kick": kernel.kick_count,
            "phase": phase,
            "number": max(functions.PIECE_PHASE + phase, functions.CLOSING_SPEED + 8),
            "list": bodies + 2,
            "member": bodies + 1,
            "touch": touches,
            "column": touches + 1,
        }

    def forward(self, inputs: Sequence[Tensor]) -> tuple[Tensor, Tensor]:
        """Trajectory and velocity [world, time, body, 3]."""
        arrays = self._arrays(inputs)
        functions, count, frames = self.kernel.functions, len(self.kinds), inputs[3].shape[1]
        trajectory, velocity = (np.empty((count, frames, self._sizes["shown"], 3)) for _ in range(2))
        tapes, done = self._empty_tapes(FIRST_ROWS * (count + self._sizes["body"])), 0
        while done < count:
            results = trajectory, velocity, self.outcomes, *tapes
            sizes = self._sizes | {"row": len(tapes.integers), "frame": frames, "moving_frame": frames}
            rooms = [bundle.workspace(sizes) for bundle in (functions.World, functions.Pairs, functions.Tape)]
            done = functions.rollout_batch(*arrays, self.event_limit, *results, done, *chain(*rooms))
            if done < count:
                tapes = self._longer(tapes)
        last = int(tapes.first_row[-1])
        self.tapes = Tapes(tapes.integers[:last], tapes.numbers[:last], tapes.first_row)
        record_work(last)
        return torch.from_numpy(trajectory), torch.from_numpy(velocity)

    def _arrays(self, inputs: Sequence[Tensor]) -> tuple[np.ndarray, ...]:
        """First arguments of the kernel."""
        return self.kernel.model, self.kinds, *(tensor.detach().contiguous().numpy() for tensor in inputs)

    def _empty_tapes(self, rows: int) -> Tapes:
        integers = np.zeros((rows, self.kernel.functions.INTEGERS), np.int64)
        return Tapes(integers, np.zeros((rows, self._sizes["number"])), np.zeros(len(self.kinds) + 1, np.int64))

    def _longer(self, tapes: Tapes) -> Tapes:
        """Twice as long tapes, with what is written."""
        longer = self._empty_tapes(2 * len(tapes.integers))
        for new, old in zip(longer, tapes, strict=True):
            new[: len(old)] = old
        return longer

    def backward(
        self, inputs: Sequence[Tensor], bars: Sequence[Tensor | None], *, of_times: bool
    ) -> tuple[Tensor | None, ...]:
        """Derivative by all inputs of the sum of trajectory and velocity times `bars`; None where that is 0."""
        arrays, functions, shown = self._arrays(inputs), self.kernel.functions, self._sizes["shown"]
        results = [np.zeros_like(array) for array in arrays[2:5]]
        # Empty where nobody asks, which the kernel takes as a sign.
        results.append(np.zeros_like(arrays[5]) if of_times else np.zeros((1, 0)))
        shape = len(self.kinds), inputs[3].shape[1], shown, 3
        seen = [_contiguous(bars[0]) if bars[0] is not None else np.zeros(shape)]
        seen.append(_contiguous(bars[1]) if bars[1] is not None else np.zeros((1, 0, shown, 3)))
        record_work(int(self.tapes.first_row[-1]))
        sizes = {"row": len(self.tapes.integers), "frame": shape[1], "moving_frame": seen[1].shape[1]}
        sizes |= self._sizes | {"asked_frame": results[3].shape[1]}
        rooms = [bundle.workspace(sizes) for bundle in (functions.World, functions.Tape, functions.Adjoint)]
        functions.reverse_batch(*arrays, self.outcomes, *self.tapes, *seen, *results, *chain(*rooms))
        gradients = [torch.from_numpy(array) for array in results]
        return (*gradients[:3], gradients[3] if of_times else None)


def _contiguous(bar: Tensor) -> Float[np.ndarray, "..."]:
    return bar.detach().to(torch.float64).contiguous().numpy()


class _Simulation(torch.autograd.Function):
    """The kernel as a differentiable function of the tensors `bodies`, `shared`, `start` and `times`."""

    @staticmethod
    def forward(ctx: Any, run: _Run, *inputs: Tensor) -> tuple[Tensor, Tensor]:
        ctx.run = run
        ctx.set_materialize_grads(False)
        ctx.save_for_backward(*inputs)
        return run.forward(inputs)

    @staticmethod
    def backward(ctx: Any, *bars: Tensor | None) -> tuple[Tensor | None, ...]:
        # Grad mode is on in a backward pass only where somebody wants to differentiate its result.
        if torch.is_grad_enabled():
            raise RuntimeError("simulate has a first derivative only; call backward or grad with create_graph=False.")
        return None, *ctx.run.backward(ctx.saved_tensors, bars, of_times=ctx.needs_input_grad[4])


def compile_model(model: PhysicsModel | None = None) -> None:
    """Compile the kernel of a model and its derivative now rather than in the first simulation.

    The kernels are the same for all models and kept in the user's cache: they take half a minute, once per machine. The
    laws of a model take a twentieth of a second in every process.

    Parameters
    ----------
    model
        The physics, the base model where none is given.
    """
    physics = PhysicsModel.base() if model is None else model
    one = torch.ones(1, 1, dtype=torch.float64)
    own = [parameter for parameter in physics.parameters if not parameter.scope.per_video]
    shared = [parameter for parameter in physics.parameters if parameter.scope.per_video]
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

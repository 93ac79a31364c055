"""The peer in torch: a plain batched simulator with fixed steps, differentiated by autograd.

The physics is in `_fixed_step.py` and `_fixed_step_contacts.py`.

What was tried to make it fast (milliseconds per world for log density and gradient
of 5 discs, at 1 world and at 256 worlds; a busy machine, so compare within the line):

- `linalg.vector_norm` over the axis of x and y: 120 microseconds for 1280 vectors, where the root of the sum of squares
  takes 9;
- `addcdiv` and `addcmul` for friction and drag: fewer nodes per step, kept;
- cosine and sine once per square instead of once per pair, bodies of a pair picked by a product with a matrix instead
  of indices, corners of squares without derivative except for the one that touches: kept;
- all pairs in every step: 470 and 3.7; kinds of pairs of which none is near left out: 190 and 5.1; the pairs that are
  near gathered, the rest left out: 200 and 2.3. `FORMULATIONS` holds the first and the last, and the benchmark takes
  the faster one (with squares both take about 20 at 256 worlds);
- `torch.compile` of one frame (10 steps): 68 and 0.92, after 19 s of compilation. It is no plain torch any more, so the
  benchmark names it apart.
"""

from collections.abc import Callable
from typing import Any

import torch
from _fixed_step import (
    ROLLING_INERTIA,
    STEPS_PER_FRAME,
    Constants,
    Inputs,
    Motion,
    System,
    begin,
    constants_of,
    meet,
    resist,
    step,
    system_of,
)
from _fixed_step_contacts import CONTACTS, TINY, Fixed, Laws, Pair, matmul
from torch import Tensor

from vrdp_prob.models.simulator.worlds import Worlds

BODY_FIELDS = ("position", "velocity", "angle", "spin", "mass", "restitution", "radius")
Contacts = Callable[[Any, System, Constants, Motion], Motion]


def inputs_of(worlds: Worlds) -> Inputs:
    """Arrays with the world as last axis, walls after the bodies."""
    values = {name: getattr(worlds, name).moveaxis(0, -1).contiguous() for name in BODY_FIELDS}
    if len(worlds.walls):
        walls = _walls(worlds)
        values = {name: torch.cat([value, walls[name]]) for name, value in values.items()}
    return Inputs(**values, parameters=dict(worlds.parameters))


def _walls(worlds: Worlds) -> dict[str, Tensor]:
    begins, ends = worlds.walls[:, :2], worlds.walls[:, 2:]
    along = ends - begins
    one = torch.ones(len(along), len(worlds), dtype=torch.float64)
    return {
        "position": ((begins + ends) / 2)[..., None] * one[:, None],
        "velocity": 0 * along[..., None] * one[:, None],
        "angle": torch.atan2(along[:, 1], along[:, 0])[:, None] * one,
        "spin": 0 * one,
        "mass": torch.inf * one,
        "restitution": worlds.restitution_of_walls.T,
        "radius": along.norm(dim=-1)[:, None] / 2 * one,
    }


def positions(worlds: Worlds, frames: int, laws: Laws, contacts: Contacts, *, compiled: bool = False) -> Tensor:
    """Positions [world, frame, body, 2] in m, the first frame as released."""
    system = system_of(torch, worlds.shapes, laws, len(worlds.walls))
    inputs = inputs_of(worlds)
    constants = constants_of(torch, system, inputs)
    motion = begin(torch, system, inputs)
    advance = _compiled_frame if compiled else _frame
    shown = [motion.position]
    for _ in range(frames - 1):
        motion = advance(system, constants, motion, contacts)
        shown.append(motion.position)
    return torch.stack(shown)[:, : len(worlds.shapes)].permute(3, 0, 1, 2)


def _frame(system: System, constants: Constants, motion: Motion, contacts: Contacts) -> Motion:
    simple = not (system.laws.slip_to_roll or system.laws.linear_drag)
    for _ in range(STEPS_PER_FRAME):
        motion = step(torch, system, constants, motion, contacts=contacts, resistance=_resist if simple else resist)
    return motion


_compiled_frame = torch.compile(_frame, dynamic=False)


def _resist(xp: Any, laws: Laws, constants: Constants, motion: Motion) -> tuple[Tensor, None]:
    """What `resist` does without the other laws, in fewer operations."""
    velocity = motion.velocity
    speed = ((velocity * velocity).sum(-2) + TINY).sqrt()
    share = torch.addcdiv(torch.ones_like(constants.drag), constants.braking, speed, value=-1)
    return velocity * torch.addcmul(share, constants.drag, speed, value=-1).relu()[:, None], None


def meet_near(xp: Any, system: System, constants: Constants, motion: Motion) -> Motion:
    """What `meet` does, for those pairs alone whose outer circles overlap."""
    velocity, spin, rolling = motion.velocity, motion.spin, motion.rolling
    worlds = velocity.shape[-1]
    for kind, pairs in system.pairs.items():
        fixed = constants.pairs[kind]
        near = _near(kind, pairs.difference, fixed, motion.position, velocity)
        if not len(near):
            continue
        world = near % worlds
        bodies = torch.stack([pairs.first[near // worlds], pairs.second[near // worlds]])
        numbers = bodies * worlds + world
        vectors = torch.stack([2 * bodies * worlds + world, (2 * bodies + 1) * worlds + world], 1)
        place, speed = motion.position.reshape(-1)[vectors], velocity.reshape(-1)[vectors]
        own_spin = tuple(spin.reshape(-1)[at] for at in numbers) if system.turns else (None, None)
        turns = tuple(
            None if box is None else _turn(motion.angle.reshape(-1)[at])
            for box, at in zip(pairs.boxes, numbers, strict=True)
        )
        turning = None
        if rolling is not None:
            turning = (rolling * constants.is_sphere).reshape(-1)[vectors].sum(0)
        own = Fixed(*(values.expand(len(pairs.first), worlds).reshape(-1)[near] for values in fixed))
        pair = Pair(place[1] - place[0], speed[1] - speed[0], turns, own_spin, turning, own)
        found = CONTACTS[kind](xp, system.laws, pair)
        mobility = constants.inverse_mass.reshape(-1)[numbers][:, None]
        change = torch.stack([-found.push, found.push]) * mobility
        velocity = velocity.reshape(-1).index_add(0, vectors.reshape(-1), change.reshape(-1)).view(velocity.shape)
        if found.lift is not None:
            change = torch.stack([found.lift, found.lift]) * mobility / ROLLING_INERTIA
            rolling = rolling.reshape(-1).index_add(0, vectors.reshape(-1), change.reshape(-1)).view(rolling.shape)
        for at, twist in ((numbers[0], found.twist_0), (numbers[1], found.twist_1)):
            if twist is not None:
                change = twist * constants.inverse_inertia.reshape(-1)[at]
                spin = spin.reshape(-1).index_add(0, at, change).view(spin.shape)
    return motion._replace(velocity=velocity, spin=spin, rolling=rolling)


def _turn(angle: Tensor) -> tuple[Tensor, Tensor]:
    return angle.cos(), angle.sin()


@torch.no_grad()
def _near(kind: str, difference: Tensor, fixed: Fixed, position: Tensor, velocity: Tensor) -> Tensor:
    """Places in [pair, world] of the pairs that may touch; discs must close too."""
    offset = matmul(difference, position)
    near = (offset * offset).sum(-2) < fixed.reach
    if kind == "disc_disc":
        near &= (offset * matmul(difference, velocity)).sum(-2) < 0
    return near.reshape(-1).nonzero().reshape(-1)


FORMULATIONS: dict[str, Contacts] = {"all pairs": meet, "near pairs": meet_near}
"""How contacts are treated."""

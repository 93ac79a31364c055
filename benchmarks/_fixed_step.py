"""The physics of a fixed-step simulator, written once for torch and for JAX.

Every function takes the array module `xp` (`torch` or `jax.numpy`) first. Arrays have the world as last axis, where the
machine's vector units want it: vectors are [..., 2, world], numbers [..., world]. Pairs are an axis; nothing loops over
worlds, bodies or pairs, and geometry of squares is computed for pairs with squares only. A step is: friction and drag,
then one impulse for every pair that touches and closes, then the way of the step.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from _fixed_step_contacts import CONTACTS, TINY, Array, Fixed, Laws, Pair, matmul

from vrdp_prob.models.parameters import GRAVITY
from vrdp_prob.models.simulator.worlds import INERTIA_FACTORS
from vrdp_prob.scene import Shape

STEP = 0.004
"""Length of a step in s."""
STEPS_PER_FRAME = 10
ROLLING_INERTIA = 2 / 5
"""Moment of inertia of a solid sphere over m R^2."""


class Pairs(NamedTuple):
    """Pairs of one kind: indices of the first and the second bodies, and matrices [pair, body] that pick them.

    For bodies that are squares or walls also matrices [pair, box] that pick them among those; None for discs.
    Matrices are faster than indices: the derivative of indexing is slow in torch, and more so in JAX.
    """

    first: Array
    second: Array
    boxes: tuple[Array | None, Array | None]
    pick_first: Array
    pick_second: Array
    difference: Array


class Motion(NamedTuple):
    """State of the bodies; `rolling` is the velocity at which a sphere would roll with its present spin."""

    position: Array  # [body, 2, world], m
    velocity: Array  # [body, 2, world], m/s
    angle: Array  # [body, world], rad
    spin: Array  # [body, world], rad/s
    rolling: Array  # [body, 2, world], m/s, None without slip_to_roll


class Inputs(NamedTuple):
    """What a simulation depends on; per body [body, world], shared parameters [world].

    Walls are bodies of infinite mass after all others; their radius is half their length.
    """

    position: Array  # [body, 2, world], m
    velocity: Array  # [body, 2, world], m/s
    angle: Array
    spin: Array
    mass: Array
    restitution: Array
    radius: Array
    parameters: dict[str, Array]


class Constants(NamedTuple):
    """What stays the same in all steps."""

    inverse_mass: Array
    inverse_inertia: Array
    radius: Array
    braking: Array  # change of the speed in a step by dry friction
    drag: Array  # the same by the air, per speed squared
    linear: Array  # the same in proportion to the speed
    spin_braking: Array  # change of the spin in a step
    gripping: Array  # change of the slip in a step; infinite for what does not roll
    share: Array  # part of an external acceleration that a rolling body feels
    is_sphere: Array
    pairs: dict[str, "Fixed"]


class System(NamedTuple):
    """What is known before the first number: shapes, laws, pairs and walls."""

    shapes: tuple[Shape | None, ...]  # None for a wall
    laws: Laws
    pairs: dict[str, Pairs]
    turns: bool  # whether spins take part in contacts
    boxes: Array  # matrix [box, body] that picks the bodies whose angle matters: squares and walls


def pairs_of(xp: Any, kinds: list[str], pairs: list[tuple[int, int]]) -> Pairs:
    """Pairs of one kind."""
    bodies = [np.array([pair[side] for pair in pairs], dtype=np.int64) for side in (0, 1)]
    rank = np.cumsum([kind != "disc" for kind in kinds]) - 1
    eye = np.eye(len(kinds))
    of_boxes = np.eye(max(rank[-1] + 1, 1))
    boxes = [None if kinds[of_side[0]] == "disc" else xp.asarray(of_boxes[rank[of_side]]) for of_side in bodies]
    first, second = (xp.asarray(of_side) for of_side in bodies)
    picks = (eye[bodies[0]], eye[bodies[1]], eye[bodies[1]] - eye[bodies[0]])
    return Pairs(first, second, (boxes[0], boxes[1]), *(xp.asarray(pick) for pick in picks))


def system_of(xp: Any, shapes: tuple[Shape, ...], laws: Laws, walls: int = 0) -> System:
    """Sort the pairs by what meets what; the first is the wall, or the square of a square and a disc."""
    kinds = ["disc" if shape.is_disc else "square" for shape in shapes] + ["wall"] * walls
    order = ("wall", "square", "disc")
    sorted_pairs: dict[str, list[tuple[int, int]]] = {}
    for i in range(len(kinds)):
        for j in range(i + 1, len(kinds)):
            first, second = (i, j) if order.index(kinds[i]) <= order.index(kinds[j]) else (j, i)
            if kinds[second] != "wall":
                sorted_pairs.setdefault(f"{kinds[first]}_{kinds[second]}", []).append((first, second))
    pairs = {kind: pairs_of(xp, kinds, entries) for kind, entries in sorted_pairs.items()}
    boxes = xp.asarray(np.eye(len(kinds))[[kind != "disc" for kind in kinds]])
    turns = "square" in kinds or laws.contact_friction
    return System((*shapes, *[None] * walls), laws, pairs, turns, boxes)


def constants_of(xp: Any, system: System, inputs: Inputs) -> Constants:
    """Compute what stays the same in all steps."""
    parameters = inputs.parameters
    sphere = np.array([float(shape is Shape.SPHERE) for shape in system.shapes])[:, None]
    is_sphere = xp.asarray(sphere)
    inertia = xp.asarray(
        np.array([1.0 if shape is None else INERTIA_FACTORS[shape] for shape in system.shapes])[:, None]
    )
    inertia = inertia * inputs.mass * inputs.radius**2
    friction = is_sphere * parameters["rolling_resistance"] + (1 - is_sphere) * parameters["sliding_friction"]
    zero = 0.0 * parameters["air_drag"]
    slips = system.laws.slip_to_roll
    grip = (1 + 1 / ROLLING_INERTIA) * GRAVITY * STEP * parameters["slip_friction"] if slips else zero
    return Constants(
        inverse_mass=1 / inputs.mass,
        inverse_inertia=1 / inertia,
        radius=inputs.radius,
        braking=STEP * GRAVITY * friction,
        drag=STEP * parameters["air_drag"],
        linear=STEP * parameters["linear_drag"] if system.laws.linear_drag else zero,
        spin_braking=STEP * parameters["angular_drag"],
        gripping=grip,
        share=xp.asarray(1 - sphere * ROLLING_INERTIA / (1 + ROLLING_INERTIA)),
        is_sphere=is_sphere[:, None],
        pairs={kind: fixed_of(xp, system, kind, inputs, 1 / inertia) for kind in system.pairs},
    )


def fixed_of(xp: Any, system: System, kind: str, inputs: Inputs, inverse_inertia: Array) -> Fixed:
    """Compute what stays the same of the pairs of one kind."""
    pairs = system.pairs[kind]
    outer = [np.sqrt(2.0) if name == "square" else 1.0 for name in kind.split("_")]
    radius, factor, mass = inputs.radius, inputs.restitution, inputs.mass
    mobility = 1 / mass[pairs.first] + 1 / mass[pairs.second]
    coefficient = "wall_friction" if kind.startswith("wall") else "contact_friction"
    friction = inputs.parameters[coefficient] if system.laws.contact_friction else 0.0
    spheres = xp.asarray(np.array([float(shape is Shape.SPHERE) for shape in system.shapes])[:, None])
    rolls = spheres[pairs.first] / mass[pairs.first] + spheres[pairs.second] / mass[pairs.second]
    return Fixed(
        (outer[0] * radius[pairs.first] + outer[1] * radius[pairs.second]) ** 2,
        radius[pairs.first],
        radius[pairs.second],
        inverse_inertia[pairs.first],
        inverse_inertia[pairs.second],
        mobility,
        1 + xp.clip(factor[pairs.first] * factor[pairs.second], max=1.0),
        friction + 0.0 * mobility,
        rolls / ROLLING_INERTIA,
    )


def begin(xp: Any, system: System, inputs: Inputs) -> Motion:
    """State at the beginning; spheres are released without rolling."""
    rolling = 0.0 * inputs.velocity if system.laws.slip_to_roll else None
    return Motion(inputs.position, inputs.velocity, inputs.angle, inputs.spin, rolling)


def step(
    xp: Any,
    system: System,
    constants: Constants,
    motion: Motion,
    *,
    contacts: Callable[..., Motion],
    resistance: Callable[..., tuple[Array, Array]],
) -> Motion:
    """One step, with `meet` and `resist` or what does the same in other operations."""
    velocity, rolling = resistance(xp, system.laws, constants, motion)
    spin = motion.spin
    if system.turns:
        spin = spin * xp.clip(1 - constants.spin_braking / (abs(spin) + TINY), min=0.0)
    motion = Motion(motion.position, velocity, motion.angle, spin, rolling)
    motion = contacts(xp, system, constants, motion)
    angle = motion.angle + STEP * motion.spin if system.turns else motion.angle
    return motion._replace(position=motion.position + STEP * motion.velocity, angle=angle)


def resist(xp: Any, laws: Laws, constants: Constants, motion: Motion) -> tuple[Array, Array]:
    """Velocities after dry friction, drag and, where it is on, the change from slipping to rolling."""
    velocity = motion.velocity
    speed = xp.sqrt((velocity * velocity).sum(-2) + TINY)
    drag = constants.drag * speed + constants.linear if laws.linear_drag else constants.drag * speed
    if not laws.slip_to_roll:
        return velocity * xp.clip(1 - constants.braking / speed - drag, min=0.0)[:, None], None
    slip = (velocity - motion.rolling) * constants.is_sphere
    closed = xp.clip(constants.gripping / xp.sqrt((slip * slip).sum(-2) + TINY), max=1.0)
    rolls = closed >= 1.0
    braked = xp.clip(1 - constants.braking / speed - constants.share * drag, min=0.0)
    change = closed[:, None] * slip / (1 + ROLLING_INERTIA)
    velocity = (velocity - ROLLING_INERTIA * change) * xp.where(rolls, braked, 1 - drag)[:, None]
    return velocity, xp.where(rolls[:, None], velocity, motion.rolling + change)


def meet(xp: Any, system: System, constants: Constants, motion: Motion) -> Motion:
    """The motion after the contacts of all pairs, touching or not."""
    push, twist, lift = 0.0, 0.0, 0.0
    angle = system.boxes @ motion.angle if len(system.boxes) else None
    turns = None if angle is None else (xp.cos(angle), xp.sin(angle))
    for kind, pairs in system.pairs.items():
        pair = pair_of(system, constants, kind, motion, turns)
        found = CONTACTS[kind](xp, system.laws, pair)
        push = push + matmul(pairs.difference.T, found.push)
        twist = twist if found.twist_0 is None else twist + pairs.pick_first.T @ found.twist_0
        twist = twist if found.twist_1 is None else twist + pairs.pick_second.T @ found.twist_1
        lift = lift if found.lift is None else lift + matmul((pairs.pick_first + pairs.pick_second).T, found.lift)
    spin = motion.spin + twist * constants.inverse_inertia if system.turns else motion.spin
    rolling = motion.rolling
    if rolling is not None:
        rolling = rolling + lift * constants.is_sphere * constants.inverse_mass[:, None] / ROLLING_INERTIA
    return motion._replace(
        velocity=motion.velocity + push * constants.inverse_mass[:, None], spin=spin, rolling=rolling
    )


def pair_of(system: System, constants: Constants, kind: str, motion: Motion, turns: Any) -> Pair:
    """All pairs of a kind, with cosine and sine of all boxes."""
    pairs = system.pairs[kind]
    of_boxes = [None if box is None else (box @ turns[0], box @ turns[1]) for box in pairs.boxes]
    return Pair(
        offset=matmul(pairs.difference, motion.position),
        closing=matmul(pairs.difference, motion.velocity),
        turns=(of_boxes[0], of_boxes[1]),
        spin=(pairs.pick_first @ motion.spin, pairs.pick_second @ motion.spin) if system.turns else (None, None),
        rolling=None
        if motion.rolling is None
        else matmul(pairs.pick_first + pairs.pick_second, motion.rolling * constants.is_sphere),
        fixed=constants.pairs[kind],
    )

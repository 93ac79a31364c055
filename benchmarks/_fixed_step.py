"""The physics of a fixed-step simulator, written once for torch and for JAX.

Every function takes the array module `xp` (`torch` or `jax.numpy`) first. Arrays have the world as last axis, where the
machine's vector units want it: vectors are [..., 2, world], numbers [..., world]. Pairs are an axis; nothing loops over
worlds, bodies or pairs, and geometry of squares is computed for pairs with squares only. A step is: friction and drag,
then one impulse for every pair that touches and closes, then the way of the step.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from vrdp_prob.models.parameters import GRAVITY
from vrdp_prob.models.simulator.worlds import INERTIA_FACTORS
from vrdp_prob.scene import Shape

Array = Any
STEP = 0.004
"""Length of a step in s."""
STEPS_PER_FRAME = 10
TINY = 1e-24
"""Added to squares whose root is taken, so that nothing divides by 0."""
ROLLING_INERTIA = 2 / 5
"""Moment of inertia of a solid sphere over m R^2."""
CORNERS = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])[..., None]
"""Corners [corner, 2, 1] of a square in units of its half side."""
QUARTER_TURN = np.array([[-1.0], [1.0]])
"""Signs [2, 1] of the swapped components of a vector that is turned by a right angle."""


class Laws(NamedTuple):
    """Which laws are on besides those of the base model."""

    contact_friction: bool = False
    slip_to_roll: bool = False
    linear_drag: bool = False


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


class Fixed(NamedTuple):
    """What stays the same of the pairs of one kind, each [..., world]; `_0` of the first body, `_1` of the second."""

    reach: Array  # square of the greatest distance of centres that may touch
    radius_0: Array
    radius_1: Array
    inverse_inertia_0: Array
    inverse_inertia_1: Array
    mobility: Array  # sum of the inverse masses
    bounce: Array  # 1 + e
    contact_friction: Array


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
    inertia = xp.asarray(np.array([INERTIA_FACTORS.get(shape, 1.0) for shape in system.shapes])[:, None])
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
    friction = inputs.parameters["contact_friction"] if system.laws.contact_friction else 0.0
    return Fixed(
        (outer[0] * radius[pairs.first] + outer[1] * radius[pairs.second]) ** 2,
        radius[pairs.first],
        radius[pairs.second],
        inverse_inertia[pairs.first],
        inverse_inertia[pairs.second],
        mobility,
        1 + xp.clip(factor[pairs.first] * factor[pairs.second], max=1.0),
        friction + 0.0 * mobility,
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
    contacts: Callable[..., tuple[Array, Array]],
    resistance: Callable[..., tuple[Array, Array]],
) -> Motion:
    """One step, with `meet` and `resist` or what does the same in other operations."""
    velocity, rolling = resistance(xp, system.laws, constants, motion)
    spin = motion.spin
    if system.turns:
        spin = spin * xp.clip(1 - constants.spin_braking / (abs(spin) + TINY), min=0.0)
    motion = Motion(motion.position, velocity, motion.angle, spin, rolling)
    velocity, spin = contacts(xp, system, constants, motion)
    angle = motion.angle + STEP * spin if system.turns else motion.angle
    return Motion(motion.position + STEP * velocity, velocity, angle, spin, rolling)


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


def meet(xp: Any, system: System, constants: Constants, motion: Motion) -> tuple[Array, Array]:
    """Velocities and spins after the contacts of all pairs, touching or not."""
    push, twist = 0.0, 0.0
    angle = system.boxes @ motion.angle if len(system.boxes) else None
    turns = None if angle is None else (xp.cos(angle), xp.sin(angle))
    for kind, pairs in system.pairs.items():
        pair = pair_of(system, constants.pairs[kind], motion, pairs, turns)
        impulse, on_first, on_second = CONTACTS[kind](xp, system.laws, pair)
        push = push + matmul(pairs.difference.T, impulse)
        twist = twist if on_first is None else twist + pairs.pick_first.T @ on_first
        twist = twist if on_second is None else twist + pairs.pick_second.T @ on_second
    spin = motion.spin + twist * constants.inverse_inertia if system.turns else motion.spin
    return motion.velocity + push * constants.inverse_mass[:, None], spin


class Pair(NamedTuple):
    """Pairs as they are: differences [..., 2, world] second less first, numbers [..., world] of both.

    `turns` are cosine and sine of the angles, of squares and walls.
    """

    offset: Array
    closing: Array
    turns: tuple[Any, Any]
    spin: tuple[Array, Array]
    fixed: Fixed


def pair_of(system: System, fixed: Fixed, motion: Motion, pairs: Pairs, turns: Any) -> Pair:
    """All pairs of a kind, with cosine and sine of all boxes."""
    of_boxes = [None if box is None else (box @ turns[0], box @ turns[1]) for box in pairs.boxes]
    return Pair(
        offset=matmul(pairs.difference, motion.position),
        closing=matmul(pairs.difference, motion.velocity),
        turns=(of_boxes[0], of_boxes[1]),
        spin=(pairs.pick_first @ motion.spin, pairs.pick_second @ motion.spin) if system.turns else (None, None),
        fixed=fixed,
    )


def matmul(matrix: Array, vectors: Array) -> Array:
    """Product [row, body] with [body, 2, world], as one matrix product."""
    flat = vectors.reshape(vectors.shape[0], vectors.shape[1] * vectors.shape[2])
    return (matrix @ flat).reshape(matrix.shape[0], *vectors.shape[1:])


def dot(a: Array, b: Array) -> Array:
    """Scalar product."""
    return (a * b).sum(-2)


def across(xp: Any, vector: Array) -> Array:
    """Turn a vector by a right angle."""
    return xp.flip(vector, (-2,)) * xp.asarray(QUARTER_TURN)


def cross(xp: Any, a: Array, b: Array) -> Array:
    """Product of two vectors in the plane."""
    return dot(across(xp, a), b)


def turned(xp: Any, cosine: Array, sine: Array, vector: Array) -> Array:
    """Turn a vector by an angle."""
    return cosine[..., None, :] * vector + sine[..., None, :] * across(xp, vector)


def impulse_of(
    xp: Any,
    pair: Pair,
    touches: Array,
    normal: Array,
    *,
    along: tuple[Array, Array],
    beside: tuple[Array, Array] | None,
) -> tuple[Array, Array, Array]:
    """Impulse on the second bodies of pairs, and the angular impulses on both.

    Along the normal (from the first to the second) with restitution; then, where levers `beside` it are given, along
    the tangent up to sticking. Levers that are None are 0.
    """
    fixed = pair.fixed
    inertias = (fixed.inverse_inertia_0, fixed.inverse_inertia_1)
    rate, give = dot(normal, pair.closing), fixed.mobility
    for side, sign in ((0, -1.0), (1, 1.0)):
        if along[side] is not None:
            rate = rate + sign * along[side] * pair.spin[side]
            give = give + along[side] ** 2 * inertias[side]
    size = xp.where(touches & (rate < 0), -rate, 0.0) * pair.fixed.bounce / give
    vector = normal * size[..., None, :]
    twists = [None if lever is None else sign * lever * size for lever, sign in zip(along, (-1.0, 1.0), strict=True)]
    if beside is None:
        return vector, twists[0], twists[1]
    tangent = across(xp, normal)
    slide, give = dot(tangent, pair.closing), pair.fixed.mobility
    for side, sign in ((0, -1.0), (1, 1.0)):
        slide = slide + sign * beside[side] * pair.spin[side]
        give = give + beside[side] ** 2 * inertias[side]
        if along[side] is not None:
            slide = slide + beside[side] * along[side] * inertias[side] * size
    limit = pair.fixed.contact_friction * size
    rub = xp.maximum(-limit, xp.minimum(limit, -slide / give))
    for side, sign in ((0, -1.0), (1, 1.0)):
        more = sign * beside[side] * rub
        twists[side] = more if twists[side] is None else twists[side] + more
    return vector + tangent * rub[..., None, :], twists[0], twists[1]


def discs_meet(xp: Any, laws: Laws, pair: Pair) -> tuple[Array, Array, Array]:
    """Contact of two discs."""
    square = dot(pair.offset, pair.offset)
    touches = square < pair.fixed.reach
    if not laws.contact_friction:
        # No root and no spin is needed.
        closing = dot(pair.offset, pair.closing)
        size = xp.where(touches & (closing < 0), -closing, 0.0) * pair.fixed.bounce / pair.fixed.mobility / square
        return pair.offset * size[..., None, :], None, None
    normal = pair.offset / xp.sqrt(square)[..., None, :]
    return impulse_of(xp, pair, touches, normal, along=(None, None), beside=(pair.fixed.radius_0, -pair.fixed.radius_1))


def box_meets_disc(xp: Any, laws: Laws, pair: Pair, height: float = 1.0) -> tuple[Array, Array, Array]:
    """Contact of a square (or of a wall, whose `height` is 0) and a disc, at the nearest point of the box."""
    cosine, sine = pair.turns[0]
    seen = turned(xp, cosine, -sine, pair.offset)
    half = pair.fixed.radius_0[..., None, :] * xp.asarray([[1.0], [height]])
    nearest = xp.minimum(xp.maximum(seen, -half), half)
    between = seen - nearest
    square = dot(between, between)
    flat = between / xp.sqrt(square + TINY)[..., None, :]
    touches = (square < pair.fixed.radius_1 * pair.fixed.radius_1) & (square > 0)
    beside = (dot(nearest, flat), -pair.fixed.radius_1) if laws.contact_friction else None
    # A wall does not turn.
    along = (cross(xp, nearest, flat) if height else None, None)
    return impulse_of(xp, pair, touches, turned(xp, cosine, sine, flat), along=along, beside=beside)


def wall_meets_disc(xp: Any, laws: Laws, pair: Pair) -> tuple[Array, Array, Array]:
    """Contact of a wall and a disc."""
    return box_meets_disc(xp, laws, pair, 0.0)


def constant(values: Array) -> Array:
    """The same numbers without a derivative; what is compared or counted needs none (JAX sees that by itself)."""
    return values.detach() if hasattr(values, "detach") else values


def corners_of(xp: Any, pair: Pair, side: int) -> Array:
    """Corners [..., corner, 2, world] of one square of each pair, from its centre, without derivative."""
    cosine, sine = (constant(part)[..., None, :] for part in pair.turns[side])
    radius = constant((pair.fixed.radius_0, pair.fixed.radius_1)[side])[..., None, None, :]
    return turned(xp, cosine, sine, radius * xp.asarray(CORNERS))


def seen_from(xp: Any, pair: Pair, side: int, points: Array) -> Array:
    """Points [..., corner, 2, world] in the frame of one body of each pair, without derivative."""
    cosine, sine = (constant(part)[..., None, :] for part in pair.turns[side])
    return turned(xp, cosine, -sine, points)


def chosen(choice: Array, values: Array) -> Array:
    """Entries [..., 2, world] of `values` [..., corner, 2, world] that a choice [..., corner, world] marks."""
    return (values * choice[..., None, :]).sum(-3)


def deepest(xp: Any, depth: Array) -> tuple[Array, Array]:
    """Whether the deepest of the corners [..., corner, world] is inside, and which it is (as 0 and 1)."""
    best = xp.argmax(depth, -2)[..., None, :]
    choice = 1.0 * (best == xp.asarray(np.arange(depth.shape[-2])[:, None]))
    return (depth * choice).sum(-2) > 0, choice


def squares_meet(xp: Any, laws: Laws, pair: Pair) -> tuple[Array, Array, Array]:
    """Contact of two squares, at the corner that is deepest in the other, along the nearest side's normal."""
    offset = constant(pair.offset)[..., None, :, :]
    in_first = seen_from(xp, pair, 0, corners_of(xp, pair, 1) + offset)
    in_second = seen_from(xp, pair, 1, corners_of(xp, pair, 0) - offset)
    both = xp.concatenate([in_first, in_second], -3)
    size = abs(both)
    radii = (pair.fixed.radius_0, pair.fixed.radius_1)
    half = xp.stack([constant(radius) for radius in radii for _ in CORNERS], -2)
    touches, choice = deepest(xp, half - xp.maximum(size[..., 0, :], size[..., 1, :]))
    of_second = choice[..., :4, :].sum(-2) > 0
    at = chosen(choice, both)
    across_x = abs(at[..., 0, :]) > abs(at[..., 1, :])
    side = xp.sign(at) * xp.stack([1.0 * across_x, 1.0 - across_x * 1.0], -2)
    corner = chosen(choice, xp.asarray(np.concatenate([CORNERS, CORNERS])))
    # From here on with derivatives, for the chosen corner alone.
    turns = pair.turns
    arms = [turned(xp, *turn, corner * radius[..., None, :]) for turn, radius in zip(turns, radii, strict=True)]
    point = xp.where(of_second[..., None, :], pair.offset + arms[1], arms[0])
    normal = xp.where(of_second[..., None, :], turned(xp, *turns[0], side), -turned(xp, *turns[1], side))
    levers = (cross(xp, point, normal), cross(xp, point - pair.offset, normal))
    beside = (dot(point, normal), dot(point - pair.offset, normal)) if laws.contact_friction else None
    return impulse_of(xp, pair, touches, normal, along=levers, beside=beside)


def wall_meets_square(xp: Any, laws: Laws, pair: Pair) -> tuple[Array, Array, Array]:
    """Contact of a wall (not of its ends) and a square, at the square's corner that is deepest behind the wall."""
    centre = constant(pair.offset)[..., None, :, :]
    behind = xp.sign(seen_from(xp, pair, 0, centre)[..., 1, :])
    seen = seen_from(xp, pair, 0, centre + corners_of(xp, pair, 1))
    beside = abs(seen[..., 0, :]) > constant(pair.fixed.radius_0)[..., None, :]
    touches, choice = deepest(xp, xp.where(beside, -1.0, -behind * seen[..., 1, :]))
    corner = chosen(choice, xp.asarray(CORNERS)) * pair.fixed.radius_1[..., None, :]
    arm = turned(xp, *pair.turns[1], corner)
    normal = behind * xp.stack([-pair.turns[0][1], pair.turns[0][0]], -2)
    beside = (0.0 * pair.fixed.radius_0, dot(arm, normal)) if laws.contact_friction else None
    return impulse_of(xp, pair, touches, normal, along=(None, cross(xp, arm, normal)), beside=beside)


CONTACTS = {
    "disc_disc": discs_meet,
    "square_disc": box_meets_disc,
    "square_square": squares_meet,
    "wall_disc": wall_meets_disc,
    "wall_square": wall_meets_square,
}

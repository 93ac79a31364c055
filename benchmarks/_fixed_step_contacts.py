"""Contacts of the fixed-step simulator: what touches, and the impulse; for torch and for JAX.

Arrays as in `_fixed_step.py`. A contact law takes pairs of one kind and returns what it does to both bodies.
"""

from typing import Any, NamedTuple

import numpy as np

Array = Any
TINY = 1e-24
"""Added to squares whose root is taken, so that nothing divides by 0."""
CORNERS = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])[..., None]
"""Corners [corner, 2, 1] of a square in units of its half side."""
QUARTER_TURN = np.array([[-1.0], [1.0]])
"""Signs [2, 1] of the swapped components of a vector that is turned by a right angle."""


class Laws(NamedTuple):
    """Which laws are on besides those of the base model."""

    contact_friction: bool = False
    slip_to_roll: bool = False
    linear_drag: bool = False


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
    roll_give: Array  # change of the vertical sliding per vertical impulse, 0 where nothing rolls


class Pair(NamedTuple):
    """Pairs as they are: differences [..., 2, world] second less first, numbers [..., world] of both.

    `turns` are cosine and sine of the angles, of squares and walls.
    """

    offset: Array
    closing: Array
    turns: tuple[Any, ...]
    spin: tuple[Array, Array]
    rolling: Array  # sum of the rolling velocities of both, of spheres; None without slip_to_roll
    fixed: Fixed


class Impulses(NamedTuple):
    """What a contact does; None where there is nothing of a sort."""

    push: Array  # impulse on the second body, [..., 2, world]
    twist_0: Array  # angular impulse about the vertical, [..., world]
    twist_1: Array
    lift: Array  # upward impulse on the second body times the normal, [..., 2, world]


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


def turned(xp: Any, turn: tuple[Array, Array], vector: Array) -> Array:
    """Turn a vector by an angle, given by its cosine and sine."""
    cosine, sine = turn
    return cosine[..., None, :] * vector + sine[..., None, :] * across(xp, vector)


def impulse_of(
    xp: Any,
    pair: Pair,
    touches: Array,
    normal: Array,
    *,
    along: tuple[Array, Array],
    beside: tuple[Array, Array] | None,
) -> Impulses:
    """Impulses along the normal (from the first to the second) with restitution, then across it.

    Where levers `beside` the normal are given there is friction against the sliding along the tangent and, of spheres
    that roll, up or down, up to sticking. Levers that are None are 0.
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
        return Impulses(vector, twists[0], twists[1], None)
    tangent = across(xp, normal)
    slide, give = dot(tangent, pair.closing), pair.fixed.mobility
    for side, sign in ((0, -1.0), (1, 1.0)):
        slide = slide + sign * beside[side] * pair.spin[side]
        give = give + beside[side] ** 2 * inertias[side]
        if along[side] is not None:
            slide = slide + beside[side] * along[side] * inertias[side] * size
    limit = pair.fixed.contact_friction * size
    rise, total = None, abs(slide) + TINY
    if pair.rolling is not None:
        rise = dot(normal, pair.rolling)
        total = xp.sqrt(slide * slide + rise * rise + TINY)
    rub = -slide * xp.minimum(1 / give, limit / total)
    for side, sign in ((0, -1.0), (1, 1.0)):
        more = sign * beside[side] * rub
        twists[side] = more if twists[side] is None else twists[side] + more
    lift = None
    if rise is not None:
        lift = normal * (-rise * xp.minimum(1 / (pair.fixed.roll_give + TINY), limit / total))[..., None, :]
    return Impulses(vector + tangent * rub[..., None, :], twists[0], twists[1], lift)


def discs_meet(xp: Any, laws: Laws, pair: Pair) -> Impulses:
    """Contact of two discs."""
    square = dot(pair.offset, pair.offset)
    touches = square < pair.fixed.reach
    if not laws.contact_friction:
        # No root and no spin is needed.
        closing = dot(pair.offset, pair.closing)
        size = xp.where(touches & (closing < 0), -closing, 0.0) * pair.fixed.bounce / pair.fixed.mobility / square
        return Impulses(pair.offset * size[..., None, :], None, None, None)
    normal = pair.offset / xp.sqrt(square)[..., None, :]
    return impulse_of(xp, pair, touches, normal, along=(None, None), beside=(pair.fixed.radius_0, -pair.fixed.radius_1))


def box_meets_disc(xp: Any, laws: Laws, pair: Pair, height: float = 1.0) -> Impulses:
    """Contact of a square (or of a wall, whose `height` is 0) and a disc, at the nearest point of the box."""
    cosine, sine = pair.turns[0]
    seen = turned(xp, (cosine, -sine), pair.offset)
    half = pair.fixed.radius_0[..., None, :] * xp.asarray([[1.0], [height]])
    nearest = xp.minimum(xp.maximum(seen, -half), half)
    between = seen - nearest
    square = dot(between, between)
    flat = between / xp.sqrt(square + TINY)[..., None, :]
    touches = (square < pair.fixed.radius_1 * pair.fixed.radius_1) & (square > 0)
    beside = (dot(nearest, flat), -pair.fixed.radius_1) if laws.contact_friction else None
    # A wall does not turn.
    along = (cross(xp, nearest, flat) if height else None, None)
    return impulse_of(xp, pair, touches, turned(xp, (cosine, sine), flat), along=along, beside=beside)


def wall_meets_disc(xp: Any, laws: Laws, pair: Pair) -> Impulses:
    """Contact of a wall and a disc."""
    return box_meets_disc(xp, laws, pair, 0.0)


def constant(values: Array) -> Array:
    """The same numbers without a derivative; what is compared or counted needs none (JAX sees that by itself)."""
    return values.detach() if hasattr(values, "detach") else values


def corners_of(xp: Any, pair: Pair, side: int) -> Array:
    """Corners [..., corner, 2, world] of one square of each pair, from its centre, without derivative."""
    cosine, sine = (constant(part)[..., None, :] for part in pair.turns[side])
    radius = constant((pair.fixed.radius_0, pair.fixed.radius_1)[side])[..., None, None, :]
    return turned(xp, (cosine, sine), radius * xp.asarray(CORNERS))


def seen_from(xp: Any, pair: Pair, side: int, points: Array) -> Array:
    """Points [..., corner, 2, world] in the frame of one body of each pair, without derivative."""
    cosine, sine = (constant(part)[..., None, :] for part in pair.turns[side])
    return turned(xp, (cosine, -sine), points)


def chosen(choice: Array, values: Array) -> Array:
    """Entries [..., 2, world] of `values` [..., corner, 2, world] that a choice [..., corner, world] marks."""
    return (values * choice[..., None, :]).sum(-3)


def deepest(xp: Any, depth: Array) -> tuple[Array, Array]:
    """Whether the deepest of the corners [..., corner, world] is inside, and which it is (as 0 and 1)."""
    best = xp.argmax(depth, -2)[..., None, :]
    choice = 1.0 * (best == xp.asarray(np.arange(depth.shape[-2])[:, None]))
    return (depth * choice).sum(-2) > 0, choice


def squares_meet(xp: Any, laws: Laws, pair: Pair) -> Impulses:
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
    arms = [turned(xp, turn, corner * radius[..., None, :]) for turn, radius in zip(pair.turns, radii, strict=True)]
    point = xp.where(of_second[..., None, :], pair.offset + arms[1], arms[0])
    normal = xp.where(of_second[..., None, :], turned(xp, pair.turns[0], side), -turned(xp, pair.turns[1], side))
    levers = (cross(xp, point, normal), cross(xp, point - pair.offset, normal))
    beside = (dot(point, normal), dot(point - pair.offset, normal)) if laws.contact_friction else None
    return impulse_of(xp, pair, touches, normal, along=levers, beside=beside)


def wall_meets_square(xp: Any, laws: Laws, pair: Pair) -> Impulses:
    """Contact of a wall (not of its ends) and a square, at the square's corner that is deepest behind the wall."""
    centre = constant(pair.offset)[..., None, :, :]
    behind = xp.sign(seen_from(xp, pair, 0, centre)[..., 1, :])
    seen = seen_from(xp, pair, 0, centre + corners_of(xp, pair, 1))
    beside = abs(seen[..., 0, :]) > constant(pair.fixed.radius_0)[..., None, :]
    touches, choice = deepest(xp, xp.where(beside, -1.0, -behind * seen[..., 1, :]))
    corner = chosen(choice, xp.asarray(CORNERS)) * pair.fixed.radius_1[..., None, :]
    arm = turned(xp, pair.turns[1], corner)
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

"""Contact geometry and impulse as laws: how far two features are apart, and what happens when they meet.

Every meeting is between a point of one body and a point or a line of another. A disc is its centre with a radius around
it, a corner is a point without radius, a side of a square and a wall are lines. `a` is the owner of the line.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING

from vrdp_prob.models.effects.effect import BodyView, ContactView
from vrdp_prob.models.simulator.formula import Scalar
from vrdp_prob.models.simulator.mathematics import absolute, cos, length, maximum, minimum, sin, where
from vrdp_prob.models.simulator.motion import ROLLING_GAIN, slips

if TYPE_CHECKING:
    from vrdp_prob.models.effects.effect import Effect


HOP = 0.05
"""Slowest rebound of two bodies that press and rub on each other, in radii (of the smaller) per second.

Bodies that press move together (see `cluster_kernel.py`), but not yet with friction between them. Where an effect adds
tangential impulses they hop instead, by about a thousandth of their radius.
"""


class ContactKind(IntEnum):
    """What meets what."""

    POINT_POINT = 0
    LINE_POINT = 1


@dataclass(frozen=True)
class Feature:
    """A feature of a body, in the body's frame and in units of its radius.

    Parameters
    ----------
    x, y
        Offset of the point from the centre; for a line its outward unit normal.
    extent
        Radius around the point; for a line its distance from the centre.
    """

    x: Scalar
    y: Scalar
    extent: Scalar


@dataclass(frozen=True)
class ContactGeometry:
    """Signed distance in m, unit normal from a to b, and the touching point in m."""

    gap: Scalar
    normal: tuple[Scalar, Scalar]
    point: tuple[Scalar, Scalar]


def _rotated(angle: Scalar, x: Scalar, y: Scalar) -> tuple[Scalar, Scalar]:
    return cos(angle) * x - sin(angle) * y, sin(angle) * x + cos(angle) * y


def contact_geometry(kind: ContactKind, a: BodyView, b: BodyView, of_a: Feature, of_b: Feature) -> ContactGeometry:
    """Distance, normal and touching point of two features."""
    offset_b = _rotated(b.angle, of_b.x * b.radius, of_b.y * b.radius)
    point_b = (b.x + offset_b[0], b.y + offset_b[1])
    if kind is ContactKind.LINE_POINT:
        normal = _rotated(a.angle, of_a.x, of_a.y)
        distance = normal[0] * (point_b[0] - a.x) + normal[1] * (point_b[1] - a.y)
    else:
        offset_a = _rotated(a.angle, of_a.x * a.radius, of_a.y * a.radius)
        between = (point_b[0] - a.x - offset_a[0], point_b[1] - a.y - offset_a[1])
        distance = length(*between)
        normal = (between[0] / distance, between[1] / distance)
    round_b = of_b.extent * b.radius
    point = (point_b[0] - round_b * normal[0], point_b[1] - round_b * normal[1])
    return ContactGeometry(distance - of_a.extent * a.radius - round_b, normal, point)


def room_on_feature(kind: ContactKind, a: BodyView, b: BodyView, of_a: Feature, of_b: Feature) -> Scalar:
    """Way in m that the touching point may still slide before the contact passes to another feature of `a`.

    Past the end of a side comes the corner, beside a corner come the sides; a disc has no other feature.
    """
    offset = _rotated(b.angle, of_b.x * b.radius, of_b.y * b.radius)
    between = (b.x + offset[0] - a.x, b.y + offset[1] - a.y)
    x, y = _rotated(-a.angle, *between)
    if kind is ContactKind.LINE_POINT:
        return a.radius - absolute(of_a.x * y - of_a.y * x)
    beside_x = where(absolute(of_a.x) > 0.5, x * of_a.x - a.radius, 1.0)
    beside_y = where(absolute(of_a.y) > 0.5, y * of_a.y - a.radius, 1.0)
    return minimum(beside_x, beside_y)


@dataclass(frozen=True)
class ContactResult:
    """What both bodies do after a contact, the impulse along the normal and the closing speed.

    Of each body the velocity, the spin and the rolling velocity (2 numbers), which means something for spheres that may
    slip.
    """

    a: tuple[Scalar, ...]
    b: tuple[Scalar, ...]
    normal_impulse: Scalar
    closing_speed: Scalar
    geometry: ContactGeometry


class _Arms:
    """Velocity differences and effective inverse masses at the touching point of two bodies."""

    def __init__(self, a: BodyView, b: BodyView, point: tuple[Scalar, Scalar]) -> None:
        self.a, self.b = a, b
        self.arm_a = (point[0] - a.x, point[1] - a.y)
        self.arm_b = (point[0] - b.x, point[1] - b.y)

    def lever(self, direction: tuple[Scalar, Scalar]) -> tuple[Scalar, Scalar]:
        """Moment arms of a unit force at the touching point on both bodies."""
        ax, ay = self.arm_a
        bx, by = self.arm_b
        return ax * direction[1] - ay * direction[0], bx * direction[1] - by * direction[0]

    def relative_speed(self, direction: tuple[Scalar, Scalar]) -> Scalar:
        """Speed of b's touching point relative to a's along a direction."""
        a, b = self.a, self.b
        lever_a, lever_b = self.lever(direction)
        return direction[0] * (b.vx - a.vx) + direction[1] * (b.vy - a.vy) + lever_b * b.spin - lever_a * a.spin

    def inverse_mass(self, along: tuple[Scalar, Scalar], across: tuple[Scalar, Scalar] | None = None) -> Scalar:
        """Change of the relative speed along one direction per impulse along another (or the same)."""
        a, b = self.a, self.b
        lever_a, lever_b = self.lever(along)
        other_a, other_b = self.lever(across) if across else (lever_a, lever_b)
        turning = lever_a * other_a * a.inverse_inertia + lever_b * other_b * b.inverse_inertia
        return turning if across else a.inverse_mass + b.inverse_mass + turning

    def after(
        self, direction: tuple[Scalar, Scalar], impulse: Scalar
    ) -> tuple[tuple[Scalar, Scalar, Scalar], tuple[Scalar, Scalar, Scalar]]:
        """Changes of (vx, vy, spin) of both bodies by an impulse on b (and its opposite on a)."""
        a, b = self.a, self.b
        lever_a, lever_b = self.lever(direction)
        x, y = direction
        change_a = (
            -a.inverse_mass * impulse * x,
            -a.inverse_mass * impulse * y,
            -a.inverse_inertia * lever_a * impulse,
        )
        change_b = (b.inverse_mass * impulse * x, b.inverse_mass * impulse * y, b.inverse_inertia * lever_b * impulse)
        return change_a, change_b


def rubs(effects: "Sequence[Effect]") -> bool:
    """Whether an effect adds impulses across the normal to contacts."""
    return any(effect.overrides(hook) for effect in effects for hook in ("tangential_impulse", "vertical_impulse"))


def contact(
    effects: "Sequence[Effect]",
    geometry: ContactGeometry,
    a: BodyView,
    b: BodyView,
    parameters: Mapping[str, Scalar],
    *,
    pressing: Scalar = 0.0,
) -> ContactResult:
    """What a contact does: a normal impulse with restitution, then the impulses across it that effects add.

    Bodies that begin to press on each other (`pressing` is 1) do not rebound, or hop where they also rub.
    Momentum and angular momentum are kept, because one impulse acts on both bodies at one point. Source: J. K. Hahn,
    Realistic animation of rigid bodies, SIGGRAPH 1988 (impact with the effective mass at the touching point).
    """
    normal = geometry.normal
    tangent = (-normal[1], normal[0])
    arms = _Arms(a, b, geometry.point)
    closing = -arms.relative_speed(normal)
    restitution: Scalar = 0.0
    for effect in effects:
        restitution = effect.restitution(closing, restitution, a, b, parameters)
    rebound = restitution * closing
    hop = maximum(rebound, HOP * minimum(a.radius, b.radius)) if rubs(effects) else 0.0
    rebound = where(pressing > 0.5, hop, rebound)
    impulse = (closing + rebound) / arms.inverse_mass(normal)
    change_a, change_b = arms.after(normal, impulse)
    sliding = arms.relative_speed(tangent)
    rising, mobility = _rising(effects, normal, a, b)
    view = ContactView(
        closing_speed=closing,
        normal_impulse=impulse,
        tangential_speed=sliding,
        tangential_speed_after_normal=sliding + impulse * arms.inverse_mass(normal, tangent),
        tangential_inverse_mass=arms.inverse_mass(tangent),
        vertical_speed=rising,
        vertical_inverse_mass=mobility,
    )
    across: Scalar = 0.0
    upward: Scalar = 0.0
    for effect in effects:
        across = across + effect.tangential_impulse(view, a, b, parameters)
        upward = upward + effect.vertical_impulse(view, a, b, parameters)
    more_a, more_b = arms.after(tangent, across)
    return ContactResult(
        a=(*_velocities_after(a, change_a, more_a), *_rolling_after(effects, normal, a, upward)),
        b=(*_velocities_after(b, change_b, more_b), *_rolling_after(effects, normal, b, upward)),
        normal_impulse=impulse,
        closing_speed=closing,
        geometry=geometry,
    )


def _velocities_after(body: BodyView, *changes: tuple[Scalar, Scalar, Scalar]) -> tuple[Scalar, Scalar, Scalar]:
    """Velocity and spin of a body after some changes."""
    x, y, spin = (sum(parts, start) for start, *parts in zip((body.vx, body.vy, body.spin), *changes, strict=True))
    return x, y, spin


def _rising(
    effects: "Sequence[Effect]", normal: tuple[Scalar, Scalar], a: BodyView, b: BodyView
) -> tuple[Scalar, Scalar]:
    """Speed at which b's touching point moves up relative to a's as spheres roll, and its change per upward impulse.

    A sphere that rolls at u turns so that its foremost point goes down at |u|. So with the normal n from a to b the
    touching point goes down at u_a n on a and up at u_b n on b. An impulse J up on b and down on a changes both u along
    n by (5/2) J/m, as that of a solid sphere's surface.
    """
    speed: Scalar = 0.0
    inverse_mass: Scalar = 0.0
    for body in (a, b) if slips(effects) else ():
        rolling = (body.vx - body.slip_x) * normal[0] + (body.vy - body.slip_y) * normal[1]
        speed = speed + body.is_sphere * rolling
        inverse_mass = inverse_mass + ROLLING_GAIN * body.is_sphere * body.inverse_mass
    return speed, inverse_mass


def _rolling_after(
    effects: "Sequence[Effect]", normal: tuple[Scalar, Scalar], body: BodyView, upward: Scalar
) -> tuple[Scalar, Scalar]:
    """Rolling velocity of a body after an upward impulse on b, see `_rising`."""
    if not slips(effects):
        return 0.0, 0.0
    change = ROLLING_GAIN * body.is_sphere * body.inverse_mass * upward
    return body.vx - body.slip_x + change * normal[0], body.vy - body.slip_y + change * normal[1]

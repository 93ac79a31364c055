"""Motion between events as a law: the time derivative of a body's state under all effects of a model."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from vrdp_prob.models.effects.effect import BodyView
from vrdp_prob.models.parameters import GRAVITY
from vrdp_prob.models.simulator.formula import Scalar
from vrdp_prob.models.simulator.mathematics import maximum, minimum, where

if TYPE_CHECKING:
    from vrdp_prob.models.effects.effect import Effect


SLIPPING_ABOVE = 1.5
"""Value of `Phase.moving` above which a sphere slips."""


@dataclass(frozen=True)
class Phase:
    """How a body moves between two events.

    Parameters
    ----------
    moving
        0 while the body rests, 1 while it slides or rolls, 2 while it slips (a sphere, in models where spheres do).
    spin_sense
        Sign of its spin about the vertical, 0 while it does not spin.
    """

    moving: Scalar
    spin_sense: Scalar


ROLLING_SHARE = 5 / 7
"""Share of a force that accelerates a rolling solid sphere; the table's friction takes the rest to turn it."""
ROLLING_GAIN = 5 / 2
"""Rate of the rolling velocity of a solid sphere per deceleration by friction."""


def slips(effects: "Sequence[Effect]") -> bool:
    """Whether spheres may slip, so that their state has a rolling velocity."""
    return any(effect.overrides("slip_friction") for effect in effects)


def external_acceleration(
    effects: "Sequence[Effect]", time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]
) -> tuple[Scalar, Scalar]:
    """Acceleration in m/s^2 by everything but the table's friction and other bodies."""
    ax: Scalar = 0.0
    ay: Scalar = 0.0
    for effect in effects:
        more = effect.acceleration(time, body, parameters)
        ax, ay = ax + more[0], ay + more[1]
    return ax, ay


def rolling_share(effects: "Sequence[Effect]", body: BodyView) -> Scalar:
    """Share of external accelerations that acts on a body which does not slip."""
    return 1 - (1 - ROLLING_SHARE) * body.is_sphere if slips(effects) else 1.0


def friction_limit(
    effects: "Sequence[Effect]", time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]
) -> Scalar:
    """Deceleration in m/s^2 by dry friction, which is also the acceleration that it can hold at rest."""
    coefficient: Scalar = None
    for effect in effects:
        if effect.overrides("friction_factor"):
            factor = effect.friction_factor(time, body, parameters)
            coefficient = factor if coefficient is None else coefficient * factor
    return 0.0 if coefficient is None else GRAVITY * coefficient


def slip_deceleration(
    effects: "Sequence[Effect]", time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]
) -> Scalar:
    """Deceleration in m/s^2 by friction against the slip of a sphere."""
    coefficient: Scalar = 0.0
    for effect in effects:
        if effect.overrides("slip_friction"):
            coefficient = maximum(coefficient, effect.slip_friction(time, body, parameters))
    return GRAVITY * coefficient


def spin_deceleration(
    effects: "Sequence[Effect]", time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]
) -> Scalar:
    """Rate in rad/s^2 at which the spin about the vertical decays."""
    total: Scalar = 0.0
    for effect in effects:
        total = total + effect.spin_deceleration(time, body, parameters)
    return total


def derivative(
    effects: "Sequence[Effect]", time: Scalar, body: BodyView, phase: Phase, parameters: Mapping[str, Scalar]
) -> tuple[Scalar, ...]:
    """Time derivative of (x, y, angle, vx, vy, spin) and, where spheres slip, of the rolling velocity (2 numbers).

    A sphere that slips is decelerated against its slip, which turns it faster until it rolls: a solid sphere gains
    5/2 in rolling velocity of what it loses in velocity. Source: A. Sommerfeld, Mechanics, section 27 (the billiard
    ball). While a body does not slip its rolling velocity is its velocity, and is not integrated.
    """
    ax, ay = external_acceleration(effects, time, body, parameters)
    spin = -phase.spin_sense * spin_deceleration(effects, time, body, parameters)
    braking = friction_limit(effects, time, body, parameters) / body.speed
    if not slips(effects):
        moves = phase.moving
        return (
            moves * body.vx,
            moves * body.vy,
            body.spin,
            moves * (ax - braking * body.vx),
            moves * (ay - braking * body.vy),
            spin,
        )
    moves, slipping = minimum(phase.moving, 1.0), phase.moving > SLIPPING_ABOVE
    share = rolling_share(effects, body)
    against = slip_deceleration(effects, time, body, parameters) / body.slip_speed
    along_x, along_y = against * body.slip_x, against * body.slip_y
    return (
        moves * body.vx,
        moves * body.vy,
        body.spin,
        moves * where(slipping, ax - along_x, share * ax - braking * body.vx),
        moves * where(slipping, ay - along_y, share * ay - braking * body.vy),
        spin,
        where(slipping, ROLLING_GAIN * along_x, 0.0),
        where(slipping, ROLLING_GAIN * along_y, 0.0),
    )

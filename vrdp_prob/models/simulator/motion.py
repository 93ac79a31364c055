"""Motion between events as a law: the time derivative of a body's state under all effects of a model."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from vrdp_prob.models.effects.effect import BodyView
from vrdp_prob.models.parameters import GRAVITY
from vrdp_prob.models.simulator.formula import Scalar

if TYPE_CHECKING:
    from vrdp_prob.models.effects.effect import Effect


@dataclass(frozen=True)
class Phase:
    """How a body moves between two events.

    Parameters
    ----------
    moving
        1 while the body moves, 0 while it rests.
    spin_sense
        Sign of its spin about the vertical, 0 while it does not spin.
    """

    moving: Scalar
    spin_sense: Scalar


def external_acceleration(
    effects: "Sequence[Effect]", time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]
) -> tuple[Scalar, Scalar]:
    """Acceleration in m/s^2 by everything but dry friction."""
    ax: Scalar = 0.0
    ay: Scalar = 0.0
    for effect in effects:
        more = effect.acceleration(time, body, parameters)
        ax, ay = ax + more[0], ay + more[1]
    return ax, ay


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
) -> tuple[Scalar, Scalar, Scalar, Scalar, Scalar, Scalar]:
    """Time derivative of (x, y, angle, vx, vy, spin)."""
    ax, ay = external_acceleration(effects, time, body, parameters)
    braking = friction_limit(effects, time, body, parameters) / body.speed
    return (
        phase.moving * body.vx,
        phase.moving * body.vy,
        body.spin,
        phase.moving * (ax - braking * body.vx),
        phase.moving * (ay - braking * body.vy),
        -phase.spin_sense * spin_deceleration(effects, time, body, parameters),
    )

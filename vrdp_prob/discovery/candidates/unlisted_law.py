"""Laws of no particular cause, which stand for all that the catalogue does not hold.

Where causes of the catalogue leave something that is not noise, they may stand for part of it. So they are compared
with laws that have a term for each way in which the motion between contacts can depend on place, velocity and time, and
the rebound from contacts on their speed, to low order. Such a law costs a parameter per term, so a cause that says the
same with one or two of them is more probable.
"""

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

from vrdp_prob.models.effects.effect import BodyView, Effect
from vrdp_prob.models.parameters import VIDEO_START, Parameter, Prior, Transform
from vrdp_prob.models.simulator.formula import Scalar
from vrdp_prob.models.simulator.mathematics import exp, maximum, minimum
from vrdp_prob.scene import Tracks

SLOW = 0.3
"""Speed in m/s below which friction may be another."""
SLOW_CONTACTS = (0.15, 0.3, 0.6)
"""Closing speeds in m/s below which restitution may be another, where a search begins."""
STANDSTILL = 1e-3
"""Speed in m/s below which a velocity has no direction."""


def _term(name: str, unit: str, description: str, sd: float) -> Parameter:
    return Parameter(name, unit, description, Transform.IDENTITY, Prior(0.0, sd), 0.0)


_FRICTION = (
    _term("friction_along_x", "1/m", "relative change of the friction per length along x", 0.5),
    _term("friction_along_y", "1/m", "relative change of the friction per length along y", 0.5),
    _term("friction_in_time", "1/s", "relative change of the friction per time", 0.2),
    _term("friction_of_slow", "1", "relative change of the friction of slow bodies", 2.0),
    _term("grain_x", "1", "relative change of the friction of bodies that move along x, and less of it along y", 0.5),
    _term(
        "grain_xy", "1", "relative change of the friction of bodies that move along x = y, and less along x = -y", 0.5
    ),
)
_DRAG = (
    _term("drag_first", "1/s", "deceleration per speed", 0.3),
    _term("drag_third", "s/m^2", "deceleration per third power of the speed", 0.3),
)
_TURN = (
    _term("turn", "1/s", "acceleration to the left of the velocity, per speed", 0.3),
    _term("turn_along_x", "1/(m s)", "the same, per length along x", 0.3),
    _term("turn_along_y", "1/(m s)", "the same, per length along y", 0.3),
)
_PUSH = tuple(
    _term(f"push_{axis}{of}", unit, f"acceleration along {axis}{words}", sd)
    for axis in "xy"
    for of, unit, words, sd in (
        ("", "m/s^2", "", 0.2),
        ("_by_x", "1/s^2", " per length along x", 0.2),
        ("_by_y", "1/s^2", " per length along y", 0.2),
        ("_by_time", "m/s^3", " per time", 0.1),
    )
)
_MOTION = (*_FRICTION, *_DRAG, *_TURN, *_PUSH)
_REBOUND = (
    _term("restitution_of_slow", "1", "logarithm of the factor of the restitution of slow contacts", 2.0),
    _term("restitution_by_speed", "s/m", "fall of the logarithm of the restitution per closing speed", 0.3),
    Parameter(
        "slow_contact",
        "m/s",
        "closing speed below which contacts are slow",
        Transform.LOG,
        Prior(math.log(SLOW), 0.7),
        SLOW,
    ),
)


class UnlistedMotion(Effect):
    """Friction, drag and pushes that depend on place, direction, speed and time to low order."""

    name: ClassVar = "unlisted_motion"
    sentence: ClassVar = (
        "Friction, drag and pushes depend on place, direction, speed and time in some way that the catalogue does not "
        "hold."
    )
    law: ClassVar = (
        "mu (1 + a . x + b t + c exp(-(v / 0.3)^2) + d cos 2 phi + e sin 2 phi), "
        "a = -(f + g v^2) v + (h + i . x) z x v + k + M x + m t"
    )
    source: ClassVar = "first terms of the expansion of any smooth law"
    parameters: ClassVar = _MOTION
    vanishes_at: ClassVar = {one.name: 0.0 for one in _MOTION}
    reads_video_start: ClassVar = True

    def friction_factor(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> Scalar:
        """Factor of the friction, by place, time, speed and direction."""
        squares = body.vx * body.vx + body.vy * body.vy
        among = squares + STANDSTILL**2
        change = (
            parameters["friction_along_x"] * body.x
            + parameters["friction_along_y"] * body.y
            + parameters["friction_in_time"] * (time - parameters[VIDEO_START])
            + parameters["friction_of_slow"] * exp(-squares / SLOW**2)
            + parameters["grain_x"] * (body.vx * body.vx - body.vy * body.vy) / among
            + parameters["grain_xy"] * 2 * body.vx * body.vy / among
        )
        return maximum(0.0, 1 + change)

    def acceleration(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> tuple[Scalar, Scalar]:
        """Acceleration in m/s^2: drag, turns and pushes."""
        squares = body.vx * body.vx + body.vy * body.vy
        drag = parameters["drag_first"] + parameters["drag_third"] * squares
        turn = parameters["turn"] + parameters["turn_along_x"] * body.x + parameters["turn_along_y"] * body.y
        push_x, push_y = (
            parameters[f"push_{axis}"]
            + parameters[f"push_{axis}_by_x"] * body.x
            + parameters[f"push_{axis}_by_y"] * body.y
            + parameters[f"push_{axis}_by_time"] * (time - parameters[VIDEO_START])
            for axis in "xy"
        )
        return push_x - drag * body.vx - turn * body.vy, push_y - drag * body.vy + turn * body.vx


class UnlistedRebound(Effect):
    """Restitution that depends on the closing speed to low order, and otherwise below some speed."""

    name: ClassVar = "unlisted_rebound"
    sentence: ClassVar = "Restitution depends on the closing speed in some way that the catalogue does not hold."
    law: ClassVar = "e = r1 r2 exp(n exp(-(v_n / slow_contact)^4) - o v_n), at most 1"
    source: ClassVar = "first term of the expansion of any smooth law, and a threshold"
    parameters: ClassVar = _REBOUND
    vanishes_at: ClassVar = {"restitution_of_slow": 0.0, "restitution_by_speed": 0.0}

    def search_points(self, videos: Sequence[Tracks]) -> Sequence[Mapping[str, float]]:
        """With thresholds between slow and middling contacts."""
        return [{"slow_contact": speed} for speed in SLOW_CONTACTS]

    def restitution(
        self,
        closing_speed: Scalar,
        restitution: Scalar,
        first: BodyView,
        second: BodyView,
        parameters: Mapping[str, Scalar],
    ) -> Scalar:
        """Coefficient of a contact, by its closing speed."""
        squared = (closing_speed / parameters["slow_contact"]) ** 2
        slow = parameters["restitution_of_slow"] * exp(-squared * squared)
        change = slow - parameters["restitution_by_speed"] * closing_speed
        return minimum(1.0, restitution * exp(change))

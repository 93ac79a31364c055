"""Restitution that falls with the speed of the impact."""

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

from vrdp_prob.models.effects.effect import BodyView, Effect
from vrdp_prob.models.parameters import Parameter, Prior, Transform
from vrdp_prob.models.simulator.formula import Scalar
from vrdp_prob.models.simulator.mathematics import exp, log, minimum
from vrdp_prob.scene import Tracks

RESTITUTION_EXPONENT = Parameter(
    "restitution_exponent",
    "1",
    "power with which restitution falls with the closing speed",
    Transform.IDENTITY,
    Prior(0.0, 0.3),
    default=0.0,
)
RESTITUTION_SPEED = Parameter(
    "restitution_speed",
    "m/s",
    "closing speed from which restitution falls",
    Transform.LOG,
    Prior(math.log(0.5), 1.0),
    default=0.5,
)


SEARCH_SPEEDS = (0.15, 0.5, 1.5)
"""Closing speeds in m/s from which restitution may fall."""


class SpeedDependentRestitution(Effect):
    """Fast impacts lose a larger share of their speed than slow ones."""

    name: ClassVar = "speed_dependent_restitution"
    sentence: ClassVar = (
        "The faster two bodies meet, the smaller, or larger, the share of the speed with which they part."
    )
    signed_sentences: ClassVar = (
        "The faster two bodies meet, the smaller the share of the speed with which they part.",
        "The faster two bodies meet, the larger the share of the speed with which they part.",
    )
    sign_of_law: ClassVar = +1
    law: ClassVar = "e = r1 r2 (1 + v_n / restitution_speed)^-restitution_exponent, at most 1"
    source: ClassVar = (
        "Johnson, Contact Mechanics (1985), section 11.5: e falls as v^(-1/4) where bodies yield plastically"
    )
    parameters: ClassVar = (RESTITUTION_EXPONENT, RESTITUTION_SPEED)
    vanishes_at: ClassVar = {"restitution_exponent": 0.0}

    def search_points(self, videos: Sequence[Tracks]) -> Sequence[Mapping[str, float]]:
        """With a fall that begins at slow, middling and fast impacts."""
        return [{"restitution_speed": speed} for speed in SEARCH_SPEEDS]

    def restitution(
        self,
        closing_speed: Scalar,
        restitution: Scalar,
        first: BodyView,
        second: BodyView,
        parameters: Mapping[str, Scalar],
    ) -> Scalar:
        """Coefficient of the contact."""
        growth = log(1 + closing_speed / parameters["restitution_speed"])
        return minimum(1.0, restitution * exp(-parameters["restitution_exponent"] * growth))

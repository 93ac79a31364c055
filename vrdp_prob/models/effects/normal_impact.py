"""Impact along the normal of a contact."""

from collections.abc import Mapping
from typing import ClassVar

from vrdp_prob.models.effects.effect import BodyView, Effect
from vrdp_prob.models.simulator.formula import Scalar
from vrdp_prob.models.simulator.mathematics import maximum, minimum

SLOWEST_REBOUND = 1e-3
"""Rebound speed in m/s below which a contact loses no energy.

Bodies that press on each other would otherwise meet infinitely often in finite time. They hop instead by less than a
micrometre, which pushes as a lasting contact would.
"""


class NormalImpact(Effect):
    """Restitution of a pair as the product of two factors."""

    name: ClassVar = "normal_impact"
    sentence: ClassVar = (
        "Two bodies that meet part with the product of their restitution factors as share of the speed."
    )
    law: ClassVar = "e = min(1, r1 r2), but the rebound is no slower than min(closing speed, 1 mm/s)"
    source: ClassVar = "Ding et al., NeurIPS 2021 (VRDP), section 3.3; momentum balance with the moments of inertia"

    def restitution(
        self,
        closing_speed: Scalar,
        restitution: Scalar,
        first: BodyView,
        second: BodyView,
        parameters: Mapping[str, Scalar],
    ) -> Scalar:
        """Product of the two factors, with the floor that keeps pressing contacts finite."""
        slow = minimum(1.0, SLOWEST_REBOUND / maximum(closing_speed, SLOWEST_REBOUND))
        return maximum(minimum(1.0, first.restitution * second.restitution), slow)

"""Impact along the normal of a contact."""

from collections.abc import Mapping
from typing import ClassVar

from vrdp_prob.models.effects.effect import BodyView, Effect
from vrdp_prob.models.simulator.formula import Scalar
from vrdp_prob.models.simulator.mathematics import minimum


class NormalImpact(Effect):
    """Restitution of a pair as the product of two factors."""

    name: ClassVar = "normal_impact"
    sentence: ClassVar = (
        "Two bodies that meet part with the product of their restitution factors as share of the speed."
    )
    law: ClassVar = "e = min(1, r1 r2)"
    source: ClassVar = "Ding et al., NeurIPS 2021 (VRDP), section 3.3; momentum balance with the moments of inertia"

    def restitution(
        self,
        closing_speed: Scalar,
        restitution: Scalar,
        first: BodyView,
        second: BodyView,
        parameters: Mapping[str, Scalar],
    ) -> Scalar:
        """Product of the two factors, at most 1."""
        return minimum(1.0, first.restitution * second.restitution)

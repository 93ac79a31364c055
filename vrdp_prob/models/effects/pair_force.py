"""Attraction or repulsion between bodies at a distance."""

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

from vrdp_prob.models.effects.effect import BodyView, Effect
from vrdp_prob.models.effects.places import Region
from vrdp_prob.models.parameters import Parameter, Prior, Transform
from vrdp_prob.models.simulator.formula import Scalar
from vrdp_prob.models.simulator.mathematics import sqrt
from vrdp_prob.scene import Tracks

PAIR_STRENGTH = Parameter(
    "pair_strength",
    "N m^2",
    "strength of the attraction between two bodies",
    Transform.IDENTITY,
    Prior(0.0, 0.05),
    default=0.0,
    goes_with_masses=True,
)
PAIR_SOFTENING = Parameter(
    "pair_softening",
    "m",
    "distance below which the attraction between two bodies grows no further",
    Transform.LOG,
    Prior(math.log(0.2), 0.7),
    default=0.2,
)


SEARCH_SOFTENINGS, SIZE = (0.02, 0.07, 0.2), 0.07
"""Softening lengths with which the force is looked for, and the expected one, in half widths of the region where
bodies were seen."""


class PairForce(Effect):
    """A force along the line between two bodies that falls with the square of their distance."""

    name: ClassVar = "pair_force"
    sentence: ClassVar = "Bodies attract or repel each other without touching."
    signed_sentences: ClassVar = (
        "Bodies attract each other without touching.",
        "Bodies repel each other without touching.",
    )
    law: ClassVar = (
        "force pair_strength r / (|r|^2 + pair_softening^2)^1.5 between two bodies, attraction where positive"
    )
    source: ClassVar = "inverse-square law with a softening length: H. C. Plummer, MNRAS 71 (1911)"
    parameters: ClassVar = (PAIR_STRENGTH, PAIR_SOFTENING)
    vanishes_at: ClassVar = {"pair_strength": 0.0}

    def expected(self, videos: Sequence[Tracks]) -> Mapping[str, Parameter]:
        """The softening length is small beside the region where bodies were seen."""
        return Region.of(videos).expected_size(PAIR_SOFTENING, SIZE)

    def search_points(self, videos: Sequence[Tracks]) -> Sequence[Mapping[str, float]]:
        """With a short and a long range of the softening."""
        unit = Region.of(videos).half_width
        return [{"pair_softening": share * unit} for share in SEARCH_SOFTENINGS]

    def pair_force(
        self, time: Scalar, first: BodyView, second: BodyView, parameters: Mapping[str, Scalar]
    ) -> tuple[Scalar, Scalar]:
        """Force in N towards the second body."""
        x, y = second.x - first.x, second.y - first.y
        square = x * x + y * y + parameters["pair_softening"] * parameters["pair_softening"]
        strength = parameters["pair_strength"] / (square * sqrt(square))
        return strength * x, strength * y

"""A place on the table with another friction."""

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

from vrdp_prob.models.effects.effect import BodyView, Effect
from vrdp_prob.models.effects.places import Region, visited
from vrdp_prob.models.parameters import Parameter, Prior, Transform
from vrdp_prob.models.simulator.formula import Scalar
from vrdp_prob.models.simulator.mathematics import length, maximum, where
from vrdp_prob.scene import Tracks

PATCH_X = Parameter("patch_x", "m", "x of the patch's middle", Transform.IDENTITY, Prior(0.0, 2.0), default=0.0)
PATCH_Y = Parameter("patch_y", "m", "y of the patch's middle", Transform.IDENTITY, Prior(0.0, 2.0), default=0.0)
PATCH_RADIUS = Parameter(
    "patch_radius", "m", "radius of the patch", Transform.LOG, Prior(math.log(0.5), 0.7), default=0.5
)
PATCH_FRICTION = Parameter(
    "patch_friction",
    "1",
    "share by which friction is larger on the patch",
    Transform.IDENTITY,
    Prior(0.0, 1.0),
    default=0.0,
)


SEARCH_STEP, SEARCH_RADII = 0.1, (0.1, 0.2)
"""Distance between the places where a patch is looked for, and radii that are tried, in half widths of the region where
bodies were seen."""

REACH, SIZE = 1.0, 0.17
"""Standard deviation of each coordinate of its place, and its radius, in half widths of that region."""


class FrictionPatch(Effect):
    """Friction differs inside a disc."""

    name: ClassVar = "friction_patch"
    sentence: ClassVar = "There is a patch on the table that slows bodies more, or less, than the rest."
    signed_sentences: ClassVar = (
        "There is a patch on the table that slows bodies more than the rest.",
        "There is a patch on the table that slows bodies less than the rest.",
    )
    law: ClassVar = "mu (1 + patch_friction) where the centre is within patch_radius of (patch_x, patch_y), at least 0"
    source: ClassVar = "dry friction of two materials"
    parameters: ClassVar = (PATCH_X, PATCH_Y, PATCH_RADIUS, PATCH_FRICTION)
    vanishes_at: ClassVar = {"patch_friction": 0.0}
    least_start: ClassVar = {"patch_friction": -0.9}

    def expected(self, videos: Sequence[Tracks]) -> Mapping[str, Parameter]:
        """The patch is somewhere where bodies were seen, and not much larger or smaller than that."""
        region = Region.of(videos)
        return region.expected(PATCH_X, PATCH_Y, REACH) | region.expected_size(PATCH_RADIUS, SIZE)

    def search_points(self, videos: Sequence[Tracks]) -> Sequence[Mapping[str, float]]:
        """Places next to one another wherever bodies were seen, with a small and a large radius."""
        unit = Region.of(videos).half_width
        return [
            {"patch_x": x, "patch_y": y, "patch_radius": radius * unit}
            for radius in SEARCH_RADII
            for x, y in visited(videos, SEARCH_STEP * unit)
        ]

    def boundary(self, body: BodyView, parameters: Mapping[str, Scalar]) -> Scalar:
        """Distance of the centre from the patch in m, negative on it."""
        distance = length(body.x - parameters["patch_x"], body.y - parameters["patch_y"])
        return distance - parameters["patch_radius"]

    def friction_factor(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> Scalar:
        """Factor of the friction, 1 beside the patch."""
        return where(body.side[self.name] < 0, maximum(0.0, 1 + parameters["patch_friction"]), 1.0)

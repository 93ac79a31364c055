"""A lens that bends straight lines."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import ClassVar

import torch
from jaxtyping import Float
from torch import Tensor

from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.places import Region, places_around
from vrdp_prob.models.parameters import Parameter, Prior, Transform
from vrdp_prob.scene import Tracks

DISTORTION = Parameter(
    "distortion",
    "1/m^2",
    "relative displacement per squared distance",
    Transform.IDENTITY,
    Prior(0.0, 0.02),
    default=0.0,
)
LENS_X = Parameter("lens_x", "m", "x of the picture's centre", Transform.IDENTITY, Prior(0.0, 0.5), 0.0)
LENS_Y = Parameter("lens_y", "m", "y of the picture's centre", Transform.IDENTITY, Prior(0.0, 0.5), 0.0)

SEARCH_SHARES = (-0.4, -0.2, 0.0, 0.2, 0.4)
"""Where the centre is looked for, in half widths of the region where bodies were seen."""
AT_THE_EDGE, SMALLEST = 0.004, 1e-3
"""Relative displacement at the edge of the region where bodies were seen, as it is expected at least, and half width
in m below which a region counts as so wide."""
REACH = 0.25
"""Standard deviation of each coordinate of its place, in half widths of the region where bodies were seen."""


class LensDistortion(Effect):
    """Positions are recorded farther from the picture's centre than they are, or nearer."""

    name: ClassVar = "lens_distortion"
    sentence: ClassVar = "The lens bends straight lines: positions far from the middle of the picture are displaced."
    signed_sentences: ClassVar = (
        "The lens bends straight lines: positions far from the middle of the picture are displaced outwards.",
        "The lens bends straight lines: positions far from the middle of the picture are displaced inwards.",
    )
    law: ClassVar = "recorded r' = r (1 + distortion |r|^2) about (lens_x, lens_y)"
    source: ClassVar = "Brown, Close-range camera calibration, Photogrammetric Engineering 37 (1971), first radial term"
    parameters: ClassVar = (DISTORTION, LENS_X, LENS_Y)
    vanishes_at: ClassVar = {"distortion": 0.0}

    def expected(self, videos: Sequence[Tracks]) -> Mapping[str, Parameter]:
        """The picture's centre is in the middle of what was seen, about; on small tables lenses bend as much."""
        region = Region.of(videos)
        sd = max(DISTORTION.prior.sd, AT_THE_EDGE / max(region.half_width, SMALLEST) ** 2)
        bent = replace(DISTORTION, prior=replace(DISTORTION.prior, sd=sd))
        return {DISTORTION.name: bent, **region.expected(LENS_X, LENS_Y, REACH)}

    def search_points(self, videos: Sequence[Tracks]) -> Sequence[Mapping[str, float]]:
        """Centres in the inner part of the region where bodies were seen."""
        return [{"lens_x": x, "lens_y": y} for x, y in places_around(videos, SEARCH_SHARES)]

    def measured_positions(
        self,
        positions: Float[Tensor, "world time body 2"],
        times: Float[Tensor, "world time"],
        parameters: Mapping[str, Float[Tensor, "..."]],
    ) -> Float[Tensor, "world time body 2"]:
        """Positions in m as they are recorded."""
        centre = torch.stack([parameters["lens_x"], parameters["lens_y"]], dim=-1)[:, None, None, :]
        apart = positions - centre
        return positions + parameters["distortion"][:, None, None, None] * (apart**2).sum(-1, keepdim=True) * apart

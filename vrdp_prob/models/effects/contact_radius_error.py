"""Bodies that are larger or smaller than stated."""

from collections.abc import Mapping
from typing import ClassVar

from jaxtyping import Float
from torch import Tensor

from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.parameters import Parameter, Prior, Transform

RADIUS_ERROR = Parameter(
    "radius_error",
    "1",
    "share by which bodies touch farther out than their stated radii say",
    Transform.IDENTITY,
    Prior(0.0, 0.1),
    default=0.0,
)


class ContactRadiusError(Effect):
    """All bodies touch at another distance than their radii say."""

    name: ClassVar = "contact_radius_error"
    sentence: ClassVar = "Bodies touch at another distance than their stated radii say."
    signed_sentences: ClassVar = (
        "Bodies touch at a larger distance than their stated radii say.",
        "Bodies touch at a smaller distance than their stated radii say.",
    )
    law: ClassVar = "contact radius = radius (1 + radius_error)"
    source: ClassVar = "definition"
    parameters: ClassVar = (RADIUS_ERROR,)
    vanishes_at: ClassVar = {"radius_error": 0.0}

    def contact_radius(
        self, radius: Float[Tensor, "world body"], parameters: Mapping[str, Float[Tensor, "..."]]
    ) -> Float[Tensor, "world body"]:
        """Radius in m, scaled."""
        return radius * (1 + parameters["radius_error"][:, None])

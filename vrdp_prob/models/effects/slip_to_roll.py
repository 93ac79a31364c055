"""Spheres that slide on the table until they roll."""

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

import torch
from jaxtyping import Float
from torch import Tensor

from vrdp_prob.models.effects.effect import BodyView, Effect
from vrdp_prob.models.parameters import Parameter, Prior, Scope, Transform
from vrdp_prob.models.simulator.formula import Scalar
from vrdp_prob.scene import Shape, Tracks

SLIP_FRICTION = Parameter(
    "slip_friction",
    "1",
    "friction coefficient of a sphere that slips on the table",
    Transform.LOG,
    Prior(math.log(0.2), 0.7),
    default=0.2,
    shapes=frozenset({Shape.SPHERE}),
)
RELEASE_ROLLING = Parameter(
    "release_rolling",
    "1",
    "velocity at which a sphere would roll by its spin when it is released, over its velocity then",
    Transform.IDENTITY,
    Prior(0.5, 0.5),
    default=0.0,
    scope=Scope.BODY,
    shapes=frozenset({Shape.SPHERE}),
)
RELEASE_ROLLING_ACROSS = Parameter(
    "release_rolling_across",
    "1",
    "velocity to the left of its own at which a sphere would roll by its spin when it is released, over its velocity",
    Transform.IDENTITY,
    Prior(0.0, 0.3),
    default=0.0,
    scope=Scope.BODY,
    shapes=frozenset({Shape.SPHERE}),
)


class SlipToRoll(Effect):
    """A solid sphere slips against the table's friction until its spin has caught up with its velocity."""

    name: ClassVar = "slip_to_roll"
    sentence: ClassVar = "Spheres slide after they start and after they are hit, until they roll."
    law: ClassVar = (
        "while a sphere slips with s = v - u on the table, v changes at -slip_friction g s/|s| and u, the velocity at "
        "which it would roll by its spin, at 5/2 of the opposite; contacts change u only by their friction"
    )
    source: ClassVar = "A. Sommerfeld, Mechanics (Lectures on theoretical physics 1), section 27: the billiard ball"
    parameters: ClassVar = (SLIP_FRICTION, RELEASE_ROLLING, RELEASE_ROLLING_ACROSS)
    vanishes_like: ClassVar = {"slip_friction": "rolling_resistance"}
    also_vanishes: ClassVar = {"slip_friction": "or so large that spheres roll at once"}

    def search_points(self, videos: Sequence[Tracks]) -> Sequence[Mapping[str, float]]:
        """With spheres that are released without rolling; they slow down as rolling ones do if the frictions agree."""
        return ({"release_rolling": 0.0, "release_rolling_across": 0.0},)

    def slip_friction(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> Scalar:
        """Friction coefficient while the sphere slips."""
        return parameters["slip_friction"]

    def rolling_velocity(
        self, velocity: Float[Tensor, "world body 2"], parameters: Mapping[str, Float[Tensor, "..."]]
    ) -> Float[Tensor, "world body 2"]:
        """Shares of the velocity with which a sphere rolls along and across it when it is released."""
        left = torch.stack([-velocity[..., 1], velocity[..., 0]], dim=-1)
        along, across = parameters["release_rolling"], parameters["release_rolling_across"]
        return along[..., None] * velocity + across[..., None] * left

"""A clock that loses frames."""

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.places import expected_time
from vrdp_prob.models.parameters import Parameter, Prior, Scope, Transform
from vrdp_prob.scene import Tracks

LOST_TIME = Parameter(
    "lost_time",
    "s",
    "time that passed without a frame",
    Transform.IDENTITY,
    Prior(0.0, 0.2),
    default=0.0,
    scope=Scope.VIDEO,
)
LOST_AT = Parameter(
    "lost_at",
    "s",
    "time stamp after which frames are missing",
    Transform.IDENTITY,
    Prior(2.5, 1.5),
    default=2.5,
    scope=Scope.VIDEO,
)


class ClockError(Effect):
    """Frames were dropped, and the stamps go on as if they had not been.

    A clock that is fast or slow throughout cannot be seen: velocities and frictions make up for it.
    """

    name: ClassVar = "clock_error"
    sentence: ClassVar = "Frames are missing though their time stamps go on evenly: all bodies jump along their paths."
    law: ClassVar = "true time = stamp + lost_time after lost_at"
    source: ClassVar = "definition"
    parameters: ClassVar = (LOST_TIME, LOST_AT)
    vanishes_at: ClassVar = {"lost_time": 0.0}
    stepwise: ClassVar = frozenset({"lost_at"})

    def expected(self, videos: Sequence[Tracks]) -> Mapping[str, Parameter]:
        """Frames are missing somewhere in the videos."""
        return expected_time(videos, LOST_AT)

    def search_points(self, videos: Sequence[Tracks]) -> Sequence[Mapping[str, float]]:
        """Between any two frames."""
        times = np.unique(np.concatenate([(one.times[1:] + one.times[:-1]) / 2 for one in videos]).round(6))
        return [{"lost_at": float(time)} for time in times]

    def measured_times(
        self, times: Float[Tensor, "world time"], parameters: Mapping[str, Float[Tensor, "..."]]
    ) -> Float[Tensor, "world time"]:
        """True times in s of the frames."""
        return times + torch.where(times > parameters["lost_at"][:, None], parameters["lost_time"][:, None], 0.0)

"""Frames that are dropped again and again."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import ClassVar

import torch
from jaxtyping import Float
from torch import Tensor

from vrdp_prob.models.effects.clock_error import ClockError
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.places import usual_interval
from vrdp_prob.models.parameters import Parameter, Prior, Scope, Transform
from vrdp_prob.scene import Tracks

MOST_DROPPED = 24
"""Frames that are dropped in one video at most."""
NEVER = 1e9
"""Time in s that no video reaches."""
FRAME_TIME_SD = 0.02
"""Standard deviation of the logarithm of the time that goes with one frame, about that between two stamps."""
FRAME_TIME = Parameter(
    "dropped_frame_time",
    "s",
    "time that passes with each dropped frame",
    Transform.LOG,
    Prior(math.log(0.04), FRAME_TIME_SD),
    default=0.04,
)
DROPPED_AFTER = tuple(
    Parameter(
        f"dropped_after_{number}",
        "s",
        f"time stamp after which the {number}. dropped frame is missing",
        Transform.IDENTITY,
        Prior(NEVER, 1.0),
        default=NEVER,
        scope=Scope.VIDEO,
        inferred=False,
    )
    for number in range(1, MOST_DROPPED + 1)
)


class DroppedFrames(Effect):
    """Frames were dropped at several times, and the stamps go on as if they had not been.

    With each of them all bodies take one more step at once, which tracks show by themselves. So nothing is inferred of
    the times, and of the step only how long it is: a clock that drops frames loses the time between two of them.
    """

    name: ClassVar = "dropped_frames"
    cause: ClassVar = ClockError.name
    sentence: ClassVar = (
        "Frames are missing again and again though their stamps go on evenly: all bodies take one step more at once."
    )
    law: ClassVar = "true time = stamp + dropped_frame_time n, with n the number of frames dropped before"
    source: ClassVar = "definition"
    parameters: ClassVar = (FRAME_TIME, *DROPPED_AFTER)
    stepwise: ClassVar = frozenset(one.name for one in DROPPED_AFTER)

    def expected(self, videos: Sequence[Tracks]) -> Mapping[str, Parameter]:
        """A dropped frame lasts as long as the time between two stamps."""
        interval = usual_interval(videos)
        prior = Prior(math.log(interval), FRAME_TIME_SD)
        return {FRAME_TIME.name: replace(FRAME_TIME, prior=prior, default=interval)}

    def measured_times(
        self, times: Float[Tensor, "world time"], parameters: Mapping[str, Float[Tensor, "..."]]
    ) -> Float[Tensor, "world time"]:
        """True times in s of the frames."""
        after = torch.stack([parameters[one.name] for one in DROPPED_AFTER], dim=1)
        dropped = (times[:, None] > after[:, :, None]).sum(dim=1)
        return times + parameters[FRAME_TIME.name][:, None] * dropped

"""Frames that come a little early or late."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import ClassVar

from jaxtyping import Float
from torch import Tensor

from vrdp_prob.models.effects.clock_error import ClockError
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.places import usual_interval
from vrdp_prob.models.parameters import FRAME_JITTER, Parameter
from vrdp_prob.scene import Tracks

EXPECTED_SHARE = 0.1
"""Jitter that is expected, as a share of the time between two frames."""


class IrregularFrames(Effect):
    """Frames come at irregular times, and their stamps say that they do not.

    In one frame all bodies are ahead of where they should be along their paths, or all behind. A single body shows that
    as noise along its path, and two or more as a clock.
    """

    name: ClassVar = "irregular_frames"
    cause: ClassVar = ClockError.name
    sentence: ClassVar = (
        "Frames come at irregular times though their stamps are even: all bodies are early or late at once."
    )
    law: ClassVar = "true time = stamp + frame_jitter z, with z normal and another one in every frame"
    source: ClassVar = "definition"
    parameters: ClassVar = (FRAME_JITTER,)
    vanishes_at: ClassVar = {FRAME_JITTER.name: 0.0}

    def expected(self, videos: Sequence[Tracks]) -> Mapping[str, Parameter]:
        """A tenth of the time between two frames."""
        interval = usual_interval(videos)
        usual = EXPECTED_SHARE * interval
        prior = replace(FRAME_JITTER.prior, mean=math.log(usual))
        return {FRAME_JITTER.name: replace(FRAME_JITTER, prior=prior, default=usual)}

    def frame_jitter(self, parameters: Mapping[str, Float[Tensor, "..."]]) -> Float[Tensor, "world"]:
        """Standard deviation in s of the true times of frames."""
        return parameters[FRAME_JITTER.name]

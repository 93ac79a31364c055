"""Friction that changes in the course of a video."""

from collections.abc import Mapping
from typing import ClassVar

from vrdp_prob.models.effects.effect import BodyView, Effect
from vrdp_prob.models.parameters import VIDEO_START, Parameter, Prior, Transform
from vrdp_prob.models.simulator.formula import Scalar
from vrdp_prob.models.simulator.mathematics import maximum

FRICTION_TREND = Parameter(
    "friction_trend", "1/s", "relative change of the friction per time", Transform.IDENTITY, Prior(0.0, 0.1), 0.0
)


class TimeVaryingFriction(Effect):
    """All friction grows or falls in proportion to the time."""

    name: ClassVar = "time_varying_friction"
    sentence: ClassVar = "The table becomes rougher, or smoother, in the course of the video."
    signed_sentences: ClassVar = (
        "The table becomes rougher in the course of the video.",
        "The table becomes smoother in the course of the video.",
    )
    law: ClassVar = "mu(t) = mu (1 + friction_trend t), at least 0, t since the first frame of the video"
    source: ClassVar = "first order of any slow change"
    parameters: ClassVar = (FRICTION_TREND,)
    vanishes_at: ClassVar = {"friction_trend": 0.0}
    reads_video_start: ClassVar = True

    def friction_factor(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> Scalar:
        """Factor of the friction, 1 in the first frame."""
        return maximum(0.0, 1 + parameters["friction_trend"] * (time - parameters[VIDEO_START]))

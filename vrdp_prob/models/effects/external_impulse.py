"""A kick from outside."""

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from vrdp_prob.models.effects.effect import BodyView, Effect
from vrdp_prob.models.effects.places import expected_time
from vrdp_prob.models.parameters import Parameter, Prior, Scope, Transform
from vrdp_prob.models.simulator.formula import Scalar
from vrdp_prob.scene import Tracks

IMPULSE_TIME = Parameter(
    "impulse_time",
    "s",
    "time at which bodies are kicked",
    Transform.IDENTITY,
    Prior(2.5, 1.5),
    default=2.5,
    scope=Scope.VIDEO,
)
IMPULSE_X = Parameter(
    "impulse_x",
    "m/s",
    "change of a body's velocity along x by the kick",
    Transform.IDENTITY,
    Prior(0.0, 0.5),
    default=0.0,
    scope=Scope.BODY,
)
IMPULSE_Y = Parameter(
    "impulse_y",
    "m/s",
    "change of a body's velocity along y by the kick",
    Transform.IDENTITY,
    Prior(0.0, 0.5),
    default=0.0,
    scope=Scope.BODY,
)


class ExternalImpulse(Effect):
    """Velocities change at once, at one time."""

    name: ClassVar = "external_impulse"
    sentence: ClassVar = "Something from outside kicked a body."
    law: ClassVar = "v changes by (impulse_x, impulse_y) of the body at impulse_time"
    source: ClassVar = "definition of an impulse"
    parameters: ClassVar = (IMPULSE_TIME, IMPULSE_X, IMPULSE_Y)
    vanishes_at: ClassVar = {"impulse_x": 0.0, "impulse_y": 0.0}

    def expected(self, videos: Sequence[Tracks]) -> Mapping[str, Parameter]:
        """It happens at some time while bodies are seen."""
        return expected_time(videos, IMPULSE_TIME)

    def search_points(self, videos: Sequence[Tracks]) -> Sequence[Mapping[str, float]]:
        """At every second frame."""
        times = np.unique(np.concatenate([one.times[1:-1:2] for one in videos]).round(6))
        return [{"impulse_time": float(time)} for time in times]

    def kick_time(self, parameters: Mapping[str, Scalar]) -> Scalar:
        """Time in s of the kick."""
        return parameters["impulse_time"]

    def kick(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> tuple[Scalar, Scalar, Scalar]:
        """Change of the velocity in m/s."""
        return body.parameters["impulse_x"], body.parameters["impulse_y"], 0.0

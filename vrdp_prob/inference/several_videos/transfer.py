"""Shared numbers with which the fit of another model begins."""

import math
from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from vrdp_prob.inference.several_videos.joint_fit import JointFit
from vrdp_prob.inference.several_videos.linking import SharedNumbers
from vrdp_prob.models.parameters import Transform

LOG_FAINT = math.log(0.01)
"""Where the logarithm of a strength begins that is to be found, relative to what is expected of it."""


def first_numbers(
    joint: JointFit, numbers: SharedNumbers, vanishing: Mapping[str, float], start: Mapping[str, float]
) -> tuple[Float[np.ndarray, "shared"], Float[np.ndarray, "shared"]]:
    """Shared numbers at which another model is as good as that of a fit, and those to which its own fit goes first.

    Parameters
    ----------
    joint
        The fit.
    numbers
        Shared numbers of the other model.
    vanishing
        Values at which its effects vanish.
    start
        Values of some of its new parameters, by name and in their units.
    """
    known = dict(zip(joint.numbers.keys, joint.gaussian.mean, strict=True))
    same, towards = numbers.prior_mean.copy(), numbers.prior_mean.copy()
    for place, (key, entry) in enumerate(zip(numbers.keys, numbers.entries, strict=True)):
        if key in known:
            same[place] = towards[place] = known[key]
            continue
        if key[0] in start:
            same[place] = towards[place] = entry.transform.to_coordinate(start[key[0]])
        if key[0] in vanishing:
            same[place] = _nearly_vanished(entry.transform, vanishing[key[0]], towards[place])
            towards[place] = towards[place] if key[0] in start else same[place]
    return same, towards


def _nearly_vanished(transform: Transform, value: float, expected: float) -> float:
    """Coordinate at which a strength vanishes; where that is infinitely far, one far below what is expected."""
    return expected + LOG_FAINT if transform is Transform.LOG and value == 0.0 else transform.to_coordinate(value)

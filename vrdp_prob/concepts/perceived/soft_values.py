"""What soft operations take and give: probabilities where the exact form has yes or no in each draw.

Each type is the soft form of the type of the same role in `vrdp_prob.reasoning.values`.
"""

from dataclasses import dataclass

from jaxtyping import Float
from torch import Tensor


@dataclass(frozen=True)
class SoftObjectSet:
    """Probability of each object to be in a set."""

    probability: Float[Tensor, "body"]


@dataclass(frozen=True)
class SoftObjectRef:
    """One object: a distribution over objects."""

    probability: Float[Tensor, "body"]


@dataclass(frozen=True)
class SoftEventSet:
    """Probability of each event to be in a set, their times in s (NaN where there is none), and whose they are."""

    probability: Float[Tensor, "event"]
    time: Float[Tensor, "event"]
    parties: tuple[SoftObjectSet | SoftObjectRef, ...] = ()


@dataclass(frozen=True)
class SoftEventRef:
    """One event: a distribution over events, and the probability that there is one at all."""

    probability: Float[Tensor, "event"]
    present: Float[Tensor, ""]
    time: Float[Tensor, "event"]


@dataclass(frozen=True)
class SoftMoment:
    """The time of an event that is not known for sure: a distribution over events with their times in s."""

    probability: Float[Tensor, "event"]
    time: Float[Tensor, "event"]


@dataclass(frozen=True)
class SoftTruth:
    """Probability of yes."""

    probability: Float[Tensor, ""]


@dataclass(frozen=True)
class SoftCount:
    """Expectation of a number."""

    mean: Float[Tensor, ""]


@dataclass(frozen=True)
class SoftLabel:
    """Probability of each value of an attribute."""

    probability: Float[Tensor, "value"]
    names: tuple[str, ...]


SoftValue = SoftObjectSet | SoftObjectRef | SoftEventSet | SoftEventRef | SoftMoment | SoftTruth | SoftCount | SoftLabel

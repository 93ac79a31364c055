"""The registry of soft operations, and what they are made of.

A soft operation is the soft form of one exact operation, whose token, signature and words are its own. On probabilities
of 0 and 1 both forms agree; in between a soft form takes what it is given for independent.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

import torch
from jaxtyping import Float
from torch import Tensor

from vrdp_prob.concepts.perceived.soft_facts import SoftFacts
from vrdp_prob.concepts.perceived.soft_values import SoftValue
from vrdp_prob.reasoning.values import Value

Exact = Callable[..., Value]
Soft = TypeVar("Soft", bound=Callable[..., SoftValue])

SOFT_FORMS: dict[Exact, Callable[..., SoftValue]] = {}
"""Soft forms by the function of the exact operation."""


def soft_form_of(*exact: Exact) -> Callable[[Soft], Soft]:
    """Register a function as the soft form of exact operations."""

    def register(function: Soft) -> Soft:
        SOFT_FORMS.update(dict.fromkeys(exact, function))
        return function

    return register


@dataclass
class SoftRun:
    """One program at work on probabilities.

    Parameters
    ----------
    facts
        What is known about the video.
    """

    facts: SoftFacts
    makes_sense: list[Float[Tensor, ""]] = field(default_factory=list, init=False)

    def require(self, probability: Float[Tensor, ""]) -> None:
        """Note how probable it is that a step of the program makes sense."""
        self.makes_sense.append(probability)

    @property
    def validity(self) -> Float[Tensor, ""]:
        """Probability that the whole program makes sense."""
        return torch.stack(self.makes_sense).prod() if self.makes_sense else torch.ones((), dtype=torch.double)


def either(probability: Float[Tensor, "*rest option"]) -> Float[Tensor, "*rest"]:
    """Probability that any of several independent statements holds."""
    return 1 - (1 - probability).prod(dim=-1)


def only(probability: Float[Tensor, "option"]) -> Float[Tensor, "option"]:
    """Probability of each of several independent statements to be the only one that holds."""
    others = ~torch.eye(len(probability), dtype=torch.bool)
    return probability * torch.where(others, 1 - probability, torch.ones_like(probability)).prod(dim=-1)


def normalised(weight: Float[Tensor, "option"]) -> Float[Tensor, "option"]:
    """Weights as a distribution; all zero where they are."""
    return weight / weight.sum().clamp_min(torch.finfo(weight.dtype).tiny)

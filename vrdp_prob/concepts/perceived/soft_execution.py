"""Programs on probabilities instead of draws, so that a wrong answer tells the concepts how to change.

A soft operation is the soft form of one exact operation, whose token, signature and words are its own: programs are
checked and stepped through once, in `vrdp_prob.reasoning.program`. On probabilities of 0 and 1 both forms agree. In
between a soft form takes what it is given for independent. That what a question presupposes holds (there is exactly one
red cube) has a probability too: the draws that leave the question in the exact form.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import torch
from jaxtyping import Float
from torch import Tensor

from vrdp_prob.concepts.perceived.soft_facts import SoftFacts
from vrdp_prob.concepts.perceived.soft_values import SoftValue
from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.operations import Operation
from vrdp_prob.reasoning.program import Program
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


def run_softly(program: Program, run: SoftRun) -> SoftValue:
    """Run a checked program on probabilities; `run` learns how probable it is that it makes sense.

    Raises
    ------
    InputError
        If the program asks about a simulated world, of which there is no soft form.
    """

    def apply(operation: Operation, arguments: Sequence[Any]) -> SoftValue:
        if operation.function not in SOFT_FORMS:
            raise InputError(
                f"'{operation.token}' asks about a world that has to be simulated; concepts are learned from "
                "descriptive and explanatory questions."
            )
        return SOFT_FORMS[operation.function](run, *arguments)

    return program.evaluate(apply)


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

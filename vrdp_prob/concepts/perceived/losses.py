"""How wrong a soft answer is: cross-entropy for words and choices, squared error for counts."""

from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor

from vrdp_prob.concepts.perceived.examples import Example
from vrdp_prob.concepts.perceived.soft_execution import run_softly
from vrdp_prob.concepts.perceived.soft_facts import SoftFacts
from vrdp_prob.concepts.perceived.soft_forms import SoftRun
from vrdp_prob.concepts.perceived.soft_values import SoftCount, SoftLabel, SoftTruth, SoftValue

_MISTAKES = 0.02
"""Share of examples whose answer, or whose soft answer, is allowed to be wrong for reasons that no concept can mend."""


@dataclass(frozen=True)
class Judged:
    """One example, answered softly.

    Parameters
    ----------
    loss
        Minus the log probability that the question makes sense, and of its answer (a squared error for a count).
    right
        Whether the likeliest answer is the right one.
    """

    loss: Float[Tensor, ""]
    right: bool


def judge_softly(example: Example, facts: SoftFacts) -> Judged:
    """Answer an example and compare.

    That a question is asked says something, too: what it presupposes (one red cube, one collision) is there.
    """
    run = SoftRun(facts)
    value = run_softly(example.program, run)
    loss, right = _compared(value, example.answer)
    return Judged(loss + _surprise(run.validity), right)


def _compared(value: SoftValue, answer: str) -> tuple[Float[Tensor, ""], bool]:
    if isinstance(value, SoftCount):
        return (value.mean - float(answer)) ** 2, round(value.mean.item()) == int(answer)
    if isinstance(value, SoftTruth):
        share = value.probability if answer == "yes" else 1 - value.probability
        return _surprise(share), share.item() > 0.5
    if isinstance(value, SoftLabel):
        shares = dict(zip(value.names, value.probability, strict=True))
        best = max(shares, key=lambda name: shares[name].item())
        return _surprise(shares.get(answer, torch.zeros_like(value.probability[0]))), best == answer
    raise TypeError(f"a question cannot end with {type(value).__name__}")


def _surprise(probability: Float[Tensor, ""]) -> Float[Tensor, ""]:
    return -torch.log(_MISTAKES + (1 - 2 * _MISTAKES) * probability)

"""Answers: the distribution over draws, in words that a report can print."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.explanation.explanation import Explanation
from vrdp_prob.scene import QuestionType


@dataclass(frozen=True)
class ChoiceAnswer:
    """How probable it is that one choice is correct.

    Parameters
    ----------
    choice_id
        Name of the choice within its question.
    choice
        The choice in English.
    probability
        That the choice is correct.
    mc_error
        Monte Carlo standard error of the probability.
    """

    choice_id: int | str
    choice: str
    probability: float
    mc_error: float


@dataclass(frozen=True)
class Answer:
    """The answer to one question.

    Parameters
    ----------
    question_id, question, question_type
        What was asked.
    answer
        The most probable answer; for multiple choice the ids of the choices answered `correct`.
    probability
        Of that answer; for multiple choice the joint probability that every choice is judged right.
    mc_error
        Monte Carlo standard error of the probability.
    entropy
        Entropy in nats of the distribution of answers.
    distribution
        Probability of each answer. For multiple choice a key lists the ids of the correct choices, such as `0,2`.
    choices
        For multiple choice, how probable each choice is.
    relies_on_default
        Objects of default mass or restitution that the answer depends on.
    notes
        What else limits the answer, in sentences.
    valid_share
        Share of the draws that the answer is from: those in which the question makes sense, with all its choices.
    explainer
        Explains it; see `explain`.
    """

    question_id: int | str | None
    question: str
    question_type: QuestionType
    answer: str | int | tuple[int | str, ...]
    probability: float
    mc_error: float
    entropy: float
    distribution: Mapping[str, float]
    choices: tuple[ChoiceAnswer, ...] = ()
    relies_on_default: tuple[str, ...] = ()
    notes: tuple[str, ...] = field(default=())
    valid_share: float = 1.0
    explainer: Callable[[], Explanation] | None = field(default=None, repr=False, compare=False)

    def explain(self) -> Explanation:
        """What the answer hangs on, where its doubt comes from, and what would settle it.

        Raises
        ------
        InputError
            If the answer was not given by `ask`.
        """
        if self.explainer is None:
            raise InputError("this answer does not know where it comes from; explain one that `ask` gave.")
        return self.explainer()

    def to_document(self) -> dict[str, object]:
        """The answer as an item of `answers` in report.json."""
        answer = list(self.answer) if isinstance(self.answer, tuple) else self.answer
        return {
            "question_id": self.question_id,
            "question": self.question,
            "question_type": self.question_type.value,
            "answer": answer,
            "probability": self.probability,
            "mc_error": self.mc_error,
            "entropy": self.entropy,
            "distribution": dict(self.distribution),
            "choices": [
                {
                    "choice_id": choice.choice_id,
                    "choice": choice.choice,
                    "probability": choice.probability,
                    "mc_error": choice.mc_error,
                }
                for choice in self.choices
            ],
            "relies_on_default": list(self.relies_on_default),
            "notes": list(self.notes),
            "valid_share": self.valid_share,
        }


def monte_carlo_error(probability: float, draws: float) -> float:
    """Standard error of a share of draws, never zero for finitely many of them.

    The standard deviation of the Beta(k + 1/2, n - k + 1/2) posterior of the share (Jeffreys' prior), so that 0 of 500
    draws does not claim to be exactly 0.

    Parameters
    ----------
    probability
        The share k/n.
    draws
        Number n of effective draws; infinite where nothing is random.
    """
    if np.isinf(draws):
        return 0.0
    alpha, beta = probability * draws + 0.5, (1 - probability) * draws + 0.5
    return float(np.sqrt(alpha * beta / ((alpha + beta) ** 2 * (alpha + beta + 1))))

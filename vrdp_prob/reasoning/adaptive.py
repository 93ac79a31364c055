"""More draws where an answer needs them: near one half, until its Monte Carlo error is as small as asked."""

from collections.abc import Sequence
from dataclasses import replace

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.answer import Answer
from vrdp_prob.reasoning.executor import answer_question
from vrdp_prob.reasoning.prepared import ChoiceInput
from vrdp_prob.reasoning.vocabulary import PLAIN, Vocabulary
from vrdp_prob.reasoning.worlds import PosteriorWorlds
from vrdp_prob.scene import Question


def answer_within(
    worlds: PosteriorWorlds,
    question: str | Sequence[str] | Question,
    *,
    choices: Sequence[ChoiceInput] = (),
    mc_error: float,
    vocabulary: Vocabulary = PLAIN,
) -> Answer:
    """Answer a question from as many draws as its Monte Carlo error asks for.

    Batches of draws are added while the error of the answer, or of one of its choices, is above the one asked for and
    the posterior has draws that make the answer surer. What was simulated before is used again. Where the posterior
    has no more to give, the answer says so in its notes.

    Parameters
    ----------
    worlds
        The worlds to begin with; batches are as large as their first one.
    question, choices, vocabulary
        See `answer_question`.
    mc_error
        Monte Carlo standard error to reach, of every probability. A probability p needs about p (1 - p) / mc_error^2
        independent draws.

    Raises
    ------
    InputError
        If `mc_error` is not between 0 and 1, or see `answer_question`.
    """
    check_mc_error(mc_error)
    answer = answer_question(worlds, question, choices=choices, vocabulary=vocabulary)
    while largest_error(answer) > mc_error:
        if worlds.more is None:
            reached = f"The Monte Carlo error is {largest_error(answer):.2g}, above the {mc_error:g} asked for"
            return replace(answer, notes=(*answer.notes, f"{reached}: {worlds.exhausted}."))
        worlds = worlds.more
        answer = answer_question(worlds, question, choices=choices, vocabulary=vocabulary)
    return answer


def check_mc_error(mc_error: float) -> None:
    """Refuse an error that cannot be asked for.

    Raises
    ------
    InputError
        If it is not between 0 and 1.
    """
    if not 0 < mc_error < 1:
        raise InputError(f"mc_error is {mc_error:g}; ask for a number between 0 and 1, for example 0.02.")


def largest_error(answer: Answer) -> float:
    """Largest Monte Carlo error of the probabilities of an answer and of its choices.

    Of the values of an open question the most probable one has the largest error.
    """
    return max([answer.mc_error, *(choice.mc_error for choice in answer.choices)])

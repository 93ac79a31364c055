"""An answer as lines of text, in the report's words."""

import math
from collections.abc import Sequence

from vrdp_prob.plain_words import listed, percent, percent_error
from vrdp_prob.reasoning import Answer
from vrdp_prob.report.wording import rests_on, with_names
from vrdp_prob.scene import Body


def answer_lines(
    answer: Answer, bodies: Sequence[Body], limits: Sequence[str] = (), *, misfit: Sequence[str] = ()
) -> list[str]:
    """A misfit of the model, a line for each choice or value, then what limits the answer and its draws.

    Parameters
    ----------
    answer
        The answer.
    bodies
        The objects, by whose names sentences call them.
    limits
        What limits the draws.
    misfit
        Those of them that tell how the model does not fit; they come before any number.
    """
    if answer.choices:
        shares = [(choice.probability, choice.mc_error, choice.choice) for choice in answer.choices]
    else:
        ordered = sorted(answer.distribution.items(), key=lambda item: -item[1])
        shares = [(share, _error_of(share, answer), value) for value, share in ordered]
    lines = [f"{percent(share, error):>6} {percent_error(share, error):<7} {text}" for share, error, text in shares]
    notes = [*answer.notes, *(limit for limit in limits if limit not in misfit)]
    if answer.relies_on_default:
        who = f"object{'s' * (len(answer.relies_on_default) > 1)} {listed(answer.relies_on_default)}"
        notes.insert(0, rests_on(who))

    def told(sentences: Sequence[str]) -> list[str]:
        return [f"note: {with_names(sentence, bodies)}" for sentence in sentences]

    return [*told(misfit), *lines, *told(notes)]


def _error_of(share: float, answer: Answer) -> float:
    """Monte Carlo error of the share of one value, from that of the most probable one: both are of the same draws."""
    if not 0 < answer.probability < 1:
        return answer.mc_error
    return answer.mc_error * math.sqrt(share * (1 - share) / (answer.probability * (1 - answer.probability)))

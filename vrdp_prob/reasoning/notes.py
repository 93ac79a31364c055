"""Notes: which draws an answer leaves out, and why, in sentences that a report can print."""

from collections.abc import Sequence

from vrdp_prob.reasoning.run import Gap, Run


def share_words(share: float) -> str:
    """A share in whole per cent, as a part of a sentence; never 0 or 100 where it is neither."""
    if 0 < share < 0.005:
        return "less than 1 %"
    return "more than 99 %" if 0.995 <= share < 1 else f"{100 * share:.0f} %"


def gap_notes(runs: Sequence[Run], choices: Sequence[str] = ()) -> tuple[str, ...]:
    """One note for each way in which draws leave a question.

    Parameters
    ----------
    runs
        The run of each choice, or the one run of a question without choices.
    choices
        The texts of the choices.
    """
    alike: dict[tuple[Gap, ...], list[int]] = {}
    for place, run in enumerate(runs):
        if run.gaps:
            alike.setdefault(tuple(run.gaps), []).append(place)
    notes, stated = [], set()
    for gaps, places in alike.items():
        causes = [
            cause for cause in dict.fromkeys(cause for gap in gaps for cause in gap.causes) if cause not in stated
        ]
        stated.update(causes)
        who = _who([choices[place] for place in places] if choices else [], len(choices))
        notes.append(" ".join([*causes, f"{_left_out(gaps)}; {who} from the other{_rest(runs[places[0]])}."]))
    return tuple(notes)


def _left_out(gaps: tuple[Gap, ...]) -> str:
    first, *others = gaps
    clauses = [f"In {share_words(first.share)} of the draws {first.clause}"]
    return ", ".join([*clauses, *(f"in {share_words(gap.share)} {gap.clause}" for gap in others)])


def _who(choices: Sequence[str], count: int) -> str:
    """What is answered from the draws that are left; `count` is the number of all choices."""
    if not choices:
        return "the answer is"
    if len(choices) == count > 1:
        return "every choice is judged"
    quoted = " and ".join(f"“{choice}”" for choice in choices)
    return f"{quoted} {'is' if len(choices) == 1 else 'are'} judged"


def _rest(run: Run) -> str:
    left = float(run.valid.mean())
    return "s" if left >= 0.995 else f" {share_words(left)}"

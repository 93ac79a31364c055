"""Questions that were answered wrongly, one by one, beside how firm their right answers are in the engine itself."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from _answer_goals import title
from _page import table_row

from vrdp_prob.evaluation.judgement import Judgement

HEAD = ("scene", "question", "answered", "right is", "its probability", "holds in re-runs", "right with")


def wrong_answers(
    judged: Sequence[Judgement], others: Mapping[str, Sequence[Judgement]], sensitivity: Path
) -> list[str]:
    """A table of wrong answers, and how many of them the probabilities led to expect.

    Parameters
    ----------
    judged
        All judgements of one row.
    others
        The same questions as other rows answered them, by the row's name.
    sensitivity
        What the engine itself answers when it runs every scene again from velocities that are 0.5 % off.
    """
    again = json.loads(sensitivity.read_text(encoding="utf-8"))["scenes"]
    wrong = [one for one in judged if not one.right]
    holds = [_holds(one, again[str(_scene(one))][one.question_id]) for one in wrong]
    rows = [
        (
            str(_scene(one)),
            f"{title(one.kind)}: {one.question}",
            _choices(one, one.answer),
            _choices(one, one.truth),
            f"{one.probability:.2f}",
            f"{100 * share:.0f} %",
            ", ".join(name for name, made in others.items() if _same(one, made).right),
        )
        for one, share in zip(wrong, holds, strict=True)
    ]
    expected = sum(1 - one.confidence for one in judged)
    shaky = sum(share < 1 for share in holds)
    return [
        f"{len(wrong)} of {len(judged)} questions are answered wrongly; {expected:.1f} were to be expected by the "
        f"probabilities of the answers. Of the {len(wrong)} right answers {shaky} change in the engine itself when it "
        "runs the scene again from velocities that are 0.5 % off.",
        "",
        *(table_row(*cells) for cells in (HEAD, ["---"] * len(HEAD), *rows)),
    ]


def _scene(one: Judgement) -> int:
    return int(one.scene.removeprefix("video_"))


def _same(one: Judgement, made: Sequence[Judgement]) -> Judgement:
    return next(other for other in made if (other.scene, other.question_id) == (one.scene, one.question_id))


def _holds(one: Judgement, found: Mapping[str, Any]) -> float:
    """Share of re-runs with the same answer; of a question with choices, for the choice that is least firm."""
    if "changed" in found:
        return 1 - float(found["changed"])
    shares = zip(found["p_correct"], (truth for _, truth in one.choices), strict=True)
    return min(share if truth else 1 - share for share, truth in shares)


def _choices(one: Judgement, answer: str) -> str:
    if not one.texts:
        return answer
    texts = dict(one.texts)
    return "; ".join(texts[choice] for choice in answer.split(",") if choice) or "none of its choices"

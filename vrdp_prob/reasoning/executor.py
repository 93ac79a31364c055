"""From a question to an answer: parse where it is English, type-check, run for all draws, summarise the draws."""

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
from jaxtyping import Bool

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.answer import Answer, ChoiceAnswer, monte_carlo_error
from vrdp_prob.reasoning.entropy import entropy
from vrdp_prob.reasoning.explanation.explain import explain
from vrdp_prob.reasoning.facts import Facts
from vrdp_prob.reasoning.notes import gap_notes
from vrdp_prob.reasoning.prepared import ChoiceInput, PreparedQuestion, prepare
from vrdp_prob.reasoning.verdict import YES, Verdict, verdicts
from vrdp_prob.reasoning.vocabulary import PLAIN, Vocabulary
from vrdp_prob.scene import Choice, Question


def answer_question(
    facts: Facts,
    question: str | Sequence[str] | Question,
    *,
    choices: Sequence[ChoiceInput] = (),
    vocabulary: Vocabulary = PLAIN,
) -> Answer:
    """Answer a question about a video.

    Parameters
    ----------
    facts
        What is known about the video.
    question
        English, a program (a list of tokens), or a question of a question file.
    choices
        Options of a multiple-choice question, each in English, as a program, or as a choice of a question file.
    vocabulary
        The words that they may use.

    Raises
    ------
    InputError
        If the question cannot be understood, names an object that is not there or that two objects fit, or needs
        choices and has none.
    """
    asked = prepare(question, choices, vocabulary)
    return _open_answer(facts, asked) if not asked.options else _choice_answer(facts, asked)


def _open_answer(facts: Facts, asked: PreparedQuestion) -> Answer:
    (verdict,) = verdicts(facts, asked)
    names, valid = verdict.names, verdict.valid
    shares = np.bincount(verdict.codes[valid], minlength=len(names)) / valid.sum()
    best = int(shares.argmax())
    return Answer(
        question_id=asked.question.question_id,
        question=asked.question.text,
        question_type=asked.kind,
        answer=int(names[best]) if verdict.counts else names[best],
        probability=float(shares[best]),
        mc_error=monte_carlo_error(float(shares[best]), facts.effective_draws * float(valid.mean())),
        entropy=entropy(shares),
        distribution=_distribution(names, shares),
        relies_on_default=_relies_on_default(facts, [verdict]),
        notes=(*asked.notes, *_notes(facts, [verdict])),
        valid_share=float(valid.mean()),
        explainer=partial(explain, facts, asked),
    )


def _choice_answer(facts: Facts, asked: PreparedQuestion) -> Answer:
    judged = verdicts(facts, asked)
    table = np.stack([verdict.codes == YES for verdict in judged], axis=1)
    valid = np.all([verdict.valid for verdict in judged], axis=0)
    if not valid.any():
        raise InputError(f"'{asked.question.text}': its choices make sense in no draw together; ask them one by one.")
    vectors, counts = np.unique(table[valid], axis=0, return_counts=True)
    shares = counts / valid.sum()
    best = int(shares.argmax())
    names = [_ids(asked, vector) for vector in vectors]
    draws = facts.effective_draws * float(valid.mean())
    return Answer(
        question_id=asked.question.question_id,
        question=asked.question.text,
        question_type=asked.kind,
        answer=tuple(choice.choice_id for (choice, _), yes in zip(asked.options, vectors[best], strict=True) if yes),
        probability=float(shares[best]),
        mc_error=monte_carlo_error(float(shares[best]), draws),
        entropy=entropy(shares),
        distribution=_distribution(tuple(names), shares),
        choices=tuple(
            _choice_share(facts, choice, verdict) for (choice, _), verdict in zip(asked.options, judged, strict=True)
        ),
        relies_on_default=_relies_on_default(facts, judged),
        notes=(*asked.notes, *_notes(facts, judged, [choice.text for choice, _ in asked.options])),
        valid_share=float(valid.mean()),
        explainer=partial(explain, facts, asked),
    )


def _choice_share(facts: Facts, choice: Choice, verdict: Verdict) -> ChoiceAnswer:
    probability = float((verdict.codes[verdict.valid] == YES).mean())
    error = monte_carlo_error(probability, facts.effective_draws * float(verdict.valid.mean()))
    return ChoiceAnswer(choice.choice_id, choice.text, probability, error)


def _ids(asked: PreparedQuestion, vector: Bool[np.ndarray, "choice"]) -> str:
    return ",".join(str(choice.choice_id) for (choice, _), yes in zip(asked.options, vector, strict=True) if yes)


def _distribution(names: tuple[str, ...], shares: np.ndarray) -> Mapping[str, float]:
    """The answers that occur, the most probable first."""
    order = np.argsort(-shares, kind="stable")
    return {names[place]: float(shares[place]) for place in order if shares[place] > 0}


def _relies_on_default(facts: Facts, judged: Sequence[Verdict]) -> tuple[str, ...]:
    found = {body for verdict in judged for world in verdict.run.looked_at for body in facts.relies_on_default(world)}
    return tuple(body.id for body in facts.bodies if body.id in found)


def _notes(facts: Facts, judged: Sequence[Verdict], choices: Sequence[str] = ()) -> tuple[str, ...]:
    runs = [verdict.run for verdict in judged]
    limits = (facts.limits(world) for run in runs for world in sorted(run.looked_at, key=str))
    return (*gap_notes(runs, choices), *dict.fromkeys(limit for of_world in limits for limit in of_world))

"""From a question to an answer: parse where it is English, type-check, run for all draws, summarise the draws."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.answer import Answer, ChoiceAnswer, entropy, monte_carlo_error
from vrdp_prob.reasoning.facts import Facts
from vrdp_prob.reasoning.language import parse_choice, parse_question
from vrdp_prob.reasoning.notes import gap_notes
from vrdp_prob.reasoning.program import ANSWERS, ENTRIES, Program, check, needs_choices, question_type
from vrdp_prob.reasoning.run import Run
from vrdp_prob.reasoning.values import Count, Label, Truth, Value
from vrdp_prob.scene import Choice, Question, QuestionType

ChoiceInput = str | Sequence[str] | Choice


def answer_question(
    facts: Facts, question: str | Sequence[str] | Question, *, choices: Sequence[ChoiceInput] = ()
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

    Raises
    ------
    InputError
        If the question cannot be understood, names an object that is not there or that two objects fit, or needs
        choices and has none.
    """
    asked = prepare(question, choices)
    return _open_answer(facts, asked) if not asked.options else _choice_answer(facts, asked)


@dataclass(frozen=True)
class PreparedQuestion:
    """A question and its choices as checked programs; an open question has a program, a choice question options."""

    question: Question
    kind: QuestionType
    program: Program | None
    options: tuple[tuple[Choice, Program], ...]


def prepare(question: str | Sequence[str] | Question, choices: Sequence[ChoiceInput]) -> PreparedQuestion:
    """Understand a question and its choices; raises `InputError` as `answer_question` does."""
    stated = _as_question(question)
    program = stated.program if stated.program is not None else parse_question(stated.text)
    kind = stated.question_type or question_type(program)
    given = [_as_choice(number, choice) for number, choice in enumerate(choices)] or list(stated.choices)
    if not needs_choices(program):
        if given:
            raise InputError(f"'{stated.text}' is answered without choices; leave them out.")
        return PreparedQuestion(stated, kind, check(program), ())
    if not given:
        raise InputError(f"'{stated.text}' needs choices to judge; give at least one (--choice TEXT).")
    return PreparedQuestion(stated, kind, None, tuple(_option(choice, program, kind) for choice in given))


def _option(choice: Choice, question_program: Sequence[str], kind: QuestionType) -> tuple[Choice, Program]:
    program = choice.program if choice.program is not None else parse_choice(choice.text, kind)
    try:
        check(program, ends_in=ENTRIES)
        whole = check((*program, *question_program), ends_in=(Truth,))
    except InputError as error:
        raise InputError(f"choice '{choice.text}': {error}") from error
    return choice, whole


def _as_question(question: str | Sequence[str] | Question) -> Question:
    if isinstance(question, Question):
        return question
    if isinstance(question, str):
        return Question(text=question)
    program = tuple(question)
    return Question(text=" ".join(program), program=program)


def _as_choice(number: int, choice: ChoiceInput) -> Choice:
    if isinstance(choice, Choice):
        return choice
    if isinstance(choice, str):
        return Choice(number, choice)
    program = tuple(choice)
    return Choice(number, " ".join(program), program)


def _open_answer(facts: Facts, asked: PreparedQuestion) -> Answer:
    if asked.program is None:
        raise TypeError("an open question has a program of its own")
    run = Run(facts)
    value = asked.program.run(run)
    codes, names = _codes(value)
    shares = np.bincount(codes[run.valid], minlength=len(names)) / run.valid.sum()
    best = int(shares.argmax())
    draws = facts.effective_draws * float(run.valid.mean())
    answer = int(names[best]) if isinstance(value, Count) else names[best]
    return Answer(
        question_id=asked.question.question_id,
        question=asked.question.text,
        question_type=asked.kind,
        answer=answer,
        probability=float(shares[best]),
        mc_error=monte_carlo_error(float(shares[best]), draws),
        entropy=entropy(shares),
        distribution=_distribution(names, shares),
        relies_on_default=_relies_on_default(facts, [run]),
        notes=_notes(facts, [run]),
        valid_share=float(run.valid.mean()),
    )


def _choice_answer(facts: Facts, asked: PreparedQuestion) -> Answer:
    runs, judged = [], []
    for choice, program in asked.options:
        run = Run(facts)
        value = program.run(run)
        if not isinstance(value, Truth):
            raise TypeError(f"choice '{choice.text}' is not judged by yes or no")
        runs.append(run)
        judged.append(value.value)
    table = np.stack(judged, axis=1)
    choices = tuple(
        _choice_share(facts, choice, table[:, place], runs[place]) for place, (choice, _) in enumerate(asked.options)
    )
    valid = np.all([run.valid for run in runs], axis=0)
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
        choices=choices,
        relies_on_default=_relies_on_default(facts, runs),
        notes=_notes(facts, runs, [choice.text for choice, _ in asked.options]),
        valid_share=float(valid.mean()),
    )


def _choice_share(facts: Facts, choice: Choice, value: Bool[np.ndarray, "draw"], run: Run) -> ChoiceAnswer:
    probability = float(value[run.valid].mean())
    error = monte_carlo_error(probability, facts.effective_draws * float(run.valid.mean()))
    return ChoiceAnswer(choice.choice_id, choice.text, probability, error)


def _codes(value: Value) -> tuple[Int[np.ndarray, "draw"], tuple[str, ...]]:
    """The answer of each draw as a place in a list of names."""
    if isinstance(value, Truth):
        return value.value.astype(int), ("no", "yes")
    if isinstance(value, Count):
        return value.value, tuple(str(number) for number in range(int(value.value.max()) + 1))
    if isinstance(value, Label):
        return value.index, value.names
    raise TypeError(f"a question cannot end with {type(value).__name__}, one of {ANSWERS} is needed")


def _ids(asked: PreparedQuestion, vector: Bool[np.ndarray, "choice"]) -> str:
    return ",".join(str(choice.choice_id) for (choice, _), yes in zip(asked.options, vector, strict=True) if yes)


def _distribution(names: tuple[str, ...], shares: np.ndarray) -> Mapping[str, float]:
    """The answers that occur, the most probable first."""
    order = np.argsort(-shares, kind="stable")
    return {names[place]: float(shares[place]) for place in order if shares[place] > 0}


def _relies_on_default(facts: Facts, runs: list[Run]) -> tuple[str, ...]:
    found = {body for run in runs for world in run.looked_at for body in facts.relies_on_default(world)}
    return tuple(body.id for body in facts.bodies if body.id in found)


def _notes(facts: Facts, runs: Sequence[Run], choices: Sequence[str] = ()) -> tuple[str, ...]:
    limits = (facts.limits(world) for run in runs for world in sorted(run.looked_at, key=str))
    return (*gap_notes(runs, choices), *dict.fromkeys(limit for of_world in limits for limit in of_world))

"""Questions looked at before the expensive work: what no posterior could answer is refused early."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vrdp_prob.reasoning import object_operations
from vrdp_prob.reasoning.events import EventTable, EventUniverse
from vrdp_prob.reasoning.facts import Motion, TableFacts
from vrdp_prob.reasoning.operations import Operation
from vrdp_prob.reasoning.prepared import ChoiceInput, prepare
from vrdp_prob.reasoning.program import Program
from vrdp_prob.reasoning.run import Run
from vrdp_prob.reasoning.values import ObjectSet, Value, Word
from vrdp_prob.reasoning.vocabulary import ChangeWord, Vocabulary
from vrdp_prob.scene import Body, Question, Tracks

DRAWS = 2000
"""Draws of attributes that perception is not sure of."""

STATIC = (
    object_operations.objects,
    object_operations.filter_color,
    object_operations.filter_material,
    object_operations.filter_shape,
    object_operations.unique,
)
"""Operations that look at attributes alone, which the posterior does not change."""


def check_question(
    question: str | Sequence[str] | Question,
    *,
    choices: Sequence[ChoiceInput] = (),
    tracks: Tracks | None = None,
    words: Sequence[ChangeWord] = (),
) -> None:
    """Refuse a question that could not be answered, without any inference.

    Parameters
    ----------
    question, choices, words
        As for `vrdp_prob.reasoning.ask`.
    tracks
        What was seen; where it is given, the objects that the question names by their attributes are looked up.

    Raises
    ------
    InputError
        If the question is not understood, needs choices and has none, or names by color, material and shape an object
        that is not in the tracks or that two objects fit.
    """
    asked = prepare(question, choices, Vocabulary.of(words))
    if tracks is None:
        return
    programs = [program for _, program in asked.options] or ([] if asked.program is None else [asked.program])
    facts = _attributes_alone(tracks.bodies)
    for program in programs:
        _look_up_objects(program, Run(facts))


@dataclass(frozen=True)
class _Unknown:
    """A value that only the posterior can tell."""


def _look_up_objects(program: Program, run: Run) -> None:
    """Run the steps of a program whose values follow from attributes alone."""

    def apply(step: Operation, arguments: Sequence[Value | _Unknown]) -> Value | _Unknown:
        known = [value for value in arguments if isinstance(value, Word | ObjectSet)]
        return step(run, *known) if step.function in STATIC and len(known) == len(arguments) else _Unknown()

    program.evaluate(apply)


def _attributes_alone(bodies: tuple[Body, ...]) -> TableFacts:
    """Facts of a video in which nothing happens."""
    nothing = EventTable.empty(EventUniverse(tuple(body.id for body in bodies)), DRAWS)
    still = np.zeros((1, 1, len(bodies)), dtype=bool)
    return TableFacts(bodies, nothing, Motion(np.zeros(1), still, still))

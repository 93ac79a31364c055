"""Programs on probabilities instead of draws, so that a wrong answer tells the concepts how to change.

Programs are checked and stepped through once, in `vrdp_prob.reasoning.program`; here their operations take their soft
forms. That what a question presupposes holds (there is exactly one red cube) has a probability too: where it does not,
the exact form leaves the question.
"""

from collections.abc import Sequence
from typing import Any

from vrdp_prob.concepts.perceived import soft_event_operations, soft_object_operations, soft_output_operations
from vrdp_prob.concepts.perceived.soft_forms import SOFT_FORMS, SoftRun
from vrdp_prob.concepts.perceived.soft_values import SoftValue
from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.operations import Operation
from vrdp_prob.reasoning.program import Program

SOFT_OPERATION_MODULES = (soft_event_operations, soft_object_operations, soft_output_operations)
"""Modules whose import fills the registry of soft forms."""


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

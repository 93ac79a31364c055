"""Operations that change one object: every word for a change has the same three, `apply_...` and `counterfact_...`."""

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.changes import BUILT_IN, Change
from vrdp_prob.reasoning.event_operations import changed_events
from vrdp_prob.reasoning.operations import Operation, register
from vrdp_prob.reasoning.run import Run
from vrdp_prob.reasoning.values import EventSet, ObjectRef

APPLY, COUNTERFACT = "apply_", "counterfact_"
"""What a word is put after to make a token of it."""


def change_operations(change: Change) -> tuple[Operation, ...]:
    """The operations that a word for a change adds to the vocabulary."""

    def apply(run: Run, chosen: ObjectRef) -> ObjectRef:
        """The object, to be changed in the counterfactual that follows."""
        del run
        _require_unchanged(chosen, change)
        return ObjectRef(chosen.index, chosen.words, change)

    def counterfact(run: Run, chosen: EventSet, who: ObjectRef) -> EventSet:
        """Those of the events that happen with the object changed."""
        _require_unchanged(who, change)
        return changed_events(run, chosen, who, change)

    def all_counterfact(run: Run, who: ObjectRef) -> EventSet:
        """What happens with the object changed."""
        _require_unchanged(who, change)
        return changed_events(run, None, who, change)

    return (
        Operation(f"{APPLY}{change.word}", ((ObjectRef,),), ObjectRef, apply),
        Operation(f"{COUNTERFACT}{change.word}", ((EventSet,), (ObjectRef,)), EventSet, counterfact),
        Operation(f"{COUNTERFACT}{change.word}", ((ObjectRef,),), EventSet, all_counterfact),
    )


def _require_unchanged(who: ObjectRef, change: Change) -> None:
    if who.change is not None:
        raise InputError(
            f"{who.phrase} cannot be {who.change} and {change} in one question; change it in one way (one `apply_` or "
            "`counterfact_` token)."
        )


for built_in in BUILT_IN:
    if not built_in.removes:
        for built_in_operation in change_operations(built_in):
            register(built_in_operation)

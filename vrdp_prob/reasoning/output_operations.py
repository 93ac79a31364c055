"""Operations that end a program: numbers, yes or no, attributes."""

import numpy as np

from vrdp_prob.reasoning.facts import NOT_STATED
from vrdp_prob.reasoning.operations import operation
from vrdp_prob.reasoning.run import Run
from vrdp_prob.reasoning.values import Count, EventRef, EventSet, Label, ObjectRef, ObjectSet, Truth


@operation("count", (ObjectSet, EventSet), gives=Count)
def count(run: Run, chosen: ObjectSet | EventSet) -> Count:
    """How many there are."""
    del run
    return Count(chosen.mask.sum(axis=1))


@operation("exist", (ObjectSet, EventSet), gives=Truth)
def exist(run: Run, chosen: ObjectSet | EventSet) -> Truth:
    """Whether there is any."""
    del run
    return Truth(np.asarray(chosen.mask.any(axis=1)))


@operation("negate", Truth, gives=Truth)
def negate(run: Run, statement: Truth) -> Truth:
    """The opposite."""
    del run
    return Truth(~statement.value)


@operation("belong_to", EventRef, EventSet, gives=Truth)
def event_belongs(run: Run, event: EventRef, chosen: EventSet) -> Truth:
    """Whether an event is among others; one that does not happen is not."""
    table = run.facts.events()
    ordinary = np.asarray(table.universe.takes_part.any(axis=1))
    mask = chosen.mask[np.arange(run.facts.draws), event.index] & ordinary[event.index]
    return Truth(mask & event.present)


@operation("belong_to", ObjectRef, EventSet, gives=Truth)
def object_belongs(run: Run, who: ObjectRef, chosen: EventSet) -> Truth:
    """Whether an object takes part in any of the events."""
    takes_part = run.facts.events().universe.takes_part[:, who.index].T
    return Truth((chosen.mask & takes_part).any(axis=1))


@operation("query_color", ObjectRef, gives=Label)
def query_color(run: Run, who: ObjectRef) -> Label:
    """Its colour."""
    return _attribute(run, who, "color")


@operation("query_material", ObjectRef, gives=Label)
def query_material(run: Run, who: ObjectRef) -> Label:
    """Its material."""
    return _attribute(run, who, "material")


@operation("query_shape", ObjectRef, gives=Label)
def query_shape(run: Run, who: ObjectRef) -> Label:
    """Its shape."""
    return _attribute(run, who, "shape")


def _attribute(run: Run, who: ObjectRef, name: str) -> Label:
    labels = run.facts.attribute(name)
    table = np.stack([label.index for label in labels], axis=1)
    index = table[np.arange(run.facts.draws), who.index]
    names = labels[0].names
    run.require(index != names.index(NOT_STATED), f"the {name} of {who.phrase} is not stated.")
    return Label(index, names)

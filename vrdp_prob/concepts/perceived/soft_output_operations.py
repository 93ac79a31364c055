"""Soft forms of the operations that end a program."""

import torch

from vrdp_prob.concepts.perceived.soft_forms import SoftRun, either, normalised, soft_form_of
from vrdp_prob.concepts.perceived.soft_values import (
    SoftCount,
    SoftEventRef,
    SoftEventSet,
    SoftLabel,
    SoftObjectRef,
    SoftObjectSet,
    SoftTruth,
)
from vrdp_prob.reasoning import output_operations
from vrdp_prob.reasoning.facts import NOT_STATED


@soft_form_of(output_operations.count)
def count(run: SoftRun, chosen: SoftObjectSet | SoftEventSet) -> SoftCount:
    """How many there are, on average."""
    del run
    return SoftCount(chosen.probability.sum())


@soft_form_of(output_operations.exist)
def exist(run: SoftRun, chosen: SoftObjectSet | SoftEventSet) -> SoftTruth:
    """Whether there is any."""
    del run
    return SoftTruth(either(chosen.probability))


@soft_form_of(output_operations.negate)
def negate(run: SoftRun, statement: SoftTruth) -> SoftTruth:
    """The opposite."""
    del run
    return SoftTruth(1 - statement.probability)


@soft_form_of(output_operations.event_belongs)
def event_belongs(run: SoftRun, event: SoftEventRef, chosen: SoftEventSet) -> SoftTruth:
    """Whether an event is among others; one that does not happen is not."""
    ordinary = (run.facts.events.takes_part.sum(dim=1) > 0).double()
    return SoftTruth(event.present * (event.probability * ordinary) @ chosen.probability)


@soft_form_of(output_operations.object_belongs)
def object_belongs(run: SoftRun, who: SoftObjectRef, chosen: SoftEventSet) -> SoftTruth:
    """Whether an object takes part in any of the events."""
    return SoftTruth(who.probability @ either((chosen.probability[:, None] * run.facts.events.takes_part).T))


@soft_form_of(output_operations.query_color)
def query_color(run: SoftRun, who: SoftObjectRef) -> SoftLabel:
    """Its colour."""
    return _attribute(run, who, "color")


@soft_form_of(output_operations.query_material)
def query_material(run: SoftRun, who: SoftObjectRef) -> SoftLabel:
    """Its material."""
    return _attribute(run, who, "material")


@soft_form_of(output_operations.query_shape)
def query_shape(run: SoftRun, who: SoftObjectRef) -> SoftLabel:
    """Its shape."""
    return _attribute(run, who, "shape")


def _attribute(run: SoftRun, who: SoftObjectRef, name: str) -> SoftLabel:
    names = run.facts.values[name]
    shares = who.probability @ run.facts.attributes[name]
    stated = torch.tensor([float(value != NOT_STATED) for value in names], dtype=shares.dtype)
    run.require((shares * stated).sum())
    return SoftLabel(normalised(shares * stated), names)

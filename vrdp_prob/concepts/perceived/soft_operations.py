"""The soft forms of the operations of descriptive and explanatory questions."""

from collections.abc import Mapping

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from vrdp_prob.concepts.perceived.soft_forms import SoftRun, either, normalised, only, soft_form_of
from vrdp_prob.concepts.perceived.soft_values import (
    SoftCount,
    SoftEventRef,
    SoftEventSet,
    SoftLabel,
    SoftMoment,
    SoftObjectRef,
    SoftObjectSet,
    SoftTruth,
)
from vrdp_prob.reasoning import event_operations, object_operations, output_operations
from vrdp_prob.reasoning.events import EventUniverse
from vrdp_prob.reasoning.facts import NOT_STATED
from vrdp_prob.reasoning.values import Word

_PLACES: Mapping[str, int] = {"first": 0, "second": 1, "third": 2}


@soft_form_of(object_operations.objects)
def objects(run: SoftRun) -> SoftObjectSet:
    """All objects of the video."""
    return SoftObjectSet(torch.ones(run.facts.bodies, dtype=torch.double))


@soft_form_of(object_operations.filter_color)
def filter_color(run: SoftRun, chosen: SoftObjectSet, color: Word) -> SoftObjectSet:
    """Product with the probability of the colour."""
    return _with_attribute(run, chosen, "color", color)


@soft_form_of(object_operations.filter_material)
def filter_material(run: SoftRun, chosen: SoftObjectSet, material: Word) -> SoftObjectSet:
    """Product with the probability of the material."""
    return _with_attribute(run, chosen, "material", material)


@soft_form_of(object_operations.filter_shape)
def filter_shape(run: SoftRun, chosen: SoftObjectSet, shape: Word) -> SoftObjectSet:
    """Product with the probability of the shape."""
    return _with_attribute(run, chosen, "shape", shape)


@soft_form_of(object_operations.filter_moving)
def filter_moving(run: SoftRun, chosen: SoftObjectSet, moment: SoftMoment) -> SoftObjectSet:
    """Product with the probability to move at that moment."""
    return SoftObjectSet(chosen.probability * _at(run, moment, run.facts.motion.moving))


@soft_form_of(object_operations.filter_stationary)
def filter_stationary(run: SoftRun, chosen: SoftObjectSet, moment: SoftMoment) -> SoftObjectSet:
    """Product with the probability to be in view and not to move at that moment."""
    motion = run.facts.motion
    return SoftObjectSet(chosen.probability * _at(run, moment, motion.in_view - motion.moving))


@soft_form_of(object_operations.filter_ever_moving)
def filter_ever_moving(run: SoftRun, chosen: SoftObjectSet, any_frame: Word) -> SoftObjectSet:
    """Product with the highest probability to move in any frame: neighbouring frames are no independent looks."""
    del any_frame
    return SoftObjectSet(chosen.probability * run.facts.motion.moving.amax(dim=0))


@soft_form_of(object_operations.filter_never_moving)
def filter_never_moving(run: SoftRun, chosen: SoftObjectSet, any_frame: Word) -> SoftObjectSet:
    """Product with the probability to be in view at some time and to move at none."""
    del any_frame
    motion = run.facts.motion
    return SoftObjectSet(chosen.probability * motion.in_view.amax(dim=0) * (1 - motion.moving.amax(dim=0)))


@soft_form_of(object_operations.unique)
def unique_object(run: SoftRun, chosen: SoftObjectSet) -> SoftObjectRef:
    """The only object, given that there is exactly one: a softmax over the log odds to be in the set."""
    alone = only(chosen.probability)
    run.require(alone.sum())
    return SoftObjectRef(normalised(alone))


@soft_form_of(event_operations.events)
def events(run: SoftRun) -> SoftEventSet:
    """What happens in the video, its start and end among it."""
    return SoftEventSet(run.facts.events.happens, run.facts.events.time)


@soft_form_of(event_operations.all_events)
def all_events(run: SoftRun) -> SoftEventSet:
    """One possible collision of each pair, without a time."""
    universe = _universe(run)
    mask = torch.from_numpy(universe.mask(universe.collisions)).double()
    return SoftEventSet(mask, torch.full_like(mask, torch.nan))


@soft_form_of(event_operations.start)
def start(run: SoftRun) -> SoftEventRef:
    """The start of the video."""
    return _certain(run, _universe(run).start)


@soft_form_of(event_operations.end)
def end(run: SoftRun) -> SoftEventRef:
    """The end of the video."""
    return _certain(run, _universe(run).end)


@soft_form_of(event_operations.filter_start)
def filter_start(run: SoftRun, chosen: SoftEventSet) -> SoftEventRef:
    """The start event of a list of events."""
    run.require(chosen.probability[_universe(run).start])
    return _certain(run, _universe(run).start)


@soft_form_of(event_operations.filter_end)
def filter_end(run: SoftRun, chosen: SoftEventSet) -> SoftEventRef:
    """The end event of a list of events."""
    run.require(chosen.probability[_universe(run).end])
    return _certain(run, _universe(run).end)


@soft_form_of(event_operations.filter_in)
def filter_in(run: SoftRun, chosen: SoftEventSet, who: SoftObjectSet | SoftObjectRef) -> SoftEventSet:
    """The entrances of the objects."""
    return _of_kind(run, chosen, who, _universe(run).entrances)


@soft_form_of(event_operations.filter_out)
def filter_out(run: SoftRun, chosen: SoftEventSet, who: SoftObjectSet | SoftObjectRef) -> SoftEventSet:
    """The exits of the objects."""
    return _of_kind(run, chosen, who, _universe(run).exits)


@soft_form_of(event_operations.filter_collision)
def filter_collision(run: SoftRun, chosen: SoftEventSet, who: SoftObjectSet | SoftObjectRef) -> SoftEventSet:
    """The collisions in which any of the objects takes part."""
    return _of_kind(run, chosen, who, _universe(run).collisions)


@soft_form_of(event_operations.filter_before)
def filter_before(run: SoftRun, chosen: SoftEventSet, event: SoftEventRef) -> SoftEventSet:
    """The events before an event."""
    run.require(event.present)
    earlier = (chosen.time[:, None] < event.time[None, :]).double() @ event.probability
    return SoftEventSet(chosen.probability * earlier, chosen.time)


@soft_form_of(event_operations.filter_after)
def filter_after(run: SoftRun, chosen: SoftEventSet, event: SoftEventRef) -> SoftEventSet:
    """The events after an event."""
    run.require(event.present)
    later = (chosen.time[:, None] > event.time[None, :]).double() @ event.probability
    return SoftEventSet(chosen.probability * later, chosen.time)


@soft_form_of(event_operations.filter_order)
def filter_order(run: SoftRun, chosen: SoftEventSet, order: Word) -> SoftEventRef:
    """The first, second, third or last: an event happens, and so many of those before (after) it do."""
    del run
    times = torch.nan_to_num(chosen.time, nan=torch.inf)
    ranked = torch.argsort(times, stable=True)
    if order.text == "last":
        ranked = ranked.flip(0)
    weights = _so_many_before(chosen.probability[ranked], _PLACES.get(order.text, 0))
    weight = torch.zeros_like(weights).index_put((ranked,), weights)
    return SoftEventRef(normalised(weight), weight.sum(), chosen.time)


@soft_form_of(event_operations.filter_ancestor)
def filter_ancestor(run: SoftRun, chosen: SoftEventSet, event: SoftEventRef) -> SoftEventSet:
    """The events that lie on the way back from an event, object by object, to the previous event."""
    run.require(event.present)
    return SoftEventSet(chosen.probability * (event.probability @ run.facts.events.ancestors), chosen.time)


@soft_form_of(event_operations.unique)
def unique_event(run: SoftRun, chosen: SoftEventSet) -> SoftEventRef:
    """The only event, given that there is one at most."""
    alone, none = only(chosen.probability), (1 - chosen.probability).prod()
    fitting = alone.sum() + none
    run.require(fitting)
    present = alone.sum() / fitting.clamp_min(torch.finfo(fitting.dtype).tiny)
    return SoftEventRef(normalised(alone), present, chosen.time)


@soft_form_of(event_operations.get_frame)
def get_frame(run: SoftRun, event: SoftEventRef) -> SoftMoment:
    """The frame of an event."""
    run.require(event.present)
    return SoftMoment(event.probability, event.time)


@soft_form_of(event_operations.get_object)
def get_object(run: SoftRun, event: SoftEventRef) -> SoftObjectRef:
    """The object that enters or leaves."""
    run.require(event.present)
    takes_part = _takes_part(run)
    single = takes_part * (takes_part.sum(dim=1, keepdim=True) == 1)
    weight = event.probability @ single
    run.require(weight.sum())
    return SoftObjectRef(normalised(weight))


@soft_form_of(event_operations.get_col_partner)
def get_col_partner(run: SoftRun, event: SoftEventRef, who: SoftObjectRef) -> SoftObjectRef:
    """The other object of a collision."""
    run.require(event.present)
    takes_part = _takes_part(run)
    both = takes_part * (takes_part.sum(dim=1, keepdim=True) == 2)
    own = both * who.probability
    others = own.sum(dim=1, keepdim=True) * both - own
    weight = event.probability @ others
    run.require(weight.sum())
    return SoftObjectRef(normalised(weight))


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
    ordinary = (_takes_part(run).sum(dim=1) > 0).double()
    return SoftTruth(event.present * (event.probability * ordinary) @ chosen.probability)


@soft_form_of(output_operations.object_belongs)
def object_belongs(run: SoftRun, who: SoftObjectRef, chosen: SoftEventSet) -> SoftTruth:
    """Whether an object takes part in any of the events."""
    return SoftTruth(who.probability @ either((chosen.probability[:, None] * _takes_part(run)).T))


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


def _universe(run: SoftRun) -> EventUniverse:
    return run.facts.events.universe


def _takes_part(run: SoftRun) -> Float[Tensor, "event body"]:
    return torch.from_numpy(_universe(run).takes_part.astype(np.float64))


def _with_attribute(run: SoftRun, chosen: SoftObjectSet, name: str, word: Word) -> SoftObjectSet:
    return SoftObjectSet(chosen.probability * run.facts.attribute(name, word.text))


def _at(run: SoftRun, moment: SoftMoment, table: Float[Tensor, "frame body"]) -> Float[Tensor, "body"]:
    """What a table says at a moment that is not known for sure."""
    return moment.probability @ table[run.facts.motion.frames(moment.time)]


def _certain(run: SoftRun, place: int) -> SoftEventRef:
    table = run.facts.events
    probability = torch.zeros_like(table.happens).index_fill(0, torch.tensor(place), 1.0)
    return SoftEventRef(probability, torch.ones((), dtype=torch.double), table.time)


def _of_kind(run: SoftRun, chosen: SoftEventSet, who: SoftObjectSet | SoftObjectRef, part: slice) -> SoftEventSet:
    members = who.probability * _takes_part(run)
    involved = either(members) if isinstance(who, SoftObjectSet) else members.sum(dim=1)
    kind = torch.from_numpy(_universe(run).mask(part)).double()
    return SoftEventSet(chosen.probability * kind * involved, chosen.time)


def _so_many_before(probability: Float[Tensor, "event"], number: int) -> Float[Tensor, "event"]:
    """Probability of each event to happen, with exactly so many of those before it in the list."""
    before = torch.zeros(number + 1, dtype=probability.dtype).index_fill(0, torch.tensor(0), 1.0)
    weights = []
    for share in probability:
        weights.append(share * before[number])
        shifted = torch.cat([torch.zeros(1, dtype=before.dtype), before[:-1]])
        before = before * (1 - share) + shifted * share
    return torch.stack(weights)


def _attribute(run: SoftRun, who: SoftObjectRef, name: str) -> SoftLabel:
    names = run.facts.values[name]
    shares = who.probability @ run.facts.attributes[name]
    stated = torch.tensor([float(value != NOT_STATED) for value in names], dtype=shares.dtype)
    run.require((shares * stated).sum())
    return SoftLabel(normalised(shares * stated), names)

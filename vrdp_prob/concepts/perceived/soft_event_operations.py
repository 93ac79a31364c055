"""Soft forms of the operations on events."""

from collections.abc import Mapping
from dataclasses import replace

import torch
from jaxtyping import Float
from torch import Tensor

from vrdp_prob.concepts.perceived.soft_forms import SoftRun, either, normalised, only, soft_form_of
from vrdp_prob.concepts.perceived.soft_values import (
    SoftEventRef,
    SoftEventSet,
    SoftMoment,
    SoftObjectRef,
    SoftObjectSet,
)
from vrdp_prob.reasoning import event_operations
from vrdp_prob.reasoning.events import EventUniverse
from vrdp_prob.reasoning.values import Word

_PLACES: Mapping[str, int] = {"first": 0, "second": 1, "third": 2}


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
    """The collisions of any of the objects; of collisions of others, those of them with any of the objects."""
    if not chosen.parties:
        return replace(_of_kind(run, chosen, who, _universe(run).collisions), parties=(who,))
    first, *others = chosen.parties
    meeting = torch.stack([_meeting(run, party, who) for party in (first, *others)]).prod(dim=0)
    known = torch.ones_like(meeting) if others else _involved(run, first)  # what `chosen` holds of it already
    share = meeting / known.clamp_min(torch.finfo(known.dtype).tiny)
    return replace(chosen, probability=chosen.probability * share, parties=(*chosen.parties, who))


@soft_form_of(event_operations.filter_before)
def filter_before(run: SoftRun, chosen: SoftEventSet, event: SoftEventRef) -> SoftEventSet:
    """The events before an event."""
    run.require(event.present)
    earlier = (chosen.time[:, None] < event.time[None, :]).double() @ event.probability
    return replace(chosen, probability=chosen.probability * earlier)


@soft_form_of(event_operations.filter_after)
def filter_after(run: SoftRun, chosen: SoftEventSet, event: SoftEventRef) -> SoftEventSet:
    """The events after an event."""
    run.require(event.present)
    later = (chosen.time[:, None] > event.time[None, :]).double() @ event.probability
    return replace(chosen, probability=chosen.probability * later)


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
    reached = event.probability @ run.facts.events.ancestors
    return replace(chosen, probability=chosen.probability * reached)


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
    takes_part = run.facts.events.takes_part
    single = takes_part * (takes_part.sum(dim=1, keepdim=True) == 1)
    weight = event.probability @ single
    run.require(weight.sum())
    return SoftObjectRef(normalised(weight))


@soft_form_of(event_operations.get_col_partner)
def get_col_partner(run: SoftRun, event: SoftEventRef, who: SoftObjectRef) -> SoftObjectRef:
    """The other object of a collision."""
    run.require(event.present)
    takes_part = run.facts.events.takes_part
    both = takes_part * (takes_part.sum(dim=1, keepdim=True) == 2)
    own = both * who.probability
    others = own.sum(dim=1, keepdim=True) * both - own
    weight = event.probability @ others
    run.require(weight.sum())
    return SoftObjectRef(normalised(weight))


def _certain(run: SoftRun, place: int) -> SoftEventRef:
    table = run.facts.events
    probability = torch.zeros_like(table.happens).index_fill(0, torch.tensor(place), 1.0)
    return SoftEventRef(probability, torch.ones((), dtype=torch.double), table.time)


def _of_kind(run: SoftRun, chosen: SoftEventSet, who: SoftObjectSet | SoftObjectRef, part: slice) -> SoftEventSet:
    kind = torch.from_numpy(_universe(run).mask(part)).double()
    return replace(chosen, probability=chosen.probability * kind * _involved(run, who))


def _involved(run: SoftRun, who: SoftObjectSet | SoftObjectRef) -> Float[Tensor, "event"]:
    """Probability of each event to have any of the objects in it."""
    members = who.probability * run.facts.events.takes_part
    return either(members) if isinstance(who, SoftObjectSet) else members.sum(dim=1)


def _meeting(
    run: SoftRun, one: SoftObjectSet | SoftObjectRef, other: SoftObjectSet | SoftObjectRef
) -> Float[Tensor, "event"]:
    """Probability of each collision to be one of the first objects with one of the others."""
    universe = _universe(run)
    pairs = torch.tensor(universe.pairs).reshape(-1, 2)
    ways = torch.stack(
        [one.probability[pairs[:, side]] * other.probability[pairs[:, 1 - side]] for side in (0, 1)], dim=1
    )
    if isinstance(one, SoftObjectSet) and isinstance(other, SoftObjectSet):
        met = either(ways)
    elif isinstance(one, SoftObjectRef) and isinstance(other, SoftObjectRef):
        different = 1 - one.probability @ other.probability
        run.require(different)
        met = ways.sum(dim=1) / different.clamp_min(torch.finfo(different.dtype).tiny)
    else:
        met = ways.sum(dim=1)
    everything = torch.zeros(universe.size, dtype=met.dtype)
    everything[universe.collisions] = met
    return everything


def _so_many_before(probability: Float[Tensor, "event"], number: int) -> Float[Tensor, "event"]:
    """Probability of each event to happen, with exactly so many of those before it in the list."""
    before = torch.zeros(number + 1, dtype=probability.dtype).index_fill(0, torch.tensor(0), 1.0)
    weights = []
    for share in probability:
        weights.append(share * before[number])
        shifted = torch.cat([torch.zeros(1, dtype=before.dtype), before[:-1]])
        before = before * (1 - share) + shifted * share
    return torch.stack(weights)


def _universe(run: SoftRun) -> EventUniverse:
    return run.facts.events.universe

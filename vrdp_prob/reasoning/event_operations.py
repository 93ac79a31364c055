"""Operations on events: the worlds' event lists, filters by kind, object, order and cause, and what an event tells."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.changes import Change
from vrdp_prob.reasoning.events import EventTable, EventUniverse
from vrdp_prob.reasoning.operations import operation
from vrdp_prob.reasoning.run import Run
from vrdp_prob.reasoning.tokens import ORDERS
from vrdp_prob.reasoning.values import EventRef, EventSet, Moment, ObjectRef, ObjectSet, Word, noun_phrase

FUTURE = "future"
_PLACES = {"first": 0, "second": 1, "third": 2}


@operation("events", gives=EventSet)
def events(run: Run) -> EventSet:
    """What happens in the video, its start and end among it."""
    table = run.facts.events()
    return EventSet(table.happens, table.time)


@operation("unseen_events", gives=EventSet)
def unseen_events(run: Run) -> EventSet:
    """What happens after the video."""
    run.looked_at.add(FUTURE)
    table = run.facts.unseen_events()
    return EventSet(table.happens, table.time, follows_video=True)


@operation("all_events", gives=EventSet)
def all_events(run: Run) -> EventSet:
    """One possible collision of each pair, without a time."""
    universe = _universe(run)
    mask = np.broadcast_to(universe.mask(universe.collisions), (run.facts.draws, universe.size)).copy()
    return EventSet(mask, np.full(mask.shape, np.nan))


@operation("start", gives=EventRef)
def start(run: Run) -> EventRef:
    """The start of the video."""
    return _always(run, _universe(run).start, "start of the video")


@operation("end", gives=EventRef)
def end(run: Run) -> EventRef:
    """The end of the video."""
    return _always(run, _universe(run).end, "end of the video")


@operation("filter_start", EventSet, gives=EventRef)
def filter_start(run: Run, chosen: EventSet) -> EventRef:
    """The start event of a list of events."""
    return _only(run, chosen, _universe(run).start, "start of the video")


@operation("filter_end", EventSet, gives=EventRef)
def filter_end(run: Run, chosen: EventSet) -> EventRef:
    """The end event of a list of events."""
    return _only(run, chosen, _universe(run).end, "end of the video")


@operation("filter_in", EventSet, (ObjectSet, ObjectRef), gives=EventSet)
def filter_in(run: Run, chosen: EventSet, who: ObjectSet | ObjectRef) -> EventSet:
    """The entrances of the objects."""
    return _crossings(run, chosen, who, "entrance", _universe(run).entrances)


@operation("filter_out", EventSet, (ObjectSet, ObjectRef), gives=EventSet)
def filter_out(run: Run, chosen: EventSet, who: ObjectSet | ObjectRef) -> EventSet:
    """The exits of the objects."""
    return _crossings(run, chosen, who, "exit", _universe(run).exits)


@operation("filter_collision", EventSet, (ObjectSet, ObjectRef), gives=EventSet)
def filter_collision(run: Run, chosen: EventSet, who: ObjectSet | ObjectRef) -> EventSet:
    """The collisions of any of the objects; of collisions of others, those of them with any of the objects."""
    universe = _universe(run)
    first, second = _colliding(run, who)
    fits = first | second
    for party in chosen.parties:
        _require_two(run, party, who)
        one, other = _colliding(run, party)
        fits &= (first & other) | (second & one)
    mask = chosen.mask & universe.mask(universe.collisions)
    mask[:, universe.collisions] &= fits
    name = noun_phrase(who.words)
    phrase = f"{chosen.phrase} with the {name}" if chosen.parties else f"collision of the {name}"
    return replace(chosen, mask=mask, phrase=phrase, parties=(*chosen.parties, who))


@operation("filter_before", EventSet, EventRef, gives=EventSet)
def filter_before(run: Run, chosen: EventSet, event: EventRef) -> EventSet:
    """The events before an event."""
    _require_present(run, event)
    earlier = chosen.mask & (chosen.time < event.time[:, None])
    return replace(chosen, mask=earlier, phrase=f"{chosen.phrase} before it")


@operation("filter_after", EventSet, EventRef, gives=EventSet)
def filter_after(run: Run, chosen: EventSet, event: EventRef) -> EventSet:
    """The events after an event."""
    _require_present(run, event)
    later = chosen.mask & (chosen.time > event.time[:, None])
    return replace(chosen, mask=later, phrase=f"{chosen.phrase} after it")


@operation("filter_order", EventSet, Word, gives=EventRef, words=ORDERS)
def filter_order(run: Run, chosen: EventSet, order: Word) -> EventRef:
    """The first, second, third or last of the events."""
    times = np.where(chosen.mask, chosen.time, np.inf)
    ranked = np.argsort(times, axis=1, kind="stable")
    count = chosen.mask.sum(axis=1)
    place = np.maximum(count - 1, 0) if order.text == "last" else np.full(len(count), _PLACES[order.text])
    present = count > place
    index = np.take_along_axis(ranked, np.minimum(place, times.shape[1] - 1)[:, None], axis=1)[:, 0]
    return _ref(chosen, index, present, f"{order.text} {chosen.phrase}")


@operation("filter_ancestor", EventSet, EventRef, gives=EventSet)
def filter_ancestor(run: Run, chosen: EventSet, event: EventRef) -> EventSet:
    """The events that lie on the way back from an event, object by object, to the previous event."""
    _require_present(run, event)
    reached = run.facts.events().ancestors()[np.arange(run.facts.draws), event.index]
    return replace(chosen, mask=chosen.mask & reached, phrase=f"cause of the {event.phrase}")


@operation("unique", EventSet, gives=EventRef)
def unique(run: Run, chosen: EventSet) -> EventRef:
    """The only event of a set; draws in which two events fit leave the question."""
    count = chosen.mask.sum(axis=1)
    several = f"several events fit 'the {chosen.phrase}'"
    run.require(count <= 1, f"{several}; say which by naming the objects.", [(count > 1, several)])
    return _ref(chosen, chosen.mask.argmax(axis=1), count == 1, chosen.phrase)


@operation("get_frame", EventRef, gives=Moment)
def get_frame(run: Run, event: EventRef) -> Moment:
    """The frame of an event."""
    _require_present(run, event)
    return Moment(event.time)


@operation("get_object", EventRef, gives=ObjectRef)
def get_object(run: Run, event: EventRef) -> ObjectRef:
    """The object that enters or leaves."""
    _require_present(run, event)
    takes_part = _universe(run).takes_part[event.index]
    run.require(takes_part.sum(axis=1) == 1, f"the {event.phrase} is no entrance or exit of one object.")
    return ObjectRef(takes_part.argmax(axis=1))


@operation("get_col_partner", EventRef, ObjectRef, gives=ObjectRef)
def get_col_partner(run: Run, event: EventRef, who: ObjectRef) -> ObjectRef:
    """The other object of a collision."""
    _require_present(run, event)
    takes_part = _universe(run).takes_part[event.index].copy()
    draws = np.arange(run.facts.draws)
    fits = (takes_part.sum(axis=1) == 2) & takes_part[draws, who.index]
    run.require(fits, f"the {event.phrase} is no collision of {who.phrase}.")
    takes_part[draws, who.index] = False
    return ObjectRef(takes_part.argmax(axis=1))


@operation("get_counterfact", EventSet, ObjectRef, gives=EventSet)
def get_counterfact(run: Run, chosen: EventSet, who: ObjectRef) -> EventSet:
    """Those of the events that happen with the object removed, or changed as `apply_*` says."""
    return changed_events(run, chosen, who, who.change or Change.REMOVED)


@operation("get_counterfact", ObjectRef, gives=EventSet)
def counterfactual_events(run: Run, who: ObjectRef) -> EventSet:
    """What happens with the object removed, or changed as `apply_*` says."""
    return changed_events(run, None, who, who.change or Change.REMOVED)


def changed_events(run: Run, chosen: EventSet | None, who: ObjectRef, change: Change) -> EventSet:
    """Those of the events (without events: all) that happen with a change of one object.

    Raises
    ------
    InputError
        If the events are of the time after the video, which no change is simulated for.
    """
    if chosen is not None and chosen.follows_video:
        raise InputError(
            f"what happens after the video is not known with {who.phrase} {change}, only what happens in the video; "
            "take all_events or events instead of unseen_events."
        )
    universe = _universe(run)
    happens = np.zeros((run.facts.draws, universe.size), dtype=bool)
    time = np.full(happens.shape, np.nan)
    for body in np.unique(who.index[run.valid]).tolist():
        run.looked_at.add((change, body))
        table: EventTable = run.facts.counterfactual_events(change, body)
        draws = who.index == body
        happens[draws], time[draws] = table.happens[draws], table.time[draws]
    phrase = f"event with {who.phrase} {change}"
    if chosen is None:
        return EventSet(happens, time, phrase)
    return EventSet(happens & chosen.mask, time, phrase, chosen.parties)


def _universe(run: Run) -> EventUniverse:
    return run.facts.events().universe


def _ref(chosen: EventSet, index: np.ndarray, present: Bool[np.ndarray, "draw"], phrase: str) -> EventRef:
    time = np.take_along_axis(chosen.time, index[:, None], axis=1)[:, 0]
    return EventRef(index, present, time, phrase)


def _always(run: Run, place: int, phrase: str) -> EventRef:
    table = run.facts.events()
    return EventRef(np.full(run.facts.draws, place), np.ones(run.facts.draws, dtype=bool), table.time[:, place], phrase)


def _only(run: Run, chosen: EventSet, place: int, phrase: str) -> EventRef:
    run.require(chosen.mask[:, place], f"the events do not hold the {phrase}.")
    return _always(run, place, phrase)


def _members(run: Run, who: ObjectSet | ObjectRef) -> Bool[np.ndarray, "draw body"]:
    if isinstance(who, ObjectSet):
        return who.mask
    return np.arange(len(run.facts.bodies)) == who.index[:, None]


def _colliding(
    run: Run, who: ObjectSet | ObjectRef
) -> tuple[Bool[np.ndarray, "draw pair"], Bool[np.ndarray, "draw pair"]]:
    """Whether the first, and whether the second body of each pair is one of the objects."""
    members, pairs = _members(run, who), np.array(_universe(run).pairs, dtype=np.int64).reshape(-1, 2)
    return members[:, pairs[:, 0]], members[:, pairs[:, 1]]


def _crossings(run: Run, chosen: EventSet, who: ObjectSet | ObjectRef, name: str, part: slice) -> EventSet:
    mask = chosen.mask & _universe(run).mask(part)
    mask[:, part] &= _members(run, who)
    return replace(chosen, mask=mask, phrase=f"{name} of the {noun_phrase(who.words)}")


def _require_two(run: Run, first: ObjectSet | ObjectRef, second: ObjectSet | ObjectRef) -> None:
    """Draws in which two names are of one object leave the question."""
    if isinstance(first, ObjectRef) and isinstance(second, ObjectRef):
        same = first.index == second.index
        named_twice = first.phrase == second.phrase
        clause = f"{first.phrase} {'is named twice' if named_twice else f'and {second.phrase} are the same object'}"
        run.require(~same, f"{clause}, and an object cannot collide with itself; name two objects.", [(same, clause)])


def _require_present(run: Run, event: EventRef) -> None:
    run.require(event.present, f"there is no {event.phrase} in the video.")

"""Rules for the parts that questions and choices share: objects, events, times, conditions."""

from dataclasses import dataclass

from vrdp_prob.reasoning.language.reader import NoReadingError, Reader
from vrdp_prob.reasoning.language.words import COLOR_WORDS, MATERIAL_WORDS, NOUNS, ORDER_WORDS, PLURALS, STATES

Tokens = tuple[str, ...]

ENTER = ("enters", "enter", "entering", "entered")
EXIT = ("exits", "exit", "exiting", "exited", "leaves", "leave", "leaving", "left")
COLLIDE = ("collides with", "collide with", "colliding with", "collided with", "hits", "hit", "hitting")
SCENE = ("the scene", "the video", "the picture", "the view")


@dataclass(frozen=True)
class NounPhrase:
    """'the last moving red metal cube' without its relative clause.

    Parameters
    ----------
    filters
        Tokens that pick the objects from all: `('objects', 'red', 'filter_color', ...)`.
    plural
        Whether the noun is plural.
    order
        `first`, `second`, `third` or `last`, where stated.
    state
        `filter_moving` or `filter_stationary`, where stated.
    """

    filters: Tokens
    plural: bool
    order: str | None = None
    state: str | None = None

    @property
    def is_plain(self) -> bool:
        """Whether it only says what the object looks like."""
        return self.order is None and self.state is None


def noun_phrase(reader: Reader) -> NounPhrase:
    """Modifiers in any order and a noun; each kind of modifier at most once."""
    order = reader.maybe(lambda: reader.one_of(ORDER_WORDS))
    found: dict[str, str] = {}
    tables = {"filter_color": COLOR_WORDS, "filter_material": MATERIAL_WORDS, "state": STATES}
    while True:
        for kind, table in tables.items():
            if kind not in found and reader.next in table:
                found[kind] = reader.one_of(table)
                break
        else:
            break
    plural = reader.next in PLURALS
    shape = reader.one_of(PLURALS if plural else NOUNS)
    if shape is not None:
        found["filter_shape"] = shape
    filters: list[str] = ["objects"]
    for token in ("filter_color", "filter_material", "filter_shape"):
        if token in found:
            filters += [found[token], token]
    return NounPhrase(tuple(filters), plural, order, found.get("state"))


def plain_noun(reader: Reader, *, plural: bool | None = None) -> Tokens:
    """Filters of a noun phrase that only says what the object looks like."""
    phrase = noun_phrase(reader)
    if not phrase.is_plain or (plural is not None and phrase.plural != plural):
        raise NoReadingError
    return phrase.filters


def the_object(reader: Reader) -> Tokens:
    """'the red cube': the only object that fits."""
    reader.expect("the")
    return (*plain_noun(reader, plural=False), "unique")


def the_event(reader: Reader) -> Tokens:
    """One event, as a noun ('the collision between A and B', 'A's exit') or as a clause ('A enters the scene')."""
    return reader.first(
        lambda: _collision_noun(reader),
        lambda: _ordered_collision(reader),
        lambda: _object_event(reader),
    )


def moment(reader: Reader) -> Tokens:
    """'when the video begins', 'at the end of the video', 'when A enters the scene': a frame."""
    if reader.accept("when the video begins", "when the video starts"):
        return ("start", "get_frame")
    if reader.accept("at the beginning of the video", "at the start of the video", "at the beginning", "at the start"):
        return ("start", "get_frame")
    if reader.accept("when the video ends", "at the end of the video", "at the end"):
        return ("end", "get_frame")
    reader.expect("when", "during")
    return (*the_event(reader), "get_frame")


def moment_or_ever(reader: Reader) -> Tokens:
    """A frame, or at any time where none is stated."""
    in_the_video(reader)
    return reader.maybe(lambda: moment(reader)) or ("null",)


def condition(reader: Reader) -> Tokens:
    """'before A enters the scene', 'after A and B collide', or nothing."""
    in_the_video(reader)
    if reader.accept("before"):
        return (*the_event(reader), "filter_before")
    if reader.accept("after"):
        return (*the_event(reader), "filter_after")
    return ()


def crossing(reader: Reader) -> str:
    """'enters the scene' or 'exits the scene', in any form of the verb."""
    if reader.accept(*ENTER):
        reader.accept(*SCENE)
        return "filter_in"
    reader.expect(*EXIT)
    reader.accept(*SCENE)
    return "filter_out"


def in_the_video(reader: Reader) -> None:
    """'in the video', which changes nothing."""
    reader.accept("in the video", "in the scene", "in total")


def collision(first: Tokens, second: Tokens, source: str) -> Tokens:
    """The collision of two objects among the events of a source."""
    return (source, *first, "filter_collision", *second, "filter_collision", "unique")


def _collision_noun(reader: Reader) -> Tokens:
    reader.expect("the collision between", "the collision of")
    first = the_object(reader)
    reader.expect("and", "with")
    return collision(first, the_object(reader), "events")


def _ordered_collision(reader: Reader) -> Tokens:
    reader.expect("the")
    order = reader.one_of(ORDER_WORDS)
    reader.expect("collision")
    return ("events", "objects", "filter_collision", order, "filter_order")


def _object_event(reader: Reader) -> Tokens:
    first = the_object(reader)
    if reader.accept("and"):
        second = the_object(reader)
        reader.expect("collide", "collided", "colliding")
        return collision(first, second, "events")
    possessive = reader.accept("'s")
    if possessive and reader.accept("collision with"):
        return collision(first, the_object(reader), "events")
    if reader.accept(*COLLIDE):
        return collision(first, the_object(reader), "events")
    if possessive and reader.accept("entrance", "entry"):
        return ("events", *first, "filter_in", "unique")
    return ("events", *first, crossing(reader), "unique")

"""Meanings: what questions and choices can say, as trees that have both a program and words.

A kind of phrase ('moment', 'event', 'question') has productions; a production is a piece of a program with slots for
other kinds. Every program that the grammar gives has exactly one tree, and a tree has exactly one program. The words
are in `wordings/*.toml`, see `wording.py`.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from vrdp_prob.reasoning.tokens import ANY_FRAME, ORDERS, SHAPES
from vrdp_prob.scene.body import COLORS, MATERIALS

Tokens = tuple[str, ...]

ANY = "any"
"""The production of an attribute, a condition or a choice among several that says nothing."""

_MEETING = "filter_collision {second:object} filter_collision"
_PARTNER = "{chosen} {object} get_col_partner {attribute}"

PRODUCTIONS: Mapping[str, Mapping[str, str]] = {
    "color": {ANY: "", **{color: f"{color} filter_color" for color in COLORS}},
    "material": {ANY: "", **{material: f"{material} filter_material" for material in MATERIALS}},
    "shape": {ANY: "", **{shape: f"{shape} filter_shape" for shape in SHAPES}},
    "things": {"things": "objects {color} {material} {shape}"},
    "object": {"object": "{things} unique"},
    "state": {"moving": "filter_moving", "stationary": "filter_stationary"},
    "crossing": {"in": "filter_in", "out": "filter_out"},
    "attribute": {name: f"query_{name}" for name in ("color", "material", "shape")},
    "chosen": {ANY: "unique", **{order: f"{order} filter_order" for order in ORDERS}},
    "order": {order: f"{order} filter_order" for order in ORDERS},
    "event": {
        "collision": f"events {{first:object}} {_MEETING} unique",
        "ordered": "events objects filter_collision {order}",
        "crossing": "events {object} {crossing} unique",
    },
    "moment": {
        "start": "start get_frame",
        "end": "end get_frame",
        "event": "{event} get_frame",
        ANY: ANY_FRAME,
    },
    "condition": {ANY: "", "before": "{event} filter_before", "after": "{event} filter_after"},
    "change": {
        "removed": "{object} get_counterfact",
        "heavier": "{object} counterfact_heavier",
        "lighter": "{object} counterfact_lighter",
    },
    "question": {
        "number": "{things} count",
        "number_in_state": "{things} {moment} {state} count",
        "number_crossing": "events {things} {crossing} {condition} count",
        "number_meeting": "events {object} filter_collision {things} filter_collision {condition} count",
        "number_of_collisions": "events objects filter_collision {condition} count",
        "any": "{things} exist",
        "any_in_state": "{things} {moment} {state} exist",
        "any_crossing": "events {things} {crossing} {condition} exist",
        "any_meeting": "events {object} filter_collision {things} filter_collision {condition} exist",
        "any_collisions": "events objects filter_collision {condition} exist",
        "crosses": "events {object} {crossing} {condition} exist",
        "meets": f"events {{first:object}} {_MEETING} {{condition}} exist",
        "attribute": "{object} {attribute}",
        "attribute_in_state": "{things} {moment} {state} unique {attribute}",
        "attribute_of_crossing": "events {things} {crossing} {condition} {chosen} get_object {attribute}",
        "attribute_of_partner": f"events {{object}} filter_collision {{condition}} {_PARTNER}",
        "attribute_of_such_partner": (
            f"events {{object}} filter_collision {{things}} filter_collision {{condition}} {_PARTNER}"
        ),
        "responsible": "events {event} filter_ancestor belong_to",
        "not_responsible": "events {event} filter_ancestor belong_to negate",
        "next": "unseen_events belong_to",
        "not_next": "unseen_events belong_to negate",
        "changed": "all_events {change} belong_to",
        "not_changed": "all_events {change} belong_to negate",
        "meets_next": f"all_events {{first:object}} {_MEETING} unique unseen_events belong_to",
        "meets_changed": f"all_events {{first:object}} {_MEETING} unique all_events {{change}} belong_to",
    },
    "choice": {"object": "{object}", "event": "{event}"},
}
"""What each kind of phrase can be: programs with slots `{kind}`, or `{name:kind}` where a kind occurs twice."""

SILENT = 0.35
"""Share of drawn phrases that leave out what they may leave out."""

_SLOT = re.compile(r"\{(?:(\w+):)?(\w+)\}")


@dataclass(frozen=True)
class Meaning:
    """One tree.

    Parameters
    ----------
    kind, production
        What it is: a key of `PRODUCTIONS` and of the entry there.
    parts
        The trees in its slots, by name.
    """

    kind: str
    production: str
    parts: Mapping[str, "Meaning"]

    @property
    def program(self) -> Tokens:
        """Its program in postfix order."""
        tokens: list[str] = []
        for literal, slot in _pieces(PRODUCTIONS[self.kind][self.production]):
            tokens += self.parts[slot].program if slot else literal.split()
        return tuple(tokens)

    def walk(self) -> Iterator["Meaning"]:
        """The tree itself and all trees below it."""
        yield self
        for part in self.parts.values():
            yield from part.walk()


def slots(kind: str, production: str) -> dict[str, str]:
    """Names of the slots of a production, and the kind of phrase that each takes."""
    found = _SLOT.finditer(PRODUCTIONS[kind][production])
    return {match[1] or match[2]: match[2] for match in found}


def draw(kind: str, generator: np.random.Generator, production: str | None = None) -> Meaning:
    """A random tree; what may be left out is left out in `SILENT` of the cases.

    Parameters
    ----------
    kind
        Kind of phrase.
    generator
        Source of randomness.
    production
        Which of its productions; a random one where it is None.
    """
    if production is None:
        names = list(PRODUCTIONS[kind])
        if ANY in names and generator.random() < SILENT:
            production = ANY
        else:
            spoken = [name for name in names if name != ANY]
            production = spoken[int(generator.integers(len(spoken)))]
    parts = {name: draw(slot, generator) for name, slot in slots(kind, production).items()}
    return Meaning(kind, production, parts)


def meaning_of(program: Tokens, kind: str) -> Meaning | None:
    """The tree of a program, None where no tree has it.

    Parameters
    ----------
    program
        Tokens in the data set's spelling.
    kind
        Kind of phrase: `question` or `choice` for a whole text.
    """
    return _read("".join(f"{token} " for token in program), kind)


def _read(text: str, kind: str) -> Meaning | None:
    for production in PRODUCTIONS[kind]:
        match = _reader(kind, production).fullmatch(text)
        if match is None:
            continue
        parts = {name: _read(match[name], slot) for name, slot in slots(kind, production).items()}
        known = {name: part for name, part in parts.items() if part is not None}
        if len(known) == len(parts):
            return Meaning(kind, production, known)
    return None


@cache
def _reader(kind: str, production: str) -> re.Pattern[str]:
    """The production as a pattern of a program in which every token is followed by a space; a group for each slot."""
    kinds, seen, pattern = slots(kind, production), set[str](), ""
    for literal, slot in _pieces(PRODUCTIONS[kind][production]):
        if slot is None:
            pattern += "".join(re.escape(f"{token} ") for token in literal.split())
        elif slot in seen:
            pattern += f"(?P={slot})"
        else:
            pattern += f"(?P<{slot}>{_any_of(kinds[slot])})"
            seen.add(slot)
    return re.compile(pattern)


@cache
def _any_of(kind: str) -> str:
    """A pattern without groups that fits every program of a kind of phrase."""
    alternatives = []
    for production, program in PRODUCTIONS[kind].items():
        kinds = slots(kind, production)
        alternatives.append(
            "".join(
                f"(?:{_any_of(kinds[slot])})" if slot else "".join(re.escape(f"{token} ") for token in literal.split())
                for literal, slot in _pieces(program)
            )
        )
    return "|".join(alternatives)


def _pieces(program: str) -> Iterator[tuple[str, str | None]]:
    """Literal tokens and slots in their order; the second entry is the name of the slot."""
    place = 0
    for match in _SLOT.finditer(program):
        yield program[place : match.start()], None
        yield "", match[1] or match[2]
        place = match.end()
    yield program[place:], None

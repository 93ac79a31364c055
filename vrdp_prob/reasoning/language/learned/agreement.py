"""Whether a reading speaks of what the text speaks of.

A network is sure of too much. These rules look at the words alone: what was read must name the objects and orders that
the text names; none of its parts may be made up; and no word of the text may be passed over, least of all a negation.
The words that belong to a part are those with which the training says it.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from functools import cache
from itertools import pairwise

from vrdp_prob.reasoning.language.meaning import ANY, PRODUCTIONS, Meaning
from vrdp_prob.reasoning.language.wording import wordings
from vrdp_prob.reasoning.language.words import split

Words = tuple[str, ...]
Parts = tuple[Meaning, ...]

_FILES = ("canonical", "training")
_ATTRIBUTES = ("color", "material", "shape")
_ORDERS = ("order", "chosen")

_FRAMES = {"start": "first", "end": "last", "next": "last", "not_next": "last"}
"""Productions that may be said with an order: 'in the first frame', 'after the last frame'."""

_CONTRASTS = ("attribute", "crossing", "condition", "moment", "change")
"""Kinds of phrases whose productions are told apart by single words."""

_UNTOLD = (ANY, "event")
"""Productions that no word of their own tells."""

_NEGATIONS = {f"not_{name}": name for name in ("responsible", "next", "changed")}
"""Questions that a negation turns round."""

_MEETING = ("hits", "hit", "hitting", "touched", "crash", "crashes")
"""Choices of the training's wordings that say that things collide."""

_TOO_COMMON = frozenset(
    "against as did do does for had has in it make makes making of off one part with".split()  # noqa: SIM905 - to read
)
"""Words that tell nothing by themselves."""

_NEGATING = ("not", "no", "never", "nothing", "without")
"""Words that turn round what follows them; 'not' is known with 'there', and yet not with 'removed'."""

_TURNING = (
    *_NEGATING,
    *("absence", "absent", "avoided", "delete", "deleted", "gone", "missing", "prevented", "removal", "remove"),
    *("removed", "removing", "take", "taken", "took"),
)
"""Words of which a removal and a question turned round have one each; 'take place' has none."""

_OPENING = ("after", "assuming", "had", "if", "in", "once", "suppose", "supposing", "were", "with", "without")
"""Words with which a change begins."""

_MEASURED = {
    "five": (("five", "times"),),
    "5": (("5", "times"),),
    "fifth": (("fifth", "as"), ("fifth", "of")),
    "times": (("five", "times"), ("5", "times"), ("many", "times")),
}
"""Words for how much or how often, and the pairs in which they say so."""

_SLOT = "{"
"""How the slots of a template begin."""

_PHRASE = 3
"""Words of a phrase that begins with a negation: 'not take place' is no 'not take away'."""


def agrees(words: Words, meaning: Meaning) -> bool:
    """Whether a text and a meaning name the same things.

    Parameters
    ----------
    words
        The text as `split` cuts it.
    meaning
        What it was read as.
    """
    parts = tuple(meaning.walk())
    rules = (
        *(_same_objects, _same_orders, _nothing_made_up, _collisions_are_told, _collisions_are_counted),
        *(_nothing_passed_over, _negations_are_told, _turned_as_often, _removals_are_not_negated, _measures_are_whole),
    )
    return all(rule(words, parts) for rule in rules)


def stray_negation(words: Words) -> int | None:
    """Place of the first negation with which no wording says anything: 'not' in 'if the cube is not removed'."""
    families = {(kind, _family(kind, name)) for kind, names in PRODUCTIONS.items() for name in names}
    known = frozenset[Words]().union(*(_negations(kind, family) for kind, family in families))
    return next((place for place in _negated_places(words) if not _says_one_of(words, place, known)), None)


def _same_objects(words: Words, parts: Parts) -> bool:
    """The same attributes, as often; those that stand side by side in the text are of one object."""
    objects = [tuple(_named(part)) for part in parts if part.kind == "things"]
    if _said(words, _ATTRIBUTES) != Counter(name for one in objects for name in one):
        return False
    return all(any(run <= set(one) for one in objects) for run in _runs(words))


def _same_orders(words: Words, parts: Parts) -> bool:
    """The same 'first' and 'last', where they are not said of a frame."""
    orders = Counter(part.production for part in parts if part.kind in _ORDERS and part.production != ANY)
    frames = Counter(_FRAMES[part.production] for part in parts if part.production in _FRAMES)
    said = _said(words, _ORDERS)
    return orders <= said <= orders + frames


def _nothing_made_up(words: Words, parts: Parts) -> bool:
    """A word for each part that another could have stood for: one that does not tell the other."""
    for (kind, production), count in Counter((part.kind, part.production) for part in parts).items():
        if kind == "question" and production in _NEGATIONS:
            others: tuple[str, ...] = (_NEGATIONS[production],)
        elif kind in _CONTRASTS and production not in _UNTOLD:
            others = tuple(name for name in PRODUCTIONS[kind] if name not in (*_UNTOLD, production))
        else:
            continue
        telling = _telling_words(kind, production, others)
        if sum(word in telling for word in words) < count:
            return False
    return True


def _collisions_are_told(words: Words, parts: Parts) -> bool:
    """A word for each collision that the reading speaks of."""
    meetings = sum("filter_collision" in PRODUCTIONS[part.kind][part.production] for part in parts)
    return sum(word in _meeting_words() for word in words) >= meetings


def _collisions_are_counted(words: Words, parts: Parts) -> bool:
    """Things are named in the plural only after 'times' or 'often' where their collisions are counted, not they."""
    if not any((part.kind, part.production) == ("question", "number_of_collisions") for part in parts):
        return True
    things = [place for place, word in enumerate(words) if word in _words_of("shape", ANY, ("one",))]
    often = [place for place, word in enumerate(words) if word in ("times", "often")]
    return not things or (bool(often) and min(often) < min(things))


def _negations_are_told(words: Words, parts: Parts) -> bool:
    """Every negation begins a phrase with which some part is said."""
    families = {(part.kind, _family(part.kind, part.production)) for part in parts}
    known = frozenset[Words]().union(*(_negations(kind, family) for kind, family in families))
    return all(_says_one_of(words, place, known) for place in _negated_places(words))


def _turned_as_often(words: Words, parts: Parts) -> bool:
    """One word for each removal and each question turned round, and at most one for a state: 'not moving'."""
    turned = sum(
        (part.kind, part.production) == ("change", "removed")
        or (part.kind == "question" and part.production in _NEGATIONS)
        for part in parts
    )
    said = sum(word in _TURNING and after != "place" for word, after in pairwise((*words, "")))
    return turned <= said <= turned + sum(part.kind == "state" for part in parts)


def _removals_are_not_negated(words: Words, parts: Parts) -> bool:
    """A change begins between a negation and the removal that follows it: not so in 'is not going to be removed'."""
    del parts
    turning = [place for place, word in enumerate(words) if word in _TURNING and words[place + 1 :][:1] != ("place",)]
    return all(
        words[place] not in _NEGATING or not set(_OPENING).isdisjoint(words[place + 1 : after + 1])
        for place, after in pairwise(turning)
    )


def _measures_are_whole(words: Words, parts: Parts) -> bool:
    """Numbers and 'times' stand in pairs that say how much or how often."""
    del parts
    pairs = set(pairwise(words))
    return all(pairs.intersection(_MEASURED[word]) for word in words if word in _MEASURED)


def _nothing_passed_over(words: Words, parts: Parts) -> bool:
    """Every word is one with which some part is said; things in the plural only where they are counted or sought."""
    families = [(part.kind, _family(part.kind, part.production)) for part in parts]
    singular = () if ("question", "number") in families or ("question", ANY) in families else ("several",)
    known = (_words_of_family(kind, family, singular) for kind, family in families)
    return frozenset[str]().union(*known).issuperset(words)


def _said(words: Words, kinds: tuple[str, ...]) -> Counter[str]:
    return Counter(name for word in words if (name := _names(kinds).get(word)))


def _named(things: Meaning) -> Iterator[str]:
    return (part.production for part in things.walk() if part.kind in _ATTRIBUTES and part.production != ANY)


def _runs(words: Words) -> Iterator[frozenset[str]]:
    """Attributes named by words that follow each other, up to the word for a shape."""
    run: list[str] = []
    for word in (*words, ""):
        name = _names(_ATTRIBUTES).get(word)
        if name is not None:
            run.append(name)
        if run and (name is None or word in _names(("shape",))):
            yield frozenset(run)
            run = []


@cache
def _names(kinds: tuple[str, ...]) -> Mapping[str, str]:
    """Which attribute or order a word names."""
    return {
        word: production
        for name in _FILES
        for (kind, _, production), templates in wordings(name).templates.items()
        if kind in kinds and production != ANY
        for template in templates
        for word in split(template)
        if word != "the"
    }


@cache
def _telling_words(kind: str, production: str, others: tuple[str, ...]) -> frozenset[str]:
    """Words that say a production and none of some others."""
    return _words_of(kind, production) - _TOO_COMMON.union(*(_words_of(kind, name) for name in others))


def _negated_places(words: Words) -> Iterator[int]:
    return (place for place, word in enumerate(words) if word in _NEGATING)


def _says_one_of(words: Words, place: int, phrases: frozenset[Words]) -> bool:
    """Whether one of the phrases begins at a place.

    `_SLOT` fits any word and the end; after the negation only a word with which an object begins. Two words have to be
    those of the phrase, and all of them where one of the text's turns round something else.
    """
    if len(words) > place + 1 and words[place + 1] not in _words_of_objects():
        phrases = frozenset(phrase for phrase in phrases if phrase[1] != _SLOT)
    said = (*words[place : place + _PHRASE], *[""] * _PHRASE)[:_PHRASE]
    compared = said[:2] if set(_TURNING).isdisjoint(said[1:]) else said
    return any(
        all(wanted in (_SLOT, word) for word, wanted in zip(compared, phrase, strict=False)) for phrase in phrases
    )


@cache
def _words_of_objects() -> frozenset[str]:
    """'the', colors, materials, nouns."""
    kinds = ("color", "material", "shape")
    return frozenset(("the",)).union(*(_words_of(kind, name) for kind in kinds for name in PRODUCTIONS[kind]))


@cache
def _negations(kind: str, family: str) -> frozenset[Words]:
    """Phrases of `_PHRASE` words, from a negation on, with which productions of a family are said."""
    return frozenset(
        tuple(
            _SLOT if word.startswith(_SLOT) else word for word in (*said, *[_SLOT] * _PHRASE)[place : place + _PHRASE]
        )
        for name in _FILES
        for (owner, _, production), templates in wordings(name).templates.items()
        if (owner, _family(owner, production)) == (kind, family)
        for template in templates
        if not wordings(name).words_of(template).isdisjoint(_NEGATING)
        for said in (tuple(variant.split()) for variant in wordings(name).variants(template))
        for place in _negated_places(said)
    )


@cache
def _meeting_words() -> frozenset[str]:
    """Words that say that things collide, and not that one comes or goes."""
    choices = wordings("training").choices
    said = frozenset(word for name in _MEETING for option in choices[name] for word in split(option))
    return said - _TOO_COMMON.union(*(_words_of("crossing", name) for name in PRODUCTIONS["crossing"]))


@cache
def _words_of(kind: str, production: str, without: tuple[str, ...] = ()) -> frozenset[str]:
    """Words with which a production is said, in all but some forms."""
    return frozenset(
        word
        for name in _FILES
        for (owner, form, named), templates in wordings(name).templates.items()
        if (owner, named) == (kind, production) and form not in without
        for template in templates
        for word in wordings(name).words_of(template)
    )


def _family(kind: str, production: str) -> str:
    """The name under which a production shares its words with others: questions of one sort have phrases in common."""
    if kind != "question" or production in ("meets_next", "meets_changed"):
        return production
    return ANY if production in ("crosses", "meets") else production.split("_", maxsplit=1)[0]


@cache
def _words_of_family(kind: str, family: str, without: tuple[str, ...]) -> frozenset[str]:
    members = (name for name in PRODUCTIONS[kind] if _family(kind, name) == family)
    return frozenset[str]().union(*(_words_of(kind, name, without) for name in members))

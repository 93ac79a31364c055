"""Whether a reading speaks of what the text speaks of.

A network is sure of too much. These rules look at the words alone: what was read must name the objects and orders that
the text names; none of its parts may be made up; and no word of the text may be passed over. The words that belong to
a part are those with which the training says it.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from functools import cache

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
    rules = (_same_objects, _same_orders, _nothing_made_up, _collisions_are_told, _nothing_passed_over)
    return all(rule(words, parts) for rule in rules)


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

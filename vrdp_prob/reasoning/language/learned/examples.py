"""Pairs of texts and programs that the learned parser is trained on.

Texts come from `wordings/training.toml` and from the grammar's own wordings. A text whose template a held-out file has,
or one that differs from it by a word, is thrown away, so that what is held out was never seen. Some texts are
nonsense: templates of their own, and questions that were shuffled, cut short or spliced.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.language.choices import choice_by_grammar
from vrdp_prob.reasoning.language.meaning import Meaning, Tokens, draw, slots
from vrdp_prob.reasoning.language.questions import question_by_grammar
from vrdp_prob.reasoning.language.wording import Wordings, skeleton, wordings
from vrdp_prob.reasoning.language.words import split

HELD_OUT_SENTENCES = ("development", "held_out/order", "held_out/paraphrase")
"""Wordings of which training sees no template, nor one that differs by a word."""

HELD_OUT_WORDS = ("held_out/synonym",)
"""Wordings of which training sees no template: their sentences are plain, their words are not."""

HELD_OUT_NONSENSE = ("development", "held_out/out_of_scope")

CHOICES = 0.15
"""Share of choices among the examples; the others are questions."""

CANONICAL = 0.1
"""Share of the grammar's own wordings."""

NONSENSE = 0.25
"""Share of texts without a program."""


@dataclass(frozen=True)
class Example:
    """A text and its program.

    Parameters
    ----------
    kind
        `question` or `choice`.
    words
        The text as `split` cuts it.
    program
        Tokens in postfix order; None for nonsense.
    """

    kind: str
    words: tuple[str, ...]
    program: Tokens | None


def examples(count: int, generator: np.random.Generator) -> Iterator[Example]:
    """Random training examples."""
    before = _sense(generator)
    for _ in range(count):
        if generator.random() < NONSENSE:
            nonsense = _nonsense(before, generator)
            if nonsense is not None:
                yield nonsense
                continue
        before = _sense(generator)
        yield before


def draw_sense(kind: str, generator: np.random.Generator, production: str) -> Meaning:
    """A random meaning that the grammar can say."""
    plain = wordings("canonical")
    while True:
        meaning = draw(kind, generator, production)
        if by_grammar(kind, plain.say(meaning)) == meaning.program:
            return meaning


def by_grammar(kind: str, text: str) -> Tokens | None:
    """The program that the grammar gives for a question, or for a choice among the events of the video."""
    try:
        return question_by_grammar(text) if kind == "question" else choice_by_grammar(text)
    except InputError:
        return None


def draw_parts(generator: np.random.Generator) -> dict[str, Meaning]:
    """What the slots of nonsense can hold."""
    kinds = ("object", "things", "color", "material", "attribute", "state", "crossing", "event", "moment", "condition")
    parts = {kind: draw(kind, generator) for kind in (*kinds, "change")}
    doubled = {"first": "object", "second": "object", "other": "things"}
    parts |= {name: draw(kind, generator) for name, kind in doubled.items()}
    return parts | {f"other_{kind}": draw(kind, generator) for kind in ("event", "condition", "change")}


def _sense(generator: np.random.Generator) -> Example:
    kind = "choice" if generator.random() < CHOICES else "question"
    chosen = wordings("canonical" if generator.random() < CANONICAL else "training")
    names = chosen.productions(kind)
    weights = np.array([1.0 + len(slots(kind, name)) for name in names])
    meaning = draw_sense(kind, generator, names[int(generator.choice(len(names), p=weights / weights.sum()))])
    template = chosen.template(meaning, generator)
    while chosen is not wordings("canonical") and is_held_out(kind, meaning.production, skeleton(template)):
        template = chosen.template(meaning, generator)
    return Example(kind, split(chosen.fill(template, meaning.parts, generator)), meaning.program)


def _nonsense(before: Example, generator: np.random.Generator) -> Example | None:
    """Nonsense of its own, or made from sense; None where what was made is a held-out template or makes sense."""
    chosen, words = wordings("training"), list(before.words)
    way = int(generator.integers(5))
    kind = before.kind
    if way <= 1:
        template = chosen.settle(chosen.nonsense[int(generator.integers(len(chosen.nonsense)))], generator)
        if _near(skeleton(template)) & _held_out_nonsense():
            return None
        kind, words = "question", list(split(chosen.fill(template, draw_parts(generator), generator)))
    elif way == 2:
        generator.shuffle(words)
    elif way == 3:
        ends = [place for place, word in enumerate(words, start=1) if word in _UNFINISHED and place < len(words)]
        words = words[: ends[int(generator.integers(len(ends)))]] if ends else []
    else:
        other = _sense(generator).words
        words = words[: 1 + int(generator.integers(len(words)))] + list(other[int(generator.integers(len(other))) :])
        if len(words) < len(before.words) or tuple(words) in (before.words, other):
            return None
    return Example(kind, tuple(words), None) if words and by_grammar(kind, " ".join(words)) is None else None


_UNFINISHED = frozenset(
    ("the", "a", "and", "of", "with", "to", "before", "after", "when", "if", "by", "that", "which", "how", "many")
)
"""Words that no text ends with."""


def is_held_out(kind: str, production: str, text: str) -> bool:
    """Whether training leaves out a template, given as its skeleton: a held-out file has it or one very like it."""
    if not _has_words(text):
        return False
    return text in _held_out_words(kind, production) or bool(_near(text) & _held_out_sentences(kind, production))


@cache
def _held_out_sentences(kind: str, production: str) -> frozenset[str]:
    return _nearby(_skeletons(HELD_OUT_SENTENCES, kind, production))


@cache
def _held_out_words(kind: str, production: str) -> frozenset[str]:
    return frozenset(_skeletons(HELD_OUT_WORDS, kind, production))


@cache
def _held_out_nonsense() -> frozenset[str]:
    texts = [(wordings(name), template) for name in HELD_OUT_NONSENSE for template in wordings(name).nonsense]
    return _nearby(text for chosen, template in texts for text in chosen.variants(template))


def _skeletons(names: Iterable[str], kind: str, production: str) -> Iterator[str]:
    """Skeletons of a production's templates in some files; those without a word of their own hold nothing out."""
    for name in names:
        chosen: Wordings = wordings(name)
        for template in chosen.of(kind, production):
            yield from (text for text in chosen.variants(template) if _has_words(text))


def _has_words(text: str) -> bool:
    return not all(word.startswith("{") for word in text.split())


def _nearby(texts: Iterable[str]) -> frozenset[str]:
    return frozenset[str]().union(*(_near(text) for text in texts))


@cache
def _near(text: str) -> frozenset[str]:
    """A text and what is left when one word is left out: texts that differ by a word have one of these in common."""
    words = text.split()
    return frozenset((text, *(" ".join((*words[:place], *words[place + 1 :])) for place in range(len(words)))))

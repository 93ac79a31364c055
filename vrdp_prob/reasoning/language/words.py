"""The words that the grammar knows, and text cut into words."""

import re

from vrdp_prob.scene.body import COLORS, MATERIALS

COLOR_WORDS = {color: color for color in COLORS} | {"grey": "gray"}
MATERIAL_WORDS = {material: material for material in MATERIALS} | {"metallic": "metal"}
NOUNS = {
    "object": None,
    "thing": None,
    "cube": "cube",
    "block": "cube",
    "sphere": "sphere",
    "ball": "sphere",
    "cylinder": "cylinder",
}
"""Nouns of a single object, and the shape that they state."""

PLURALS = {f"{noun}s": shape for noun, shape in NOUNS.items()}
ORDER_WORDS = {"first": "first", "second": "second", "third": "third", "last": "last"}
ATTRIBUTE_WORDS = {"color": "color", "colour": "color", "material": "material", "shape": "shape"}
COMPARATIVES = {"heavier": "counterfact_heavier", "lighter": "counterfact_lighter"}
"""Words that say how an object would be changed, and their tokens."""

STATES = {"moving": "filter_moving", "stationary": "filter_stationary"}

_WORD = re.compile(r"[a-z]+(?:'[a-z]+)*|'s\b|[^\sa-z]+")
_CONTRACTED = {"won't": ("will", "not"), "can't": ("can", "not")}
_ENDINGS = {"n't": "not", "'re": "are", "'ll": "will"}
_BEFORE_IS = ("what", "which", "that", "there")
"""Words after which 's stands for 'is'; after others it is a possessive."""


def split(text: str) -> tuple[str, ...]:
    """Words of a text in lower case, contractions in full, a possessive 's apart, without punctuation."""
    return tuple(word for piece in _pieces(text) for word in _in_full(piece))


def as_written(text: str, place: int) -> tuple[str, int]:
    """The word of a text that a word of `split` is of, and its place among the text's words, counted from 1."""
    pieces = _pieces(text)
    owners = [number for number, piece in enumerate(pieces) for _ in _in_full(piece)]
    return pieces[owners[place]], owners[place] + 1


def _pieces(text: str) -> list[str]:
    lowered = text.lower().replace("\u2019", "'")
    return [piece for piece in _WORD.findall(lowered) if piece.strip("?,.!;:\"'")]


def _in_full(piece: str) -> tuple[str, ...]:
    """'what's' is 'what is', 'isn't' is 'is not', a possessive 's stands apart."""
    if piece in _CONTRACTED:
        return _CONTRACTED[piece]
    for ending, word in _ENDINGS.items():
        if piece.endswith(ending) and piece != ending:
            return piece.removesuffix(ending), word
    owner, apostrophe, end = piece.rpartition("'")
    if (apostrophe, end) == ("'", "s") and owner:
        return owner, "is" if owner in _BEFORE_IS else "'s"
    return (piece,)

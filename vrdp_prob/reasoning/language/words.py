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

_WORD = re.compile(r"[a-z]+|'s|[^\sa-z]+")


def split(text: str) -> tuple[str, ...]:
    """Words of a text in lower case, a possessive 's apart, without punctuation between sentences' parts."""
    lowered = text.lower().replace("\u2019", "'")
    return tuple(word for word in _WORD.findall(lowered) if word.strip('?,.!;:"'))

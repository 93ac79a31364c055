"""Which words can be learned: those that questions can use and that mean nothing else there."""

import re

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.language.words import (
    ATTRIBUTE_WORDS,
    COLOR_WORDS,
    MATERIAL_WORDS,
    NOUNS,
    ORDER_WORDS,
    PLURALS,
    STATES,
)

WORD = re.compile(r"[a-z]+")

GRAMMAR = (
    "a after an and any are at away been before beginning begins between collide collided collides colliding collision "
    "collisions could did do does during end ends enter entered entering enters entrance entry event events existence "
    "exit exited exiting exits five following for gone had happen happened happening happens have hit hits hitting how "
    "if in is leave leaves leaving left made many much next not occur of picture place presence removed absent "
    "responsible scene start starts take taken that the there these times to total video view was were what when which "
    "will with without would"
)
"""Words that the rules for questions and choices are made of."""

TAKEN = frozenset(
    (
        *(*COLOR_WORDS, *MATERIAL_WORDS, *NOUNS, *PLURALS, *ORDER_WORDS, *ATTRIBUTE_WORDS, *STATES),
        *GRAMMAR.split(),
    )
)
"""Words that mean something else after 'if the cube were', or anywhere in a question."""


def check_name(name: str) -> None:
    """Refuse a word that could not be used in questions.

    Raises
    ------
    InputError
        If it is not one word of lower-case letters, or means something else already.
    """
    if not isinstance(name, str) or not WORD.fullmatch(name):
        raise InputError(
            f"the word '{name}' is not one word of the letters a to z; choose another, such as 'floppier'."
        )
    if name in TAKEN:
        raise InputError(f"the word '{name}' means something else in questions; choose another.")

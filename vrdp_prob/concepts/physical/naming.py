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

TAKEN = frozenset(
    (
        *(*COLOR_WORDS, *MATERIAL_WORDS, *NOUNS, *PLURALS, *ORDER_WORDS, *ATTRIBUTE_WORDS, *STATES),
        *("removed", "taken", "gone", "not", "absent", "much", "five", "times", "the", "what", "which", "event"),
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
    if not WORD.fullmatch(name):
        raise InputError(
            f"the word '{name}' is not one word of the letters a to z; choose another, such as 'floppier'."
        )
    if name in TAKEN:
        raise InputError(f"the word '{name}' means something else in questions; choose another.")

"""The vocabulary of programs: CLEVRER's tokens, their other spellings, and the words that are arguments."""

from vrdp_prob.scene.body import COLORS, MATERIALS, Shape

SHAPES = tuple(shape.value for shape in Shape)
ORDERS = ("first", "second", "third", "last")
ANY_FRAME = "null"
"""In place of a frame: at any time of the video."""

CONCEPTS = frozenset((*COLORS, *MATERIALS, *SHAPES, *ORDERS, ANY_FRAME))
"""Words that a program pushes as arguments, as CLEVRER's postfix lists do."""

STOP_TOKENS = frozenset(("<END>", "<NULL>"))
"""Padding of programs that a parser produced: what follows is not part of the program."""

SKIPPED_TOKENS = frozenset(("<START>",))

OTHER_SPELLINGS = {
    "query_frame": "get_frame",
    "query_object": "get_object",
    "query_collision_partner": "get_col_partner",
    "filter_counterfact": "get_counterfact",
    "filter_resting": "filter_stationary",
}
"""Spellings of the executors published with CLEVRER and VRDP, and the token of the data set that means the same."""


def canonical(token: str) -> str:
    """The data set's spelling of a token."""
    return OTHER_SPELLINGS.get(token, token)


def meaningful(program: tuple[str, ...]) -> tuple[str, ...]:
    """The tokens up to the first stop token, in the data set's spelling."""
    tokens: list[str] = []
    for token in program:
        if token in STOP_TOKENS:
            break
        if token not in SKIPPED_TOKENS:
            tokens.append(canonical(token))
    return tuple(tokens)

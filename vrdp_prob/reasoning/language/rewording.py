"""Programs back in the grammar's English."""

from vrdp_prob.reasoning.language.meaning import Tokens, meaning_of
from vrdp_prob.reasoning.language.wording import wordings


def reworded(program: Tokens, kind: str) -> str | None:
    """What a program asks in the grammar's own words, None where it asks what no question or choice can.

    Parameters
    ----------
    program
        Tokens in the data set's spelling; a choice's as if it was sought among the events of the video.
    kind
        `question` or `choice`.
    """
    meaning = meaning_of(program, kind)
    if meaning is None:
        return None
    said = wordings("canonical").say(meaning)
    return said[0].upper() + said[1:] if kind == "question" else said

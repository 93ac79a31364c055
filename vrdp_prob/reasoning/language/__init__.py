"""English to programs: CLEVRER's wordings by a grammar that refuses what it does not understand."""

from vrdp_prob.reasoning.language.choices import parse_choice
from vrdp_prob.reasoning.language.questions import parse_question

__all__ = ["parse_choice", "parse_question"]

"""English to programs: CLEVRER's wordings by a grammar, others by a learned parser; refusals name the word."""

from vrdp_prob.reasoning.language.reading import Reading, parse_choice, parse_question, read_choice, read_question

__all__ = ["Reading", "parse_choice", "parse_question", "read_choice", "read_question"]

"""How often the grammar and the learned parser read held-out wordings rightly, wrongly, or not at all."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from vrdp_prob.reasoning.language.learned.examples import Example, by_grammar, draw_parts, draw_sense
from vrdp_prob.reasoning.language.learned.parser import THRESHOLD, LearnedParser, believable
from vrdp_prob.reasoning.language.meaning import Tokens
from vrdp_prob.reasoning.language.wording import wordings
from vrdp_prob.reasoning.language.words import split

GROUPS = {
    "the grammar's wordings": "canonical",
    "development": "development",
    "held out: order of words": "held_out/order",
    "held out: synonyms": "held_out/synonym",
    "held out: paraphrases": "held_out/paraphrase",
}
"""Groups of wordings with a program, and their files."""

OUT_OF_SCOPE = {
    "development: out of scope": "development",
    "held out: out of scope": "held_out/out_of_scope",
}
"""Groups of questions that no program answers, and their files."""


@dataclass(frozen=True)
class Score:
    """Shares of the texts of one group.

    Parameters
    ----------
    group
        Its name.
    templates, texts
        Numbers of templates and of texts made from them.
    grammar_right, grammar_wrong
        Exact program by the grammar, and another program.
    network_right, network_wrong
        The same by the network alone: its program is probable enough, whatever the rules say.
    right, wrong
        The same by the learned parser.
    unknown
        Texts with a word that is not in the vocabulary.
    together, together_wrong
        The same of both, the grammar first.
    """

    group: str
    templates: int
    texts: int
    grammar_right: float
    grammar_wrong: float
    network_right: float
    network_wrong: float
    right: float
    wrong: float
    unknown: float
    together: float
    together_wrong: float


def score(
    parser: LearnedParser, group: str, texts: Sequence[Example], templates: int, *, threshold: float = THRESHOLD
) -> Score:
    """Read texts and compare with their programs; a text without a program must not be read."""
    count = Counter[str]()
    for text in texts:
        grammar, network, learned = by_grammar(text.kind, " ".join(text.words)), None, None
        if parser.unknown(text.words) is not None:
            count["unknown"] += 1
        else:
            program, probability = parser.most_probable(text.kind, text.words)
            if program is not None and probability >= threshold:
                network = program
                learned = program if believable(text.kind, text.words, program) is not None else None
        count["grammar " + _verdict(grammar, text)] += 1
        count["network " + _verdict(network, text)] += 1
        count["learned " + _verdict(learned, text)] += 1
        count["together " + _verdict(grammar if grammar is not None else learned, text)] += 1
    names = (f"{who} {verdict}" for who in ("grammar", "network", "learned") for verdict in ("right", "wrong"))
    shares = [count[name] / len(texts) for name in (*names, "unknown", "together right", "together wrong")]
    return Score(group, templates, len(texts), *shares)


def _verdict(program: Tokens | None, text: Example) -> str:
    if program is None:
        return "none"
    return "right" if program == text.program else "wrong"


def texts_of(name: str, fillings: int, generator: np.random.Generator) -> tuple[list[Example], int]:
    """Texts from each template of a file, and how many templates there are."""
    chosen, texts = wordings(name), list[Example]()
    templates = [
        (kind, production, template)
        for kind in ("question", "choice")
        for production in chosen.productions(kind)
        for template in chosen.of(kind, production)
    ]
    for kind, production, template in templates:
        for _ in range(fillings):
            meaning = draw_sense(kind, generator, production)
            text = chosen.fill(chosen.settle(template, generator), meaning.parts, generator)
            texts.append(Example(kind, split(text), meaning.program))
    return texts, len(templates)


def nonsense_of(name: str, fillings: int, generator: np.random.Generator) -> tuple[list[Example], int]:
    """Questions that no program answers, and how many templates they are from."""
    chosen, texts = wordings(name), list[Example]()
    for template in chosen.nonsense:
        for _ in range(fillings):
            text = chosen.fill(chosen.settle(template, generator), draw_parts(generator), generator)
            texts.append(Example("question", split(text), None))
    return texts, len(chosen.nonsense)


def scores(parser: LearnedParser, *, fillings: int = 10, seed: int = 1) -> Iterator[Score]:
    """All groups, each with texts of its own seed.

    Parameters
    ----------
    parser
        The learned parser.
    fillings
        Texts from each template.
    seed
        Of the fillings.
    """
    for group, name in GROUPS.items():
        texts, templates = texts_of(name, fillings, np.random.default_rng(seed))
        yield score(parser, group, texts, templates)
    for group, name in OUT_OF_SCOPE.items():
        texts, templates = nonsense_of(name, fillings, np.random.default_rng(seed))
        yield score(parser, group, texts, templates)

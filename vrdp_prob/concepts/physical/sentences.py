"""What was learned of a word, in sentences."""

from vrdp_prob.concepts.physical.belief import Belief
from vrdp_prob.concepts.physical.learned_word import LearnedWord
from vrdp_prob.reasoning.changes import Rule

SETTLED = 0.95
"""Probability from which on a meaning is told as settled."""

ALIKE = 1e-3
"""Difference of the logarithm of evidences below which answers do not tell meanings apart."""


def summary(word: LearnedWord) -> tuple[str, ...]:
    """What a word means, how sure that is, and what the answers are worth."""
    if word.contradicts_itself:
        return (_contradiction(word),)
    told = _meaning(word.best, word.name) if _informed(word) else f"The answers do not tell what '{word.name}' means."
    return (told, *_rivals(word), _lapse(word), *word.evidence.left_out)


def _contradiction(word: LearnedWord) -> str:
    return (
        f"The answers about '{word.name}' contradict each other, or nothing that a word may mean here explains them: "
        f"guessing explains the {word.evidence.answers} answers better (by {-word.log_gain:.1f} nats)."
    )


def _informed(word: LearnedWord) -> bool:
    evidences = [belief.log_evidence for belief in word.beliefs]
    return max(evidences) - min(evidences) > ALIKE


def _meaning(belief: Belief, name: str) -> str:
    error = f"probability {belief.probability:.3f} ± {belief.mc_error:.3f}"
    if belief.parameter is None:
        return f"'{name}' changes nothing ({error})."
    low, high = belief.interval()
    middle, unit = belief.quantile(0.5), f" {belief.unit}" if belief.unit else ""
    if belief.rule is Rule.FACTOR:
        does = f"multiplies the {belief.parameter} by {middle:.2f}{unit}"
        return f"'{name}' {does} (90 % interval {low:.2f} to {high:.2f}; {error})."
    does = f"adds {middle:+.2f}{unit} to the {belief.parameter}"
    return f"'{name}' {does} (90 % interval {low:+.2f} to {high:+.2f}; {error})."


def _rivals(word: LearnedWord) -> tuple[str, ...]:
    """The parameters that it may change, where that is not settled."""
    ranked = sorted(word.probabilities.items(), key=lambda entry: -entry[1])
    if ranked[0][1] >= SETTLED:
        return ()
    return ("What it changes is not settled: " + ", ".join(f"{name} {share:.2f}" for name, share in ranked) + ".",)


def _lapse(word: LearnedWord) -> str:
    return (
        f"Of the {word.evidence.answers} answers to {word.evidence.examples} questions about {word.evidence.videos} "
        f"videos about {100 * word.lapse.mean:.0f} % are no better than guessed "
        f"(90 % interval {100 * word.lapse.q05:.0f} to {100 * word.lapse.q95:.0f} %)."
    )

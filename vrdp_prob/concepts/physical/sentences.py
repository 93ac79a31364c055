"""What was learned of a word, in sentences."""

from vrdp_prob.concepts.physical.belief import Belief
from vrdp_prob.concepts.physical.learned_word import LearnedWord
from vrdp_prob.plain_words import several
from vrdp_prob.reasoning.changes import Rule

SETTLED = 0.95
"""Probability from which on a meaning is told as settled."""
LIKELY = 0.5
"""Probability from which on a meaning is told as the most probable one."""

ALIKE = 1e-3
"""Difference of the logarithm of evidences below which answers do not tell meanings apart."""


def summary(word: LearnedWord) -> tuple[str, ...]:
    """What a word means, how sure that is, and what the answers are worth."""
    if word.contradicts_itself:
        return (_contradiction(word), *word.evidence.left_out)
    if not _informed(word):
        return (f"The answers do not tell what '{word.name}' means.", _lapse(word), *word.evidence.left_out)
    return (_meaning(word), *_rivals(word), _lapse(word), *word.evidence.left_out)


def _contradiction(word: LearnedWord) -> str:
    return (
        f"The answers about '{word.name}' contradict each other, or nothing that a word may mean here explains them: "
        f"guessing explains the {several(word.evidence.answers, 'answer')} better (by {-word.log_gain:.1f} nats)."
    )


def _informed(word: LearnedWord) -> bool:
    evidences = [belief.log_evidence for belief in word.beliefs]
    return max(evidences) - min(evidences) > ALIKE


def _meaning(word: LearnedWord) -> str:
    probability, error = word.probabilities[word.subject], word.mc_errors[word.subject]
    if probability < LIKELY:
        return f"It is not settled what '{word.name}' changes: {_ranked(word)}."
    surely = "" if probability >= SETTLED else "most probably "
    changes = "nothing" if word.best.parameter is None else f"the {word.subject}{_amount(word.best)}"
    return f"'{word.name}' {surely}changes {changes} (probability {probability:.3f} ± {error:.3f})."


def _amount(belief: Belief) -> str:
    (low, high), middle = belief.interval(), belief.quantile(0.5)
    if belief.rule is Rule.FACTOR:
        return f": times {middle:.2f}, 90 % interval {low:.2f} to {high:.2f}"
    unit = f" {belief.unit}" if belief.unit else ""
    return f": by {middle:+.2f}{unit}, 90 % interval {low:+.2f} to {high:+.2f}"


def _rivals(word: LearnedWord) -> tuple[str, ...]:
    """The parameters that it may change, where that is not settled."""
    if not LIKELY <= word.probabilities[word.subject] < SETTLED:
        return ()
    return (f"That is not settled: {_ranked(word)}.",)


def _ranked(word: LearnedWord) -> str:
    ranked = sorted(word.probabilities.items(), key=lambda entry: -entry[1])
    return ", ".join(f"{name} {share:.2f}" for name, share in ranked)


def _lapse(word: LearnedWord) -> str:
    return (
        f"Of the {several(word.evidence.answers, 'answer')} to {several(word.evidence.examples, 'question')} about "
        f"{several(word.evidence.videos, 'video')} about {100 * word.lapse.mean:.0f} % are no better than guessed "
        f"(90 % interval {100 * word.lapse.q05:.0f} to {100 * word.lapse.q95:.0f} %)."
    )

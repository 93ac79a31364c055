"""A word that was learned: its posterior, in sentences, as a change for questions, and as a file."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from vrdp_prob.concepts.physical.belief import Belief
from vrdp_prob.reasoning.changes import Change, Meaning

NEGLIGIBLE = 1e-6
"""Meanings that are less probable than this are left out of answers."""

CONTRADICTION = 1.0
"""By how much (nats) guessing has to explain answers better until they are said to contradict each other."""


@dataclass(frozen=True)
class Interval:
    """Mean and central 90 % interval of a posterior."""

    mean: float
    q05: float
    q95: float


@dataclass(frozen=True)
class Evidence:
    """What a word was learned from.

    Parameters
    ----------
    videos, examples, answers
        How many: an example with choices has as many answers as choices.
    draws, seed
        Posterior draws per video, and the seed of what the tracks leave open.
    left_out
        Videos that could not be used, each with the reason in a sentence.
    """

    videos: int
    examples: int
    answers: int
    draws: int
    seed: int
    left_out: tuple[str, ...] = ()


@dataclass(frozen=True)
class LearnedWord:
    """A word for a change of an object, with the posterior over what it means.

    Parameters
    ----------
    name
        The word.
    beliefs
        Every hypothesis with its probability; the first one is that the word changes nothing.
    mc_errors
        Monte Carlo standard errors of `probabilities`.
    lapse
        Share of answers that no meaning explains better than guessing.
    log_gain, log_gain_error
        How much more probable the answers are with the word than if all were guessed (logarithm, nats), and the Monte
        Carlo standard error of that.
    evidence
        What it was learned from.
    """

    name: str
    beliefs: tuple[Belief, ...]
    mc_errors: Mapping[str, float]
    lapse: Interval
    log_gain: float
    log_gain_error: float
    evidence: Evidence

    @cached_property
    def change(self) -> Change:
        """The change for questions: every draw of a world takes one of the meanings, by their probabilities."""
        several = [one for belief in self.beliefs for one in belief.meanings() if one.probability > NEGLIGIBLE]
        total = sum(one.probability for one in several)
        return Change(self.name, tuple(Meaning(one.probability / total, one.shift) for one in several))

    @property
    def probabilities(self) -> Mapping[str, float]:
        """Posterior probability of what the word changes: of each parameter, and of `nothing`."""
        found: dict[str, float] = {}
        for belief in self.beliefs:
            found[belief.subject] = found.get(belief.subject, 0.0) + belief.probability
        return found

    @property
    def subject(self) -> str:
        """What the word most probably changes: a parameter, or `nothing`."""
        return max(self.probabilities.items(), key=lambda entry: entry[1])[0]

    @property
    def best(self) -> Belief:
        """The most probable hypothesis about what the word most probably changes."""
        about_it = [belief for belief in self.beliefs if belief.subject == self.subject]
        return max(about_it, key=lambda belief: belief.probability)

    @property
    def contradicts_itself(self) -> bool:
        """Whether the answers contradict each other: guessing explains them better, all meanings taken together.

        By a nat at least: one question that is answered once with yes and once with no is worse by 1.1 nats.
        """
        return self.log_gain <= -CONTRADICTION

    @property
    def summary(self) -> tuple[str, ...]:
        """What was learned, in sentences."""
        from vrdp_prob.concepts.physical.sentences import summary  # noqa: PLC0415 (the sentences know this class)

        return summary(self)

    def write(self, path: Path | str) -> None:
        """Save the word as a JSON document.

        Raises
        ------
        InputError
            If the file cannot be written.
        """
        from vrdp_prob.concepts.physical.word_file import write_word  # noqa: PLC0415 (the file knows this class)

        write_word(self, Path(path))

    @classmethod
    def read(cls, path: Path | str) -> "LearnedWord":
        """Open a word that `write` saved.

        Raises
        ------
        InputError
            If the file cannot be read or is not such a word.
        """
        from vrdp_prob.concepts.physical.word_file import read_word  # noqa: PLC0415 (the file knows this class)

        return read_word(Path(path))

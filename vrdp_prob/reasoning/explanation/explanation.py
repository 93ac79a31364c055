"""What makes an answer uncertain, in numbers and sentences."""

from dataclasses import asdict, dataclass

from vrdp_prob.reasoning.explanation.hinges import Hinge
from vrdp_prob.reasoning.explanation.observations import Observation

SMALLEST_SHARE = 0.005
"""Smaller shares are not put in words."""

PRECISER = 10.0
"""How many times more exactly than now the motion is known in what is left to chaos."""


@dataclass(frozen=True)
class Shares:
    """Shares of the variance of an answer, which add up to 1.

    Parameters
    ----------
    parameters
        Would go if masses, restitutions, friction and the turning of cubes were known, and what learned words mean.
    events
        Would then go if it were known which doubtful contacts and rests of the video happened, and who looks how.
    model
        Would then go if it were known what to believe where the simulation and the video differ: half of the draws
        keep what was seen, half follow their own simulation. Where an event of the video is in doubt, which the latter
        decide by themselves, this is part of `events`.
    motion
        Would then go if the motion were measured `PRECISER` times as exactly.
    chaos
        Would remain even then: what is too small to be measured decides.
    error
        Monte Carlo standard error of the sums: of `parameters`, of it with `events`, with `model`, and of `chaos`.
    words
        Learned words of the question that may mean several things.
    """

    parameters: float
    events: float
    model: float
    motion: float
    chaos: float
    error: float
    words: tuple[str, ...] = ()

    @property
    def sentence(self) -> str:
        """In whole per cent, with what each share means."""
        meaning = f", and from what '{self.words[0]}' means" if self.words else ""
        parts = (
            (self.parameters, f"comes from masses, restitutions, friction and the turning of cubes{meaning}"),
            (self.events, "comes from doubtful contacts, rests and attributes"),
            (self.model, "comes from where the simulation and the video differ"),
            (self.motion, f"would go if the motion were measured {PRECISER:.0f} times as exactly"),
            (self.chaos, "would remain even then (chaos)"),
        )
        told = [f"{100 * share:.0f} % {words}" for share, words in parts if share >= SMALLEST_SHARE]
        return f"Of the doubt {', '.join(told)}; each ± {100 * self.error:.0f} %."


@dataclass(frozen=True)
class Part:
    """Why one choice, or the answer of an open question, is uncertain.

    Parameters
    ----------
    choice_id
        Which choice; None for an open question.
    subject
        The choice in English, or the question.
    answer
        The answer whose probability is told: `yes` for a choice.
    probability
        Of that answer.
    entropy
        Of its answers, in nats.
    hinges
        What it hangs on, the most telling first.
    shares
        Where its doubt comes from; None where there are no draws of a posterior.
    observations
        What would settle it, the best first.
    """

    choice_id: int | str | None
    subject: str
    answer: str
    probability: float
    entropy: float
    hinges: tuple[Hinge, ...]
    shares: Shares | None
    observations: tuple[Observation, ...]

    @property
    def sentences(self) -> tuple[str, ...]:
        """For a person to read."""
        what = f"“{self.subject}”" if self.choice_id is not None else f"The answer “{self.answer}”"
        opening = f"{what} has probability {self.probability:.2f}"
        if self.hinges:
            first, *others = self.hinges
            told = [f"{opening} and hangs on {first.sentence}."]
            told += [f"It also hangs on {other.sentence}." for other in others]
        else:
            told = [f"{opening}; no single quantity or event of the draws decides it."]
        if self.shares is not None:
            told.append(self.shares.sentence)
        told += [observation.sentence for observation in self.observations]
        if not self.observations:
            told.append("No single measurement that was looked at would settle it.")
        return tuple(told)


@dataclass(frozen=True)
class Explanation:
    """Why an answer is as uncertain as it is.

    Parameters
    ----------
    question
        What was asked.
    parts
        One for the answer of an open question, or for each uncertain choice; none where the answer is certain.
    certain
        What is said where it is.
    """

    question: str
    parts: tuple[Part, ...]
    certain: str = ""

    @property
    def sentences(self) -> tuple[str, ...]:
        """For a person to read."""
        return tuple(sentence for part in self.parts for sentence in part.sentences) or (self.certain,)

    def __str__(self) -> str:
        return "\n".join(self.sentences)

    def to_document(self) -> dict[str, object]:
        """As JSON values."""
        return {
            "parts": [
                {**asdict(part), "hinges": [{**asdict(hinge), "kind": str(hinge.kind)} for hinge in part.hinges]}
                for part in self.parts
            ],
            "sentences": list(self.sentences),
        }

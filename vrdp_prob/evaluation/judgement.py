"""One answer beside the truth."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning import Answer, ask
from vrdp_prob.reasoning.change_operations import APPLY, COUNTERFACT
from vrdp_prob.reasoning.changes import Change
from vrdp_prob.reasoning.facts import Facts
from vrdp_prob.reasoning.prepared import prepare
from vrdp_prob.reasoning.vocabulary import ChangeWord, Vocabulary
from vrdp_prob.scene import Question, QuestionType
from vrdp_prob.scene.question import RIGHT

CHANGED = (APPLY, COUNTERFACT)
"""What tokens begin with that change an object without removing it."""
MASS_TOKENS = {f"{prefix}{change}" for prefix in CHANGED for change in (Change.HEAVIER, Change.LIGHTER)}
"""Those of CLEVRER's words; all others stand for learned ones."""


class Kind(StrEnum):
    """Kinds of questions that are scored apart."""

    DESCRIPTIVE = "descriptive"
    EXPLANATORY = "explanatory"
    PREDICTIVE = "predictive"
    REMOVAL = "counterfactual_removal"
    MASS = "counterfactual_mass"
    WORD = "counterfactual_word"

    @property
    def question_type(self) -> QuestionType:
        """CLEVRER's type."""
        return QuestionType(self.value.split("_", maxsplit=1)[0])


@dataclass(frozen=True)
class Judgement:
    """One answer, and whether it is right.

    Parameters
    ----------
    scene
        Name of the video.
    question_id
        Name of the question within it.
    kind
        Its kind.
    question
        Its text.
    answer, truth
        What was answered, and what is right: an open answer, or the ids of the choices judged correct.
    right
        Whether the whole answer is right.
    confidence
        Probability that was given to the answer.
    probability
        Probability that was given to the truth.
    squared_error
        Half the sum over all possible answers of the squared error of their probability: (p - y)^2 for yes or no.
    choices
        Probability and truth of each choice.
    refused
        Why there is no answer; None where there is one. A question without an answer counts as wrong.
    texts
        Id and text of each choice.
    """

    scene: str
    question_id: str
    kind: Kind
    question: str
    answer: str
    truth: str
    right: bool
    confidence: float
    probability: float
    squared_error: float
    choices: tuple[tuple[float, bool], ...] = ()
    refused: str | None = None
    texts: tuple[tuple[str, str], ...] = ()

    def to_document(self) -> dict[str, Any]:
        """The judgement as JSON values."""
        return asdict(self)

    @classmethod
    def of_document(cls, document: Mapping[str, Any]) -> "Judgement":
        """What `to_document` made a document of."""
        choices = tuple((float(probability), bool(right)) for probability, right in document["choices"])
        texts = tuple((str(name), str(text)) for name, text in document.get("texts", ()))
        return cls(**{**document, "kind": Kind(document["kind"]), "choices": choices, "texts": texts})


def judge(scene: str, facts: Facts, question: Question, words: Sequence[ChangeWord] = ()) -> Judgement:
    """Ask a question and compare the answer with the truth."""
    try:
        answer = ask(facts, question, words=words)
    except InputError as error:
        return unanswered(scene, question, str(error), words)
    truth = _truth(question)
    given = _key(answer)
    probability = answer.distribution.get(truth, 0.0)
    squares = sum(share**2 for share in answer.distribution.values())
    rights = [choice.answer == RIGHT for choice in question.choices]
    return Judgement(
        scene=scene,
        question_id=str(question.question_id),
        kind=kind_of(question, words),
        question=question.text,
        answer=given,
        truth=truth,
        right=given == truth,
        confidence=answer.probability,
        probability=probability,
        squared_error=(squares - 2 * probability + 1) / 2,
        choices=tuple((choice.probability, right) for choice, right in zip(answer.choices, rights, strict=True)),
        texts=_texts(question),
    )


def unanswered(scene: str, question: Question, reason: str, words: Sequence[ChangeWord] = ()) -> Judgement:
    """The judgement of a question that got no answer: wrong, every choice judged as likely as not."""
    return Judgement(
        scene=scene,
        question_id=str(question.question_id),
        kind=kind_of(question, words),
        question=question.text,
        answer="",
        truth=_truth(question),
        right=False,
        confidence=0.0,
        probability=0.0,
        squared_error=1.0,
        choices=tuple((0.5, choice.answer == RIGHT) for choice in question.choices),
        refused=reason,
        texts=_texts(question),
    )


def kind_of(question: Question, words: Sequence[ChangeWord] = ()) -> Kind:
    """Kind of a question of a question file.

    Raises
    ------
    InputError
        If it is not understood.
    """
    asked = prepare(question, (), Vocabulary.of(words))
    if asked.kind is not QuestionType.COUNTERFACTUAL:
        return Kind(asked.kind.value)
    programs = [program for _, program in asked.options]
    programs += [] if asked.program is None else [asked.program]
    tokens = {token for program in programs for token in program.tokens}
    changing = {token for token in tokens if token.startswith(CHANGED)}
    if not changing:
        return Kind.REMOVAL
    return Kind.MASS if changing <= MASS_TOKENS else Kind.WORD


def _texts(question: Question) -> tuple[tuple[str, str], ...]:
    return tuple((str(choice.choice_id), choice.text) for choice in question.choices)


def _truth(question: Question) -> str:
    if not question.choices:
        return str(question.answer)
    return ",".join(str(choice.choice_id) for choice in question.choices if choice.answer == RIGHT)


def _key(answer: Answer) -> str:
    if isinstance(answer.answer, tuple):
        return ",".join(str(choice) for choice in answer.answer)
    return str(answer.answer)

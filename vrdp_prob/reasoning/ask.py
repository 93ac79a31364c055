"""The door: a posterior and a question in, an answer out."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import cached_property, wraps
from typing import ParamSpec

from vrdp_prob.errors import InputError
from vrdp_prob.inference import Posterior
from vrdp_prob.inference import infer as infer_posterior
from vrdp_prob.progress import ProgressDisplay
from vrdp_prob.reasoning.adaptive import answer_within
from vrdp_prob.reasoning.answer import Answer
from vrdp_prob.reasoning.defaults import Defaults
from vrdp_prob.reasoning.executor import answer_question
from vrdp_prob.reasoning.facts import Facts
from vrdp_prob.reasoning.posterior_like import PosteriorLike
from vrdp_prob.reasoning.prepared import ChoiceInput
from vrdp_prob.reasoning.vocabulary import ChangeWord, Vocabulary
from vrdp_prob.reasoning.worlds import DRAWS, PosteriorWorlds
from vrdp_prob.scene import Question

Options = ParamSpec("Options")


def ask(
    known: PosteriorLike | Facts,
    question: str | Sequence[str] | Question,
    *,
    choices: Sequence[ChoiceInput] = (),
    draws: int = DRAWS,
    mc_error: float | None = None,
    defaults: Defaults = "fixed",
    words: Sequence[ChangeWord] = (),
    progress: ProgressDisplay | None = None,
) -> Answer:
    """Answer a question about a video with probabilities.

    Parameters
    ----------
    known
        A posterior, or its `PosteriorWorlds`: several questions then share the simulated worlds.
    question
        English in CLEVRER's wording, a program (a list of tokens), or a question of a question file.
    choices
        Options of a multiple-choice question, in English or as programs.
    draws
        Number of posterior draws to use, where `known` is a posterior.
    mc_error
        Monte Carlo error to reach: so many draws are added at a time until every probability of the answer is as sure,
        or the posterior has no more to give, which the answer's notes then say. None takes the draws that there are.
    defaults
        Whether objects that never collided have default mass and restitution (`fixed`) or values drawn from the prior
        (`prior`), where `known` is a posterior.
    words
        Learned words that the question may use; a built-in word among them has its learned meaning.
    progress
        Who follows the simulation, where `known` is a posterior.

    Raises
    ------
    InputError
        If `known` is no posterior, or the question is not understood, names an object that is not there or that two
        objects fit, or needs choices and has none.
    """
    if isinstance(known, AskablePosterior) and (draws, defaults) == (DRAWS, "fixed"):
        facts: Facts = known.all_worlds
    elif isinstance(known, PosteriorLike):
        facts = PosteriorWorlds(known, draws=draws, defaults=defaults, progress=progress)
    elif not callable(getattr(known, "counterfactual_events", None)):
        given = type(known).__name__
        raise InputError(f"a {given} cannot be asked; give a posterior, which vrdp_prob.infer makes of tracks.")
    else:
        facts = known
    return _answer(facts, question, choices, mc_error, words)


def _answer(
    facts: Facts,
    question: str | Sequence[str] | Question,
    choices: Sequence[ChoiceInput],
    mc_error: float | None,
    words: Sequence[ChangeWord],
) -> Answer:
    vocabulary = Vocabulary.of(words)
    if mc_error is None:
        return answer_question(facts, question, choices=choices, vocabulary=vocabulary)
    if not isinstance(facts, PosteriorWorlds):
        raise InputError("mc_error needs a posterior, which draws can be taken from; leave it out.")
    return answer_within(facts, question, choices=choices, mc_error=mc_error, vocabulary=vocabulary)


@dataclass(frozen=True)
class AskablePosterior(Posterior):
    """A posterior that answers questions; its simulated worlds are kept from question to question."""

    @classmethod
    def of(cls, posterior: Posterior) -> "AskablePosterior":
        """The same posterior, ready to be asked."""
        return cls(**{entry.name: getattr(posterior, entry.name) for entry in fields(Posterior)})

    @cached_property
    def all_worlds(self) -> PosteriorWorlds:
        """What was, what will be and what would be, in all draws."""
        return PosteriorWorlds(self)

    def ask(
        self,
        question: str | Sequence[str] | Question,
        *,
        choices: Sequence[ChoiceInput] = (),
        mc_error: float | None = None,
        words: Sequence[ChangeWord] = (),
    ) -> Answer:
        """Answer a question; see `vrdp_prob.reasoning.ask`."""
        return _answer(self.all_worlds, question, choices, mc_error, words)


def _askable(infer: Callable[Options, Posterior]) -> Callable[Options, AskablePosterior]:
    """The same function, whose posterior can be asked."""

    @wraps(infer)
    def infer_askable(*arguments: Options.args, **options: Options.kwargs) -> AskablePosterior:
        return AskablePosterior.of(infer(*arguments, **options))

    return infer_askable


infer = _askable(infer_posterior)

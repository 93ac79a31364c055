"""A word learned from examples: which physical parameter of an object it changes, and by how much."""

from collections.abc import Sequence

import numpy as np

from vrdp_prob.concepts.physical.agreement import GROUPS, Agreement, agreements_of
from vrdp_prob.concepts.physical.belief import Belief
from vrdp_prob.concepts.physical.examples import Example, prepared
from vrdp_prob.concepts.physical.hypotheses import HYPOTHESES, MEANINGS, Hypothesis, places_of
from vrdp_prob.concepts.physical.learned_word import Evidence, Interval, LearnedWord
from vrdp_prob.concepts.physical.naming import check_name
from vrdp_prob.concepts.physical.weighing import Weighing, jackknife_error, weigh
from vrdp_prob.errors import InputError
from vrdp_prob.progress import ProgressDisplay, SilentProgress
from vrdp_prob.reasoning.changes import Change, Meaning
from vrdp_prob.reasoning.posterior_like import PosteriorLike
from vrdp_prob.scene import Question

DRAWS = 200
"""Posterior draws of each video, unless the caller says otherwise."""


def learn_concept(
    name: str,
    examples: Sequence[Example],
    *,
    draws: int = DRAWS,
    seed: int = 0,
    progress: ProgressDisplay | None = None,
) -> LearnedWord:
    """Learn a word for a change of an object from questions that use it and their answers.

    The word is an unknown change of one physical parameter of its object: mass, restitution, friction or speed, times a
    factor or plus an offset; or no change. The answers are explained by simulating, in the posterior draws of each
    video, what would happen under every such meaning (see `vrdp_prob.concepts.physical.weighing` for the likelihood).
    It is the model selection of a latent intervention, with the meanings' evidences by enumeration.

    Parameters
    ----------
    name
        The word, as questions use it: 'If the cube were floppier, what would happen?', or the program tokens
        `counterfact_floppier` and `apply_floppier`. A built-in word (`heavier`) is learned as if it was unknown.
    examples
        Questions with their right answers, each about a video with a posterior.
    draws
        Posterior draws of each video; at least 10.
    seed
        Seed of what the tracks leave open. The same seed gives the same word.
    progress
        Who follows the simulation.

    Returns
    -------
    LearnedWord
        The posterior over meanings; `ask(..., words=[word])` uses it.

    Raises
    ------
    InputError
        If the word means something else, there is no example, or an example does not use the word, has no answer or
        cannot be asked of its video.
    """
    check_name(name)
    check_draws(draws)
    _check_examples(name, examples)
    for example in examples:
        prepared(example.question, Change(name, (Meaning(1.0, None),)))
    videos = _by_video(examples)
    found: list[Agreement] = []
    with (progress or SilentProgress()).stage(f"Learning '{name}'", total=len(videos) * len(MEANINGS)) as advance:
        for posterior, questions in videos:
            found += agreements_of(name, posterior, [questions], draws=draws, seed=seed, advance=advance)
    return word_of(name, found, examples=len(examples), draws=draws, seed=seed)


def _check_examples(name: str, examples: Sequence[Example]) -> None:
    if isinstance(examples, Example):
        raise InputError(f"examples is a single example of the word '{name}'; give a list, even of one.")
    if not isinstance(examples, Sequence) or not all(isinstance(one, Example) for one in examples):
        raise InputError(f"examples of the word '{name}' are no list of vrdp_prob.Example; make each by Example.of.")
    if not examples:
        raise InputError(f"there is no example of the word '{name}'; give at least one question with its answer.")
    for number, one in enumerate(examples, start=1):
        if not isinstance(one.posterior, PosteriorLike) or not isinstance(one.question, Question):
            raise InputError(
                f"example {number} of the word '{name}' is not a posterior with a question; make it by Example.of."
            )


def word_of(
    name: str, agreements: Sequence[Agreement], *, examples: int, draws: int, seed: int, left_out: tuple[str, ...] = ()
) -> LearnedWord:
    """The word that its examples make.

    Parameters
    ----------
    name
        The word.
    agreements
        How far every meaning agrees with the answers about each video.
    examples, draws, seed, left_out
        How they were made; see `Evidence`.
    """
    everything = weigh(agreements)
    without_group = [weigh(agreements, without=group) for group in range(GROUPS)]
    below = np.cumsum(everything.lapse_probability)
    low, high = (float(np.interp(level, below, everything.lapse)) for level in (0.05, 0.95))
    beliefs = tuple(_belief(one, everything, without_group) for one in (None, *HYPOTHESES))
    return LearnedWord(
        name,
        beliefs,
        _errors(without_group),
        Interval(float(everything.lapse @ everything.lapse_probability), low, high),
        everything.log_gain,
        jackknife_error([one.log_gain for one in without_group]),
        Evidence(len(agreements), examples, sum(one.answers for one in agreements), draws, seed, left_out),
    )


def _errors(without_group: Sequence[Weighing]) -> dict[str, float]:
    """Monte Carlo standard errors of the probability of each parameter, and of no change."""
    subjects = np.array(["nothing" if shift is None else str(shift.parameter) for shift in MEANINGS])
    return {
        subject: jackknife_error([float(one.probability[subjects == subject].sum()) for one in without_group])
        for subject in dict.fromkeys(subjects.tolist())
    }


def check_draws(draws: int) -> None:
    """Refuse a number of draws that is too small for a Monte Carlo error."""
    if draws < GROUPS:
        raise InputError(f"draws is {draws}; a word is learned from at least {GROUPS} posterior draws of each video.")


def _belief(hypothesis: Hypothesis | None, everything: Weighing, without_group: Sequence[Weighing]) -> Belief:
    places = slice(0, 1) if hypothesis is None else places_of(hypothesis)
    own = everything.probability[places]
    probability = float(own.sum())
    error = jackknife_error([float(one.probability[places].sum()) for one in without_group])
    prior = np.ones(1) if hypothesis is None else hypothesis.prior
    log_evidence = float(np.logaddexp.reduce(everything.log_evidence[places] + np.log(prior)))
    if hypothesis is None:
        return Belief(None, None, probability, error, log_evidence)
    # by evidences and not by the posterior, which may be too small to be divided by
    weights = np.exp(everything.log_evidence[places] + np.log(prior) - log_evidence)
    return Belief(
        hypothesis.parameter,
        hypothesis.rule,
        probability,
        error,
        log_evidence,
        tuple(hypothesis.amounts.tolist()),
        tuple((weights / weights.sum()).tolist()),
    )


def _by_video(examples: Sequence[Example]) -> list[tuple[PosteriorLike, list[Question]]]:
    """The questions of each posterior, so that its worlds are made once."""
    found: dict[int, tuple[PosteriorLike, list[Question]]] = {}
    for example in examples:
        found.setdefault(id(example.posterior), (example.posterior, []))[1].append(example.question)
    return list(found.values())

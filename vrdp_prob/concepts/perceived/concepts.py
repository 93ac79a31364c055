"""Learned concepts: several networks that learned the same words, and what they make of a video.

Each network held out other videos while it learned, so they differ where the answers leave something open. A
probability is the mean over the networks.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from itertools import chain

import numpy as np
import torch
from jaxtyping import Float

from vrdp_prob.concepts.perceived.network import ConceptNetwork
from vrdp_prob.concepts.perceived.observation import Observation
from vrdp_prob.concepts.perceived.soft_facts import SoftEvents, SoftMotion
from vrdp_prob.concepts.perceived.vocabulary import Vocabulary
from vrdp_prob.errors import InputError
from vrdp_prob.perception.reading import CERTAIN, SeenObjects
from vrdp_prob.reasoning.changes import Change
from vrdp_prob.reasoning.events import EventTable
from vrdp_prob.reasoning.facts import NOT_STATED, Motion, TableFacts
from vrdp_prob.reasoning.prepared import prepare
from vrdp_prob.reasoning.values import Label
from vrdp_prob.reasoning.vocabulary import PLAIN
from vrdp_prob.reasoning.vocabulary import Vocabulary as QuestionVocabulary
from vrdp_prob.scene import Body, Question, Tracks

Attributes = Mapping[str, Float[np.ndarray, "body value"]]


@dataclass(frozen=True)
class Lessons:
    """What concepts were learned from, and how well that went.

    Parameters
    ----------
    videos, examples
        Number of videos, and of answers about them.
    seed
        Seed of the training.
    guessed
        Share of the answers that are right when the commonest answer to the same kind of question is given.
    attributes_right, events_right
        Share of held-out answers that are right, with the events of the tracks and with those of the concepts; None
        where nothing was held out.
    """

    videos: int
    examples: int
    seed: int
    guessed: float
    attributes_right: float | None
    events_right: float | None

    def to_document(self) -> dict[str, float | None]:
        """As plain values by name."""
        return asdict(self)


@dataclass(frozen=True)
class Concepts:
    """Concepts that were learned from questions and answers.

    Parameters
    ----------
    networks
        Networks that learned the same words.
    lessons
        What they learned from.
    """

    networks: tuple[ConceptNetwork, ...]
    lessons: Lessons

    @property
    def vocabulary(self) -> Vocabulary:
        """The attribute words that were learned."""
        return self.networks[0].vocabulary

    def attributes(self, observation: Observation) -> Attributes:
        """Probability of each learned value of each attribute."""
        with torch.no_grad():
            seen = [network.eval().attributes_of([observation])[0] for network in self.networks]
        return {name: np.mean([one[name].numpy() for one in seen], axis=0) for name in self.vocabulary.values}

    def recognise(self, seen: SeenObjects) -> Tracks:
        """The tracks of a video with the attributes that the concepts see.

        The solid that is simulated stays the tracker's; `shape` among the probabilities is what questions mean.

        Raises
        ------
        InputError
            If the video is too short.
        """
        attributes = self.attributes(Observation.of(seen))
        bodies = tuple(self._body(body, place, attributes) for place, body in enumerate(seen.tracks.bodies))
        return replace(seen.tracks, bodies=bodies)

    def facts(self, seen: SeenObjects, *, draws: int = 400, seed: int = 0) -> "SeenFacts":
        """A video as the concepts alone see it, events and motion too, for descriptive and explanatory questions.

        Parameters
        ----------
        seen
            The video.
        draws
            Draws of what the concepts leave open.
        seed
            Seed of the draws.
        """
        observation = Observation.of(seen)
        numbers = np.random.default_rng(seed)
        with torch.no_grad():
            events = [network.eval().events_of(observation) for network in self.networks]
            motions = [network.motion_of(observation) for network in self.networks]
        network = np.arange(draws) % len(self.networks)
        table = _drawn_events(seen.tracks, [events[place] for place in network], numbers)
        motion = _drawn_motion([motions[place] for place in network], numbers)
        bodies, learned = self.recognise(seen).bodies, self.vocabulary.values
        return SeenFacts(bodies, table, motion, effective_draws=draws, seed=seed, learned=learned)

    @cached_property
    def unlearned(self) -> frozenset[str]:
        """Attribute words of the question language that the concepts never learned."""
        return frozenset(self.vocabulary.missing)

    def check_question(self, question: Question, vocabulary: QuestionVocabulary = PLAIN) -> None:
        """Refuse a question about what was never learned.

        Raises
        ------
        InputError
            If a word of its program, or of a choice's, is among it, or the question is not understood.
        """
        asked = prepare(question, (), vocabulary)
        programs = [program for _, program in asked.options] if asked.program is None else [asked.program]
        for word in chain.from_iterable(program.tokens for program in programs):
            if word in self.unlearned:
                raise InputError(
                    f"the concepts never learned the word '{word}'; learn them from questions that use it, or ask with "
                    "--concepts rules."
                )

    def _body(self, body: Body, place: int, attributes: Attributes) -> Body:
        shares = {
            name: dict(zip(words, attributes[name][place].tolist(), strict=True))
            for name, words in self.vocabulary.values.items()
        }
        best = {name: max(values, key=lambda word: values[word]) for name, values in shares.items()}
        unsure = {
            name: values
            for name, values in shares.items()
            if values[best[name]] < CERTAIN or (name == "shape" and best[name] != body.shape)
        }
        return replace(body, color=best["color"], material=best["material"], attribute_probabilities=unsure)


@dataclass(frozen=True)
class SeenFacts(TableFacts):
    """What concepts see of a video: nothing of what happens after it, or would happen with a change.

    Parameters
    ----------
    learned
        The words that were learned, by attribute.
    """

    learned: Mapping[str, tuple[str, ...]] = field(kw_only=True)

    def attribute(self, name: str) -> tuple[Label, ...]:
        """Which of the learned words each object is described by, in each draw."""
        told = (NOT_STATED, *self.learned[name])
        return tuple(
            Label(np.array([told.index(word) if word in told else 0 for word in label.names])[label.index], told)
            for label in super().attribute(name)
        )

    def unseen_events(self) -> EventTable:
        """Refused.

        Raises
        ------
        InputError
            Always.
        """
        raise _not_seen("happens after it")

    def counterfactual_events(self, change: Change, body: int) -> EventTable:
        """Refused.

        Raises
        ------
        InputError
            Always.
        """
        raise _not_seen(f"would happen if object {self.bodies[body].id} were {change}")


def _not_seen(what: str) -> InputError:
    return InputError(
        f"concepts see what happens in the video, not what {what}; infer the video and ask its posterior "
        "(vrdp_prob.infer)."
    )


def _drawn_events(tracks: Tracks, events: Sequence[SoftEvents], numbers: np.random.Generator) -> EventTable:
    table = EventTable.empty(events[0].universe, len(events))
    probability = np.stack([one.happens.numpy() for one in events])
    happens = numbers.random(probability.shape) < probability
    time = np.where(happens, np.stack([one.time.numpy() for one in events]), np.nan)
    universe = replace(table.universe, bodies=tuple(body.id for body in tracks.bodies))
    return EventTable(universe, happens, time)


def _drawn_motion(motions: Sequence[SoftMotion], numbers: np.random.Generator) -> Motion:
    """Draws in which a body that is as likely to move in two frames moves in both or in neither."""
    in_view = np.stack([one.in_view.numpy() for one in motions]) > 0
    moving = np.stack([one.moving.numpy() for one in motions])
    return Motion(motions[0].times, in_view, numbers.random((len(motions), 1, moving.shape[2])) < moving)

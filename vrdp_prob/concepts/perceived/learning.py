"""Concepts learned from the videos of a folder and a file of questions."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch

from vrdp_prob.concepts.perceived.concepts import Concepts, Lessons
from vrdp_prob.concepts.perceived.examples import Example, words_of
from vrdp_prob.concepts.perceived.lessons import LESSONS, Taught
from vrdp_prob.concepts.perceived.network import ConceptNetwork
from vrdp_prob.concepts.perceived.standing import Standing
from vrdp_prob.concepts.perceived.training import train
from vrdp_prob.concepts.perceived.vocabulary import Vocabulary
from vrdp_prob.errors import InputError
from vrdp_prob.inference.runs.checkpoint import Checkpoint
from vrdp_prob.plain_words import several
from vrdp_prob.progress import ProgressDisplay, SilentProgress
from vrdp_prob.randomness import seeded

NETWORKS = 5
"""Networks that learn the same words; each holds out another part of the videos, and together they hold out all."""
_HARDLY = 0.05
"""Answers that are right by so little more than by guessing may as well contradict the videos."""


@dataclass(frozen=True)
class Learned:
    """Concepts, and what the person who had them learned should know.

    Parameters
    ----------
    concepts
        The concepts.
    notes
        Sentences on what was not learned.
    """

    concepts: Concepts
    notes: tuple[str, ...]

    @property
    def lines(self) -> list[str]:
        """What was learned, and the notes, one sentence a line."""
        lessons = self.concepts.lessons
        words = [word for known in self.concepts.vocabulary.values.values() for word in known]
        return [
            f"Learned from {several(lessons.videos, 'video')} and {several(lessons.examples, 'answer')}: "
            f"{', '.join(words)}.",
            _standing(lessons),
            *self.notes,
        ]


def _standing(lessons: Lessons) -> str:
    if lessons.attributes_right is None or lessons.events_right is None:
        return "With a single video nothing is held out, so nobody knows how good the concepts are."
    return (
        f"Of the answers about held-out videos {lessons.attributes_right:.0%} are right with the events of the tracks, "
        f"{lessons.events_right:.0%} with learned events, {lessons.guessed:.0%} by guessing. The same videos said when "
        "to stop, so new ones may do a little worse."
    )


def learn(
    videos: Mapping[str, Taught],
    *,
    seed: int = 0,
    device: str = "cpu",
    checkpoint: Checkpoint | None = None,
    progress: ProgressDisplay | None = None,
) -> Learned:
    """Learn concepts.

    Parameters
    ----------
    videos
        Videos with answers about them, by name.
    seed
        Seed of everything random in it.
    device
        Where the networks learn, as torch calls it: `cpu`, or a GPU as `cuda`. The same seed gives the same numbers on
        one device, and slightly other ones on another.
    checkpoint
        Keeps the state of the training; the same call, after an interruption, goes on from there and ends with the
        same numbers.
    progress
        Told of each epoch.

    Raises
    ------
    InputError
        If no word of an attribute occurs in the questions, or torch finds no such device.
    """
    check_device(device)
    examples = [example for one in videos.values() for example in one.examples]
    vocabulary = vocabulary_of(examples)
    taught, display = list(videos.values()), progress or SilentProgress()
    trained = [
        _trained(vocabulary, taught, place, seed=seed, device=device, kept=checkpoint, progress=display)
        for place in range(NETWORKS)
    ]
    # with few videos some networks hold out none, and stand where they do by what they learned
    right = [
        [one.right for one in standings] for place, (_, standings) in enumerate(trained) if _held_out(taught, place)
    ]
    attributes, events = np.mean(right, axis=0).tolist() if right else (None, None)
    lessons = Lessons(len(videos), len(examples), seed, _guessed(examples), attributes, events)
    concepts = Concepts(tuple(network for network, _ in trained), lessons)
    return Learned(concepts, _notes(concepts))


def check_device(device: str) -> None:
    """Refuse a device that torch does not know or does not find here.

    Raises
    ------
    InputError
        In these cases.
    """
    kind, _, number = device.partition(":")
    count = {"cpu": 1, "cuda": torch.cuda.device_count()}.get(kind, 0)
    if not (count and (not number or (number.isdecimal() and int(number) < count))):
        raise InputError(f"device '{device}': torch finds none of this name here; give cpu, or cuda for a GPU.")


def vocabulary_of(examples: Iterable[Example]) -> Vocabulary:
    """The words that questions use.

    Raises
    ------
    InputError
        If there is none for an attribute.
    """
    vocabulary = Vocabulary.of(words_of(examples))
    for name, words in vocabulary.values.items():
        if not words:
            raise InputError(
                f"no question has a word for a {name}, so none can be learned; add questions that use some."
            )
    return vocabulary


def _trained(
    vocabulary: Vocabulary,
    taught: Sequence[Taught],
    place: int,
    *,
    seed: int,
    device: str,
    kept: Checkpoint | None,
    progress: ProgressDisplay,
) -> tuple[ConceptNetwork, list[Standing]]:
    """One network, that holds out every fifth video, another fifth for each place."""
    held_out = _held_out(taught, place)
    rest = [one for one in taught if not any(one is other for other in held_out)] or list(taught)
    own_seed = seed * NETWORKS + place
    with seeded(own_seed):
        network = ConceptNetwork(vocabulary)
    network.measure([one.observation for one in taught])
    network.to(device)
    standings = []
    for lesson in LESSONS:
        file = None if kept is None else kept.path(f"network-{place}-{lesson.name}.pt")
        title = f"Learning {lesson.name}, {place + 1} of {NETWORKS}"
        with progress.stage(title, total=lesson.epochs) as advance:
            standings.append(train(network, lesson, rest, held_out, seed=own_seed, checkpoint=file, advance=advance))
    return network.cpu().eval(), standings


def _held_out(taught: Sequence[Taught], place: int) -> Sequence[Taught]:
    """The videos that a network does not learn from: every fifth, where there are several."""
    return taught[place::NETWORKS] if len(taught) > 1 else []


def _guessed(examples: Sequence[Example]) -> float:
    """Share of answers that are right when the commonest answer to questions that end alike is given."""
    answers: dict[str, Counter[str]] = {}
    for example in examples:
        answers.setdefault(example.program.tokens[-1], Counter())[example.answer] += 1
    return sum(max(count.values()) for count in answers.values()) / len(examples)


def _notes(concepts: Concepts) -> tuple[str, ...]:
    missing, lessons = concepts.vocabulary.missing, concepts.lessons
    notes = []
    if missing:
        one = len(missing) == 1
        notes.append(
            f"The word{'' if one else 's'} {', '.join(missing)} never occur{'s' if one else ''} in the questions; "
            f"{'it was' if one else 'they were'} not learned."
        )
    if lessons.attributes_right is not None and lessons.attributes_right < lessons.guessed + _HARDLY:
        notes.append(
            "The answers are hardly better explained than by guessing: there are too few of them, or they contradict "
            "what the videos show."
        )
    return tuple(notes)

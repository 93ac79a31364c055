"""Training of one network by answers: from short programs to long ones, stopped by questions about other videos."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import torch

from vrdp_prob.concepts.perceived.crop_statistics import crop_statistics
from vrdp_prob.concepts.perceived.lessons import Lesson, Taught
from vrdp_prob.concepts.perceived.lighting import relit
from vrdp_prob.concepts.perceived.losses import judge_softly
from vrdp_prob.concepts.perceived.network import Attributes, ConceptNetwork
from vrdp_prob.concepts.perceived.observation import Observation
from vrdp_prob.concepts.perceived.standing import See, Standing, facts_of, standing
from vrdp_prob.concepts.perceived.training_state import TrainingState
from vrdp_prob.progress import Advance
from vrdp_prob.randomness import seeded

_RATE, _DECAY = 3e-3, 1e-3
_STEPS = 5
"""Steps of the optimiser per epoch, however many videos there are."""
_PATIENCE = 12
"""Epochs without a better held-out loss, once all programs are in, after which training stops."""


def train(
    network: ConceptNetwork,
    lesson: Lesson,
    taught: Sequence[Taught],
    held_out: Sequence[Taught],
    *,
    seed: int,
    checkpoint: Path | None = None,
    advance: Advance | None = None,
) -> Standing:
    """Teach a network one lesson; it keeps the weights of the epoch that answers the held-out questions best.

    Parameters
    ----------
    network
        The network, which is changed.
    lesson
        What it learns.
    taught, held_out
        Videos to learn from, and videos that say when to stop; without any, the first ones do.
    seed
        Seed of everything random in it.
    checkpoint
        File that keeps the state after each epoch; training goes on from there with the same numbers.
    advance
        Told of each epoch.

    Returns
    -------
    Standing
        How well the held-out questions are answered.
    """
    optimiser = torch.optim.AdamW(lesson.parameters(network), lr=_RATE, weight_decay=_DECAY)
    state = TrainingState(network, optimiser, checkpoint)
    course = _Course(network, lesson, optimiser, taught, seed)
    see: See = _as_learned(network, [*taught, *held_out]) if lesson.learned_events else course.see
    longest = max(len(example.program.tokens) for one in taught for example in one.examples)
    while not _finished(state, lesson, longest):
        course.run_epoch(state.epoch, see)
        state.finish_epoch(standing(network, held_out or taught, see, learned_events=lesson.learned_events))
        if advance is not None:
            advance(1)
    network.load_state_dict(state.best)
    return state.standing


def _finished(state: TrainingState, lesson: Lesson, longest: int) -> bool:
    last = state.epoch - 1
    patient = lesson.longest_program(last) < longest or last - state.best_epoch < _PATIENCE
    return state.epoch >= lesson.epochs or not patient


def _as_learned(network: ConceptNetwork, videos: Sequence[Taught]) -> See:
    """The attributes that a network sees now, whatever it learns later."""
    network.eval()
    with torch.no_grad():
        seen = {id(one.observation): network.attributes_of([one.observation])[0] for one in videos}
    return lambda observations: [seen[id(one)] for one in observations]


@dataclass(frozen=True)
class _Course:
    """A lesson as it is given."""

    network: ConceptNetwork
    lesson: Lesson
    optimiser: torch.optim.Optimizer
    taught: Sequence[Taught]
    seed: int

    def run_epoch(self, epoch: int, see: See) -> None:
        """Go over the videos once; the randomness follows from the epoch alone, so that any epoch can be the next."""
        own_seed = (self.seed << 16) + epoch
        generator = torch.Generator().manual_seed(own_seed)
        with seeded(own_seed, self.network.device):
            for batch in _batches(self.taught, generator):
                self.network.train()
                self.optimiser.zero_grad()
                lit = see if self.lesson.learned_events else partial(self.see, generator=generator)
                losses = self._losses(batch, lit, self.lesson.longest_program(epoch))
                if losses:  # those of questions on which what is learned here has no bearing teach nothing
                    torch.autograd.backward(torch.stack(losses).mean())
                    self.optimiser.step()

    def see(self, observations: Sequence[Observation], *, generator: torch.Generator | None = None) -> list[Attributes]:
        """Attributes as the network sees them, under a light that the generator chooses."""
        if generator is None:
            return self.network.attributes_of(observations)
        lit = [crop_statistics(relit(one.pictures, generator)[one.there]) for one in observations]
        return self.network.attributes_of(observations, lit)

    def _losses(self, batch: Sequence[Taught], see: See, longest: float) -> list[torch.Tensor]:
        facts = facts_of(self.network, batch, see, learned_events=self.lesson.learned_events)
        losses = [
            judge_softly(example, seen).loss
            for one, seen in zip(batch, facts, strict=True)
            for example in one.examples
            if len(example.program.tokens) <= longest
        ]
        return [loss for loss in losses if loss.requires_grad]


def _batches(taught: Sequence[Taught], generator: torch.Generator) -> Iterator[list[Taught]]:
    order = torch.randperm(len(taught), generator=generator).tolist()
    size = math.ceil(len(order) / _STEPS)
    for begin in range(0, len(order), size):
        yield [taught[place] for place in order[begin : begin + size]]

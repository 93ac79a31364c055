"""Training of one network by answers: from short programs to long ones, stopped by questions about other videos."""

import math
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import torch

from vrdp_prob.concepts.perceived.lessons import Lesson, Taught
from vrdp_prob.concepts.perceived.lighting import relit
from vrdp_prob.concepts.perceived.losses import judge_softly
from vrdp_prob.concepts.perceived.network import ConceptNetwork
from vrdp_prob.concepts.perceived.standing import Standing, facts_of, standing
from vrdp_prob.concepts.perceived.training_state import TrainingState
from vrdp_prob.progress import Advance

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
    longest = max(len(example.program.tokens) for one in taught for example in one.examples)
    while not _finished(state, lesson, longest):
        _run_epoch(network, lesson, optimiser, taught, epoch=state.epoch, seed=seed)
        state.finish_epoch(standing(network, held_out or taught, learned_events=lesson.learned_events))
        if advance is not None:
            advance(1)
    network.load_state_dict(state.best)
    return state.standing


def _finished(state: TrainingState, lesson: Lesson, longest: int) -> bool:
    last = state.epoch - 1
    patient = lesson.longest_program(last) < longest or last - state.best_epoch < _PATIENCE
    return state.epoch >= lesson.epochs or not patient


def _run_epoch(
    network: ConceptNetwork,
    lesson: Lesson,
    optimiser: torch.optim.Optimizer,
    taught: Sequence[Taught],
    *,
    epoch: int,
    seed: int,
) -> None:
    """One pass over the videos; its randomness follows from seed and epoch alone, so that any epoch can be the next."""
    own_seed = (seed << 16) + epoch
    generator = torch.Generator().manual_seed(own_seed)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(own_seed)
        for batch in _batches(taught, generator):
            network.train()
            optimiser.zero_grad()
            losses = _losses(network, lesson, batch, lesson.longest_program(epoch), generator)
            if losses:
                torch.autograd.backward(torch.stack(losses).mean())
                optimiser.step()


def _losses(
    network: ConceptNetwork, lesson: Lesson, batch: Sequence[Taught], longest: float, generator: torch.Generator
) -> list[torch.Tensor]:
    if lesson.learned_events:  # the attributes stand: crops as they are, seen by all of the network
        network.appearance.eval()
    look = None if lesson.learned_events else partial(relit, generator=generator)
    facts = facts_of(network, batch, learned_events=lesson.learned_events, look=look)
    return [
        judge_softly(example, seen).loss
        for one, seen in zip(batch, facts, strict=True)
        for example in one.examples
        if len(example.program.tokens) <= longest
    ]


def _batches(taught: Sequence[Taught], generator: torch.Generator) -> Iterator[list[Taught]]:
    order = torch.randperm(len(taught), generator=generator).tolist()
    size = math.ceil(len(order) / _STEPS)
    for begin in range(0, len(order), size):
        yield [taught[place] for place in order[begin : begin + size]]

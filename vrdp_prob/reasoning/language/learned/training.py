"""Training of the learned parser on generated pairs."""

from collections.abc import Iterator, Sequence
from itertools import chain

import numpy as np
import torch
from jaxtyping import Int
from torch import Tensor

from vrdp_prob.progress import ProgressDisplay, SilentProgress
from vrdp_prob.randomness import seeded
from vrdp_prob.reasoning.language.learned.examples import Example, examples
from vrdp_prob.reasoning.language.learned.network import (
    BEGIN,
    END,
    KINDS,
    NOTHING,
    PADDING,
    ParserNetwork,
    Vocabulary,
    numbers_of_text,
)

EXAMPLES, STEPS, BATCH = 60_000, 5000, 64
"""Pairs that are generated, steps of the optimiser, and pairs in each step."""

PEAK_RATE = 4e-3
"""Highest learning rate; it rises for a tenth of the steps and falls to zero."""


def train(
    *, seed: int = 0, pairs: int = EXAMPLES, steps: int = STEPS, progress: ProgressDisplay | None = None
) -> tuple[ParserNetwork, Vocabulary]:
    """Train the parser.

    Parameters
    ----------
    seed
        Seed of the examples, the first weights and the order of the batches.
    pairs, steps
        Amount of examples and of training.
    progress
        Who follows it.

    Returns
    -------
    The trained network in evaluation mode, and its vocabulary.
    """
    generator = np.random.default_rng(seed)
    display = progress or SilentProgress()
    with display.stage("examples", total=pairs) as advance:
        pool = []
        for example in examples(pairs, generator):
            pool.append(example)
            advance(1)
    vocabulary = _vocabulary(pool)
    known = set(vocabulary.words)
    pool = [example for example in pool if known.issuperset(example.words)]
    with seeded(seed):
        return _fitted(pool, vocabulary, steps, generator, display), vocabulary


def _fitted(
    pool: Sequence[Example],
    vocabulary: Vocabulary,
    steps: int,
    generator: np.random.Generator,
    display: ProgressDisplay,
) -> ParserNetwork:
    """A network trained on the pool by the global random numbers of torch."""
    network = ParserNetwork(len(vocabulary.words), len(vocabulary.tokens))
    optimiser = torch.optim.AdamW(network.parameters(), lr=PEAK_RATE, weight_decay=0.01)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, PEAK_RATE, total_steps=steps, pct_start=0.1)
    with display.stage("training", total=steps) as advance:
        for _, batch in zip(range(steps), _batches(pool, generator), strict=False):
            text, program = _tensors(batch, vocabulary)
            log_probability = network(text, program[:, :-1])
            loss = torch.nn.functional.nll_loss(log_probability.transpose(1, 2), program[:, 1:], ignore_index=0)
            optimiser.zero_grad()
            torch.autograd.backward(loss)
            torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
            optimiser.step()
            schedule.step()
            advance(1)
    return network.eval()


def _vocabulary(pool: Sequence[Example]) -> Vocabulary:
    """Words of the texts that have a program, and tokens of these programs."""
    sense = [example for example in pool if example.program is not None]
    words = sorted(set(chain.from_iterable(example.words for example in sense)))
    tokens = sorted(set(chain.from_iterable(example.program or () for example in sense)))
    return Vocabulary((PADDING, *KINDS, *words), (PADDING, BEGIN, END, NOTHING, *tokens))


def _batches(pool: Sequence[Example], generator: np.random.Generator) -> Iterator[list[Example]]:
    """Batches without end; those of one batch are about equally long, which saves most of the padding."""
    while True:
        order = generator.permutation(len(pool))
        for start in range(0, len(order), 16 * BATCH):
            chunk = sorted((pool[place] for place in order[start : start + 16 * BATCH]), key=_length)
            parts = [chunk[place : place + BATCH] for place in range(0, len(chunk), BATCH)]
            for place in generator.permutation(len(parts)):
                yield parts[place]


def _length(example: Example) -> tuple[int, int]:
    return len(example.program or ()), len(example.words)


def _tensors(
    batch: Sequence[Example], vocabulary: Vocabulary
) -> tuple[Int[Tensor, "text word"], Int[Tensor, "text token"]]:
    numbers = {token: number for number, token in enumerate(vocabulary.tokens)}
    texts = [torch.tensor(numbers_of_text(example.kind, example.words, vocabulary)) for example in batch]
    programs = [
        torch.tensor([numbers[token] for token in (BEGIN, *(example.program or (NOTHING,)), END)]) for example in batch
    ]
    return (
        torch.nn.utils.rnn.pad_sequence(texts, batch_first=True),
        torch.nn.utils.rnn.pad_sequence(programs, batch_first=True),
    )

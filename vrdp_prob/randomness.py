"""Torch's own random numbers, from a seed and without a trace."""

from collections.abc import Iterator
from contextlib import contextmanager

import torch


@contextmanager
def seeded(seed: int, device: str | torch.device = "cpu") -> Iterator[None]:
    """Within it, torch draws from a seed; afterwards all generators are as they were.

    Parameters
    ----------
    seed
        Seed of the processor's generator, and of the device's.
    device
        Where numbers are drawn besides the processor: `cpu` for nowhere else, or a GPU as torch calls it.
    """
    place = torch.device(device)
    gpus = [place] if place.type == "cuda" else []
    with torch.random.fork_rng(devices=gpus):
        torch.default_generator.manual_seed(seed)  # torch.manual_seed would set every GPU's generator as well
        for gpu in gpus:
            with torch.cuda.device(gpu):
                torch.cuda.manual_seed(seed)
        yield

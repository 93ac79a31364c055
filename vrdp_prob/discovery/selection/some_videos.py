"""Some of many videos, for what takes too long in all."""

import numpy as np


def evenly_spread(some: int, count: int) -> list[int]:
    """Numbers of some of the videos, the first and the last among them.

    Parameters
    ----------
    some, count
        How many, of how many.
    """
    return np.linspace(0, count - 1, some).round().astype(int).tolist()

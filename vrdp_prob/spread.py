"""Some of many, at even distances."""

import numpy as np
from jaxtyping import Int


def evenly_spread(some: int, count: int) -> Int[np.ndarray, "chosen"]:
    """Numbers of some of so many things, the first and the last among them, as long as there are two.

    Parameters
    ----------
    some, count
        How many, of how many; all where there are no more.
    """
    return np.linspace(0, count - 1, min(some, count)).round().astype(int)

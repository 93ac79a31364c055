"""Third differences of what was measured, which hold noise and hardly any motion."""

import numpy as np
from jaxtyping import Float

FEWEST = 8
"""Third differences below which nothing is said of the noise."""
WINDOW = 4
"""Frames of a third difference."""
NORMAL_MAD = 0.6745
"""Median of the absolute value of a standard normal number."""


def third_difference(times: Float[np.ndarray, "window frame"]) -> Float[np.ndarray, "window frame"]:
    """Weights of the frames of each window in their third divided difference, whose squares add up to 1.

    Motion at a constant acceleration adds nothing to such differences, however far apart the frames are.
    """
    apart = times[:, :, None] - times[:, None, :]
    apart[:, np.arange(WINDOW), np.arange(WINDOW)] = 1.0
    weights = 1 / apart.prod(axis=-1)
    return np.asarray(weights / np.linalg.norm(weights, axis=-1, keepdims=True))

"""Places at which a search for an effect begins."""

from collections.abc import Sequence
from itertools import product

import numpy as np

from vrdp_prob.scene import Tracks


def places_around(videos: Sequence[Tracks], shares: Sequence[float]) -> list[tuple[float, float]]:
    """Points of a grid over the region where bodies were seen.

    Parameters
    ----------
    videos
        What was seen.
    shares
        Coordinates of the grid along each axis, in half widths of the region from its middle.
    """
    seen = np.concatenate([one.positions[one.seen] for one in videos])
    low, high = seen.min(axis=0), seen.max(axis=0)
    middle, half = (low + high) / 2, (high - low) / 2
    return [(float(middle[0] + u * half[0]), float(middle[1] + v * half[1])) for u, v in product(shares, shares)]


def visited(videos: Sequence[Tracks], step: float) -> list[tuple[float, float]]:
    """Points of a square grid, `step` m apart, near which a body was seen."""
    seen = np.concatenate([one.positions[one.seen] for one in videos])
    cells = np.unique(np.round(seen / step).astype(int), axis=0)
    return [(float(x * step), float(y * step)) for x, y in cells]

"""Positions that lie far off those before and after: gross outliers, found before anything is fitted."""

import numpy as np
from jaxtyping import Bool, Float

from vrdp_prob.scene import Tracks

FARTHEST = 7.0
"""A position is an outlier if all that its neighbours predict for it is farther off than so many standard deviations.
A contact between two frames leaves the prediction from at least one side intact."""
ROUNDS = 3
FEWEST_LEFT = 4
"""Positions of a body that are kept in any case."""
PREDICTIONS = ((-2, -1), (-1, 1), (1, 2))
"""Neighbours, counted in seen frames, through which a straight line predicts a position."""


def gross_outliers(tracks: Tracks, sd: Float[np.ndarray, "time body"]) -> Bool[np.ndarray, "time body"]:
    """Which positions are gross outliers, for measurement noise of a standard deviation (m) per axis each."""
    found = np.zeros(tracks.seen.shape, dtype=bool)
    for body in range(len(tracks.bodies)):
        seen = np.flatnonzero(tracks.seen[:, body])
        for _ in range(ROUNDS):
            kept = seen[~found[seen, body]]
            new = _far_off(tracks.times[seen], tracks.positions[seen, body], ~found[seen, body], sd[seen, body])
            new &= ~found[seen, body]
            if not new.any() or len(kept) - int(new.sum()) < FEWEST_LEFT:
                break
            found[seen[new], body] = True
    return found


def without(tracks: Tracks, outliers: Bool[np.ndarray, "time body"]) -> Tracks:
    """The tracks as if outliers had not been seen."""
    if not outliers.any():
        return tracks
    data = tracks.data.copy()
    for axis in ("x", "y"):
        data[axis] = data[axis].where(~outliers)
    return Tracks(tracks.video, tracks.bodies, data, tracks.walls, tracks.camera)


def _far_off(
    times: Float[np.ndarray, "seen"],
    positions: Float[np.ndarray, "seen 2"],
    trusted: Bool[np.ndarray, "seen"],
    sd: Float[np.ndarray, "seen"],
) -> Bool[np.ndarray, "seen"]:
    """Positions that no pair of trusted neighbours predicts."""
    count = len(times)
    good = np.flatnonzero(trusted)
    nearest = np.full(count, np.inf)
    for place in range(count):
        before = good[good < place]
        after = good[good > place]
        for offsets in PREDICTIONS:
            chosen = [
                before[offset] if offset < 0 else after[offset - 1]
                for offset in offsets
                if len(before if offset < 0 else after) >= abs(offset)
            ]
            if len(chosen) < len(offsets):
                continue
            first, second = chosen
            share = (times[place] - times[first]) / (times[second] - times[first])
            predicted = (1 - share) * positions[first] + share * positions[second]
            spread = np.linalg.norm([sd[place], share * sd[second], (1 - share) * sd[first]])
            nearest[place] = min(nearest[place], float(np.linalg.norm(positions[place] - predicted) / spread))
    return np.isfinite(nearest) & (nearest > FARTHEST)

"""Positions that lie far off those before and after: gross outliers, found before anything is fitted."""

import numpy as np
from jaxtyping import Bool, Float

from vrdp_prob.inference.search.free_flight import contact_distances
from vrdp_prob.scene import Tracks

FARTHEST = 7.0
"""A position is an outlier if all that its neighbours predict for it is farther off than so many standard deviations.
A contact between two frames leaves the prediction from at least one side intact."""
OVERSHOOT = 1.5
"""A soft contact may throw a body back faster than it leaves, by so much of half the change of its velocity."""
ROUNDS = 3
FEWEST_LEFT = 4
"""Positions of a body that are kept in any case."""
FEWEST_KNOWN = 8
"""Positions of a body from which its speeds are known to be no errors of the tracker."""
NEIGHBOURS = 2
"""Positions next to one at the beginning or the end of a track through which it is predicted."""
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
    fastest = max((_fastest(tracks, body, ~found[:, body]) for body in range(len(tracks.bodies))), default=0.0)
    for body in np.flatnonzero(found.any(axis=0)).tolist():
        seen = np.flatnonzero(tracks.seen[:, body])
        motion = _may_be_motion(
            tracks.times[seen],
            tracks.positions[seen, body],
            found[seen, body],
            sd[seen, body],
            fastest,
            meets=_meets_at_its_ends(tracks, body, ~found, fastest),
        )
        found[seen[motion], body] = False
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


def _may_be_motion(
    times: Float[np.ndarray, "seen"],
    positions: Float[np.ndarray, "seen 2"],
    outliers: Bool[np.ndarray, "seen"],
    sd: Float[np.ndarray, "seen"],
    fastest: float,
    *,
    meets: tuple[bool, bool],
) -> Bool[np.ndarray, "seen"]:
    """Outliers, one or several in a row, that may well be motion.

    Through some a body goes over from its velocity before to that after: a soft contact. Others are all that was seen
    of a body before its first contact or after its last one, where it is not much faster than anything else; a single
    position is if the body `meets` something there, at its first or last frames.
    """
    found = np.zeros(len(times), dtype=bool)
    velocity = np.diff(positions, axis=0) / np.diff(times)[:, None]
    velocity_sd = np.hypot(sd[1:], sd[:-1]) / np.diff(times)
    edges = np.flatnonzero(np.diff(outliers, prepend=False, append=False))
    for first, end in edges.reshape(-1, 2):
        if first > 1 and end + 1 < len(times) and not outliers[first - 2] and not outliers[end + 1]:
            middle = (velocity[first - 2] + velocity[end]) / 2
            reach = float(np.linalg.norm(velocity[end] - velocity[first - 2])) / 2
        elif (first == 0 or end == len(times)) and (end - first > 1 or meets[int(first > 0)]):
            middle, reach = np.zeros(2), fastest
        else:
            continue
        inside = slice(max(first - 1, 0), end)
        distance = np.linalg.norm(velocity[inside] - middle, axis=-1)
        found[first:end] = (distance <= OVERSHOOT * reach + FARTHEST * velocity_sd[inside]).all()
    return found


def _meets_at_its_ends(
    tracks: Tracks, body: int, trusted: Bool[np.ndarray, "time body"], fastest: float
) -> tuple[bool, bool]:
    """Whether a body may meet another one, or a wall, about its first trusted positions, and about its last ones."""
    own, step = tracks.bodies[body], float(np.median(np.diff(tracks.times)))
    if own.radius is None:
        return False, False
    farthest = own.radius * own.shape.reach

    def near(frame: int) -> bool:
        place = tracks.positions[frame, body]
        gaps = [wall.distance(place) - farthest for wall in tracks.walls]
        for other, one in enumerate(tracks.bodies):
            touching = contact_distances(own, one)
            if other != body and touching is not None and tracks.seen[frame, other] and trusted[frame, other]:
                gaps.append(float(np.linalg.norm(tracks.positions[frame, other] - place)) - touching[1])
        return min(gaps, default=np.inf) < fastest * step

    frames = np.flatnonzero(tracks.seen[:, body] & trusted[:, body]).tolist()
    return any(near(frame) for frame in frames[:NEIGHBOURS]), any(near(frame) for frame in frames[-NEIGHBOURS:])


def _fastest(tracks: Tracks, body: int, trusted: Bool[np.ndarray, "time"]) -> float:
    """Largest speed (m/s) that a body keeps from one trusted position to the next and on to the one after."""
    seen = np.flatnonzero(tracks.seen[:, body])
    if len(seen) < FEWEST_KNOWN:
        return 0.0
    speed = np.linalg.norm(np.diff(tracks.positions[seen, body], axis=0), axis=-1) / np.diff(tracks.times[seen])
    speed[~(trusted[seen[1:]] & trusted[seen[:-1]])] = 0.0
    return float(np.minimum(speed[1:], speed[:-1]).max(initial=0.0))

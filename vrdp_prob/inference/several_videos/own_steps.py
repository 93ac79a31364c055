"""What each of several videos finds by itself where shared numbers stay: its own steps, and other sides of edges."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from vrdp_prob.inference.runs.parallel import in_parallel
from vrdp_prob.inference.several_videos.arrow import Expansion
from vrdp_prob.inference.several_videos.climb_state import EXPECTED, State
from vrdp_prob.inference.several_videos.joint_fit import settle
from vrdp_prob.inference.several_videos.linking import LinkedVideo

OWN_SHARES = np.array([1.0, 0.3, 0.1])
"""Shares of its own Newton step among which each video chooses."""
CLOUD, SPREADS = 64, (0.1, 0.3)
"""Own numbers that are tried on either side of an edge, for each of these shares of their standard deviations..."""
FINISHED = 3
"""...and how many of them, the best ones, go on from there."""


def settled(videos: Sequence[LinkedVideo], state: State, expansions: Sequence[Expansion]) -> State:
    """Each video at the best that its own Newton step leads to."""
    locals_, values = [], []
    for video, local, value, one in zip(videos, state.locals, state.values, expansions, strict=True):
        steps = OWN_SHARES[:, None] * one.local_step
        if one.at_edge:
            steps = np.concatenate([steps, _bent_steps(video, state.shared, local, value, one)])
        found = _values(video, state.shared, local + steps)
        best = int(found.argmax())
        locals_.append(local + steps[best] if found[best] > value else local)
        values.append(max(float(found[best]), value))
    return replace(state, locals=tuple(locals_), values=tuple(values))


def _bent_steps(
    video: LinkedVideo,
    shared: Float[np.ndarray, "shared"],
    local: Float[np.ndarray, "local"],
    value: float,
    expansion: Expansion,
) -> Float[np.ndarray, "trial local"]:
    """Steps made of those parts of the Newton step that bring something by themselves.

    A few directions in which the density bends spoil the whole step, and damping it would hold back the flattest
    directions most: a common factor on all masses, say, that only their priors know.
    """
    parts = expansion.separate_steps
    trials = OWN_SHARES[:, None, None] * parts
    gains = _values(video, shared, local + trials.reshape(-1, len(local))).reshape(trials.shape[:2]) - value
    best = gains.argmax(axis=0)
    brings = gains.max(axis=0) > 0
    chosen = trials[best, np.arange(len(parts))]
    return np.concatenate([OWN_SHARES[:, None] * chosen[brings].sum(axis=0), chosen[[int(gains.max(axis=0).argmax())]]])


def across_edges(videos: Sequence[LinkedVideo], state: State, expansions: Sequence[Expansion]) -> State:
    """The state with each video whose own Newton step promised something at the best of a cloud around it."""

    def best(index: int) -> Float[np.ndarray, "_"]:
        video, own, expansion = videos[index], state.locals[index], expansions[index]
        if expansion.promised < EXPECTED:
            return own
        found = best_of_cloud(video, state.shared, own, expansion.local_root, own)
        return found if video.value(state.shared, found) > state.values[index] else own

    return State.at(videos, state.shared, in_parallel(best, range(len(videos))))


def best_of_cloud(
    video: LinkedVideo,
    shared: Float[np.ndarray, "shared"],
    centre: Float[np.ndarray, "local"],
    root: Float[np.ndarray, "local local"],
    known: Float[np.ndarray, "local"],
) -> Float[np.ndarray, "local"]:
    """Own numbers that are the best of those known and of what becomes of a cloud around a centre."""
    directions = np.random.default_rng(0).standard_normal((CLOUD, len(centre))) @ root.T
    cloud = np.concatenate([centre + share * directions for share in SPREADS])
    promising = np.argsort(-_values(video, shared, cloud))[:FINISHED]
    return settle(video, shared, [known, *cloud[promising]])


def _values(
    video: LinkedVideo, shared: Float[np.ndarray, "shared"], locals_: Float[np.ndarray, "trial local"]
) -> Float[np.ndarray, "trial"]:
    return video.log_density(np.tile(shared, (len(locals_), 1)), locals_)

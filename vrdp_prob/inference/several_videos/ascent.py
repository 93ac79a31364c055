"""The way up to the most probable values of several videos at once.

Each video is expanded by itself, its own numbers are eliminated, the shared numbers take one common step, and every
video follows them along its own ridge. So memory holds one batch of worlds per processor at a time. A ridge may run
along an edge, where a contact just happens, and is then looked for on both sides of it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float

from vrdp_prob.inference.runs.journal import kept
from vrdp_prob.inference.runs.parallel import in_parallel
from vrdp_prob.inference.several_videos.arrow import STEEP, Expansion, Expansions
from vrdp_prob.inference.several_videos.climb_state import EXPECTED, TOLERANCE, State, with_best_noise
from vrdp_prob.inference.several_videos.joint_fit import JointFit, expand_all, follow_or_settle, settle
from vrdp_prob.inference.several_videos.linking import LinkedVideo, SharedNumbers
from vrdp_prob.inference.several_videos.own_steps import across_edges, best_of_cloud, settled

SHARES = (1.0, 0.3, 0.1, 0.02)
"""Shares of a common step that are tried, one after the other, until one brings something."""
STEPS = 30
"""Steps in which a video follows a common step; where they are not enough, that was too long."""
STUCK = 0.01
"""Share of what is expected of a common step below which a search ends where no share of that brings anything: some
video stands in its way, whichever side of its edges it is on, and what the others find by themselves changes little."""
HALF = 0.5
"""Share of what is expected of a common step below which a trial looks on both sides of edges before it ends."""
TOO_DEAR = 2.0
"""How many times what a common step is expected to bring, or `STEEP`, one video may lose by it; if more, others are not
looked at."""
MOVED, MOST_HELD = 0.5, 2
"""Standard deviations by which a common step has to move a number for that to be held instead, and how many are."""
LEFT_RIDGE = 2.0
"""Nats that a video may lose on the way along its ridge before it is taken to have left it over an edge."""


@dataclass(frozen=True)
class Effort:
    """How long a search goes on.

    Parameters
    ----------
    rounds
        Common steps, at most.
    enough
        Gain (nats) of a step below which no further one is made.
    """

    rounds: int = 15
    enough: float = TOLERANCE


WHOLE = Effort()
"""To the top."""


@dataclass(frozen=True)
class _Ridges:
    """Where videos come that follow a change of the shared numbers; each way is gone once.

    Parameters
    ----------
    videos
        The videos.
    ends
        Where each way that was gone has led.
    hindering
        Videos that lost too much with a share of a common step, the worst first.
    """

    videos: Sequence[LinkedVideo]
    ends: dict[tuple[int, bytes, bytes, bytes], Float[np.ndarray, "_"]] = field(default_factory=dict)
    hindering: dict[float, list[int]] = field(default_factory=dict)

    def end(
        self,
        index: int,
        shared: Float[np.ndarray, "shared"],
        own: Float[np.ndarray, "local"],
        target: Float[np.ndarray, "shared"],
    ) -> Float[np.ndarray, "local"]:
        """Best own numbers of a video at other shared numbers."""
        way = (index, shared.tobytes(), own.tobytes(), target.tobytes())
        if way not in self.ends:
            self.ends[way] = follow_or_settle(self.videos[index], shared, own, target, steps=STEPS)
        return self.ends[way]


@kept
def climb(
    numbers: SharedNumbers,
    videos: Sequence[LinkedVideo],
    shared: Float[np.ndarray, "shared"],
    locals_: Sequence[Float[np.ndarray, "_"]],
    *,
    towards: Float[np.ndarray, "shared"] | None = None,
    least: float | None = None,
    effort: Effort = WHOLE,
) -> JointFit:
    """Climb the joint log posterior.

    Parameters
    ----------
    numbers, videos
        What is fitted.
    shared, locals_
        Where to begin.
    towards
        Shared numbers to which the first step goes, as far as it goes up.
    least
        Log posterior that the videos must reach by their own numbers alone, for the climb to be worth its while.
    effort
        How long the climb goes on.

    Raises
    ------
    ImpossibleStartError
        If a video has no world at the start, or less than that is reached.
    """
    if least is not None:
        locals_ = in_parallel(lambda index: settle(videos[index], shared, [locals_[index]]), range(len(videos)))
    state, converged = with_best_noise(numbers, videos, State.at(videos, shared, locals_)), False
    if not state.total(numbers) > (-np.inf if least is None else least):
        raise state.impossible(videos)
    slopes = expand_all(numbers, videos, state.shared, state.locals)
    if towards is not None and not np.array_equal(towards, shared):
        state = _improved(numbers, _Ridges(videos), settled(videos, state, slopes.videos), towards - shared)
        slopes = expand_all(numbers, videos, state.shared, state.locals)
    refused = -np.inf
    for _ in range(effort.rounds):
        inside = _inside(slopes)
        inner = smooth(slopes)
        expected = inner.expected_gain
        trial, ridges = settled(videos, state, slopes.videos), _Ridges(videos)
        at_edges = _gained(trial, state, ~inside)
        converged = expected < TOLERANCE and at_edges < TOLERANCE
        if converged:
            break
        if expected > TOLERANCE and at_edges < EXPECTED and trial.total(numbers) > refused + EXPECTED:
            own = trial
            trial = _improved(numbers, ridges, own, inner.shared_step, expected)
            if trial is own:
                trial = _with_one_held(numbers, ridges, own, inner)
            if trial is own:
                refused = own.total(numbers)
        brought, enough = trial.total(numbers) - state.total(numbers), effort.enough
        if brought < max(TOLERANCE, min(effort.enough, HALF * expected)):
            own = across_edges(videos, trial, slopes.videos)
            trial = _improved(numbers, ridges, own, inner.shared_step, expected, around=slopes.videos)
            refused = -np.inf
            if trial is own:
                enough = max(enough, STUCK * expected)
        gain = trial.total(numbers) - state.total(numbers)
        if gain > 0:
            state = trial
            slopes = expand_all(numbers, videos, state.shared, state.locals)
        if gain < enough:
            converged = smooth(slopes).expected_gain < EXPECTED
            break
    gaussian = slopes.gaussian(state.shared, state.locals, numbers.logarithms)
    return JointFit(numbers, tuple(videos), gaussian, state.total(numbers), converged)


def _inside(slopes: Expansions) -> Bool[np.ndarray, "video"]:
    """Which videos are at a smooth maximum of their own numbers, more or less.

    Others are at an edge, and what they say there of the shared numbers is not to be believed.
    """
    return np.array([not one.at_edge for one in slopes.videos], dtype=bool)


def smooth(slopes: Expansions) -> Expansions:
    """The expansion of the videos that are inside; of all where none is."""
    inside = tuple(one for one, used in zip(slopes.videos, _inside(slopes), strict=True) if used)
    return Expansions(slopes.prior, inside) if inside else slopes


def _gained(trial: State, state: State, chosen: Bool[np.ndarray, "video"]) -> float:
    """What some of the videos have gained; as long as those at an edge gain much they would follow no common step."""
    return float((np.array(trial.values) - np.array(state.values))[chosen].sum())


def _improved(
    numbers: SharedNumbers,
    ridges: _Ridges,
    state: State,
    step: Float[np.ndarray, "shared"],
    expected: float = np.inf,
    *,
    around: Sequence[Expansion] | None = None,
) -> State:
    """The first share of a common step that brings something; where none does, the state itself.

    Videos that lost by far more than is `expected` of a step, with the same share in this round or else with the share
    before it, are looked at first.
    """
    before, most = state.total(numbers), TOO_DEAR * max(expected, STEEP)
    hindering: list[int] = []
    for share in SHARES:
        target = state.shared + share * step
        hindering = ridges.hindering.get(share, hindering)
        followed = _followed(ridges, state, target, around, first=hindering, most=most)
        if followed is None:
            continue
        trial = with_best_noise(numbers, ridges.videos, followed)
        if trial.total(numbers) > before:
            return trial
        lost = np.array(state.values) - np.array(trial.values)
        hindering = [int(index) for index in np.argsort(-lost) if lost[index] > most]
        ridges.hindering[share] = hindering
    return state


def _with_one_held(numbers: SharedNumbers, ridges: _Ridges, state: State, slopes: Expansions) -> State:
    """The state after the common step that promises most with one shared number held, of those that bring something.

    A number may be at an edge of some video, which no way along its own numbers avoids: where a contact just sticks,
    friction that is any less lets it slide. It is one that the step moves and hardly needs. What the others promise
    without it is not to be lost for that.
    """
    moved = np.abs(slopes.shared_step) > MOVED * np.linalg.norm(slopes.root, axis=1)
    held = [slopes.step_without(number) for number in np.flatnonzero(moved).tolist()] if len(numbers) > 1 else []
    worth = [one for one in held if one[1] > max(HALF * slopes.shared_gain, EXPECTED)]
    for step, expected in sorted(worth, key=lambda one: one[1], reverse=True)[:MOST_HELD]:
        found = _improved(numbers, ridges, state, step, expected)
        if found is not state:
            return found
    return state


def _followed(
    ridges: _Ridges,
    state: State,
    target: Float[np.ndarray, "shared"],
    around: Sequence[Expansion] | None,
    *,
    first: Sequence[int],
    most: float,
) -> State | None:
    """The state at other shared numbers, every video on its ridge; None where one that comes first loses too much.

    A video whose best own numbers are at an edge, where a contact just happens, leaves its ridge with the first step;
    where the expansions `around` the state are given, the ridge is looked for on both sides of where they say it is.
    """

    def found(index: int) -> Float[np.ndarray, "_"]:
        video, own = ridges.videos[index], state.locals[index]
        found = ridges.end(index, state.shared, own, target)
        if around is None or video.value(target, found) > state.values[index] - LEFT_RIDGE:
            return found
        expected = own + around[index].slope @ (target - state.shared)
        return best_of_cloud(video, target, expected, around[index].local_root, found)

    locals_ = {}
    for index in first:
        locals_[index] = found(index)
        if state.values[index] - ridges.videos[index].value(target, locals_[index]) > most:
            return None
    rest = [index for index in range(len(ridges.videos)) if index not in locals_]
    locals_ |= zip(rest, in_parallel(found, rest), strict=True)
    return State.at(ridges.videos, target, [locals_[index] for index in range(len(ridges.videos))])

"""The way up to the most probable values of several videos at once.

Each video is expanded by itself, its own numbers are eliminated, the shared numbers take one common step, and every
video follows them along its own ridge. So memory holds one batch of worlds per processor at a time. A ridge may run
along an edge, where a contact just happens, and is then looked for on both sides of it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import torch
from jaxtyping import Bool, Float
from scipy.optimize import minimize

from vrdp_prob.errors import InputError
from vrdp_prob.inference.runs.journal import kept
from vrdp_prob.inference.runs.parallel import in_parallel
from vrdp_prob.inference.search.noise_fit import NOISE_FIELDS, best_noise
from vrdp_prob.inference.several_videos.arrow import Expansion, Expansions
from vrdp_prob.inference.several_videos.joint_fit import JointFit, expand_all, expand_prior, follow_or_settle, settle
from vrdp_prob.inference.several_videos.linking import LinkedVideo, SharedNumbers

SHARES = (1.0, 0.3, 0.1, 0.02)
"""Shares of a common step that are tried, one after the other, until one brings something."""
OWN_SHARES = np.array([1.0, 0.3, 0.1])
"""Shares of its own Newton step among which each video chooses beforehand."""
STEPS = 30
"""Steps in which a video follows a common step; where they are not enough, that was too long."""
TOLERANCE = 0.2
"""Gain (nats) of a step, expected or real, below which a search ends..."""
EXPECTED = 1.0
"""...and has converged, if no more than so much was expected; where a common step brought nothing, none is tried until
the videos by themselves have gained as much."""
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
STEEP = 5.0
"""Gain (nats) that its own step promises a video which has just looked for its best own numbers, from which on it is
taken to be at an edge: where two orders of events meet, or a contact just happens."""
FELL = 2.0
"""Nats that a video may lose on the way along its ridge before it is taken to have left it over an edge."""
CLOUD, SPREADS = 64, (0.1, 0.3)
"""Own numbers that are tried on either side of an edge, for each of these shares of their standard deviations..."""
FINISHED = 3
"""...and how many of them, the best ones, go on from there."""


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


class ImpossibleStartError(Exception):
    """A search was to begin where the world of some video cannot be simulated, or where it is not worth its while.

    Its text names the videos that cannot be simulated.
    """


class NoCommonWorldError(ImpossibleStartError, InputError):
    """Some video has no world at what all of them say of the numbers that they share."""


@dataclass(frozen=True)
class State:
    """Where a climb is: shared numbers, those of each video, and the log density of each video."""

    shared: Float[np.ndarray, "shared"]
    locals: tuple[Float[np.ndarray, "_"], ...]
    values: tuple[float, ...]

    @classmethod
    def at(
        cls,
        videos: Sequence[LinkedVideo],
        shared: Float[np.ndarray, "shared"],
        locals_: Sequence[Float[np.ndarray, "_"]],
    ) -> "State":
        """That of some numbers."""
        values = (video.value(shared, local) for video, local in zip(videos, locals_, strict=True))
        return cls(shared, tuple(locals_), tuple(values))

    def impossible(self, videos: Sequence[LinkedVideo]) -> ImpossibleStartError:
        """What is raised where nothing can begin here: it names the videos that cannot be simulated."""
        values = zip(videos, self.values, strict=True)
        return ImpossibleStartError(", ".join(video.name for video, value in values if not np.isfinite(value)))

    def total(self, numbers: SharedNumbers) -> float:
        """Joint log posterior (nats, up to a constant)."""
        return float(numbers.log_prior(self.shared[None])[0]) + sum(self.values)


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
    state, converged = _with_best_noise(numbers, videos, State.at(videos, shared, locals_)), False
    if not state.total(numbers) > (-np.inf if least is None else least):
        raise state.impossible(videos)
    slopes = expand_all(numbers, videos, state.shared, state.locals)
    if towards is not None and not np.array_equal(towards, shared):
        settled = _settled(videos, state, slopes.videos)
        state = _improved(numbers, _Ridges(videos), settled, towards - shared)
        slopes = expand_all(numbers, videos, state.shared, state.locals)
    refused = -np.inf
    for _ in range(effort.rounds):
        inside = _inside(slopes)
        inner = smooth(slopes)
        expected = inner.expected_gain
        converged = expected < TOLERANCE
        if converged:
            break
        trial, ridges = _settled(videos, state, slopes.videos), _Ridges(videos)
        if _gained(trial, state, ~inside) < EXPECTED and trial.total(numbers) > refused + EXPECTED:
            own = trial
            trial = _improved(numbers, ridges, own, inner.shared_step, expected)
            if trial is own:
                trial = _with_one_held(numbers, ridges, own, inner)
            if trial is own:
                refused = own.total(numbers)
        brought, enough = trial.total(numbers) - state.total(numbers), effort.enough
        if brought < max(TOLERANCE, min(effort.enough, HALF * expected)):
            own = _across_edges(videos, trial, slopes.videos)
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
    return np.array([one.promised < STEEP for one in slopes.videos], dtype=bool)


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

    Videos that lost by far more than is `expected` of the step, with the same share before or with the one before it,
    are looked at first.
    """
    before, most = state.total(numbers), TOO_DEAR * max(expected, STEEP)
    hindering: list[int] = []
    for share in SHARES:
        target = state.shared + share * step
        hindering = ridges.hindering.get(share, hindering)
        followed = _followed(ridges, state, target, around, first=hindering, most=most)
        if followed is None:
            continue
        trial = _with_best_noise(numbers, ridges.videos, followed)
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
    worth = [one for one in held if one[1] > max(HALF * slopes.expected_gain, EXPECTED)]
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
        if around is None or video.value(target, found) > state.values[index] - FELL:
            return found
        expected = own + around[index].slope @ (target - state.shared)
        return _best_of_cloud(video, target, expected, around[index].local_root, found)

    locals_ = {}
    for index in first:
        locals_[index] = found(index)
        if state.values[index] - ridges.videos[index].value(target, locals_[index]) > most:
            return None
    rest = [index for index in range(len(ridges.videos)) if index not in locals_]
    locals_ |= zip(rest, in_parallel(found, rest), strict=True)
    return State.at(ridges.videos, target, [locals_[index] for index in range(len(ridges.videos))])


def _across_edges(videos: Sequence[LinkedVideo], state: State, expansions: Sequence[Expansion]) -> State:
    """The state with each video whose own Newton step promised something at the best of a cloud around it."""

    def best(index: int) -> Float[np.ndarray, "_"]:
        video, own, expansion = videos[index], state.locals[index], expansions[index]
        if expansion.promised < EXPECTED:
            return own
        found = _best_of_cloud(video, state.shared, own, expansion.local_root, own)
        return found if video.value(state.shared, found) > state.values[index] else own

    return State.at(videos, state.shared, in_parallel(best, range(len(videos))))


def _best_of_cloud(
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


def _settled(videos: Sequence[LinkedVideo], state: State, expansions: Sequence[Expansion]) -> State:
    """Each video at the best that its own Newton step leads to."""
    locals_, values = [], []
    for video, local, value, one in zip(videos, state.locals, state.values, expansions, strict=True):
        steps = OWN_SHARES[:, None] * one.local_step
        if one.promised > STEEP:
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


def _values(
    video: LinkedVideo, shared: Float[np.ndarray, "shared"], locals_: Float[np.ndarray, "trial local"]
) -> Float[np.ndarray, "trial"]:
    return video.log_density(np.tile(shared, (len(locals_), 1)), locals_)


def _with_best_noise(numbers: SharedNumbers, videos: Sequence[LinkedVideo], state: State) -> State:
    """The state with the most probable sizes of the noise for its worlds."""
    locals_ = []
    for video, local in zip(videos, state.locals, strict=True):
        own = video.likelihood.coordinates.mask(NOISE_FIELDS)
        own[video.shared_places] = False
        point = video.points(state.shared, local)
        locals_.append(video.split(best_noise(video.data, point, own))[1] if own.any() else local)
    columns = np.flatnonzero([field in NOISE_FIELDS for field, _ in numbers.keys])
    shared = _best_shared_noise(numbers, videos, state.shared, locals_, columns) if len(columns) else state.shared
    found = State.at(videos, shared, locals_)
    return found if found.total(numbers) > state.total(numbers) else state


def _best_shared_noise(
    numbers: SharedNumbers,
    videos: Sequence[LinkedVideo],
    shared: Float[np.ndarray, "shared"],
    locals_: Sequence[Float[np.ndarray, "_"]],
    columns: np.ndarray,
) -> Float[np.ndarray, "shared"]:
    """Shared numbers with the most probable noise for given worlds."""
    with torch.no_grad():
        discrepancies = [
            video.data.discrepancies(torch.from_numpy(video.points(shared, local)[None]))
            for video, local in zip(videos, locals_, strict=True)
        ]
    if not all(bool(torch.isfinite(one.positions).all()) for one in discrepancies):
        return shared

    def descend(values: Float[np.ndarray, "noise"]) -> tuple[float, Float[np.ndarray, "noise"]]:
        moved = shared.copy()
        moved[columns] = values
        prior = expand_prior(numbers, moved)
        loss, slope = -float(numbers.log_prior(moved[None])[0]), prior.gradient.copy()
        for video, local, one in zip(videos, locals_, discrepancies, strict=True):
            point = torch.from_numpy(video.points(moved, local)[None]).requires_grad_()
            value = video.data.log_density_given(one, point)[0]
            (gradient,) = torch.autograd.grad(value, point)
            loss -= float(value.detach())
            slope[video.shared_columns] -= gradient[0].numpy()[video.shared_places]
        return loss, slope[columns]

    result = minimize(descend, shared[columns], jac=True, method="L-BFGS-B", options={"maxiter": 30})
    moved = shared.copy()
    moved[columns] = result.x
    return moved

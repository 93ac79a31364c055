"""The way up to the most probable values of several videos: each video's own numbers follow the shared ones.

The shared numbers take Gauss-Newton steps, and after each every video looks for its own best numbers again, with
damping of its own (variable projection: Golub and Pereyra, SIAM J. Numer. Anal. 10, 1973). So a video whose events
change their order under a step finds back, or refuses the step, and the noise is not taken for larger meanwhile.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Bool, Float
from scipy.optimize import minimize

from vrdp_prob.inference.least_squares import minimise_all
from vrdp_prob.inference.noise_fit import NOISE_FIELDS, best_noise
from vrdp_prob.inference.parallel import in_parallel
from vrdp_prob.inference.several_videos.arrow import Expansions, grown
from vrdp_prob.inference.several_videos.joint_fit import JointFit, expand, expand_prior
from vrdp_prob.inference.several_videos.linking import LinkedVideo, SharedNumbers

SHARES = (1.0, 0.3, 0.1, 0.02)
"""Shares of a step that are tried until one goes up."""
ROUNDS = 20
LOCAL_ITERATIONS = 10
LOCAL_TOLERANCE = 0.02
"""Gain (nats) of a step of one video's own numbers at which it has converged."""
TOLERANCE = 0.05
"""Gain (nats) of a round below which the search has converged..."""
EXPECTED = 1.0
"""...if no more than this was expected of it."""
SUSPICIOUS_LOSS = 3.0
"""Loss (nats) of one video under a step from which on it also begins where it was."""


class ImpossibleStartError(Exception):
    """A search was to begin where the world of some video cannot be simulated."""


@dataclass(frozen=True)
class State:
    """Where a search is.

    Parameters
    ----------
    shared
        The shared numbers.
    locals
        Own numbers of each video.
    values
        Log density of each video, the prior of the shared numbers left out.
    """

    shared: Float[np.ndarray, "shared"]
    locals: tuple[Float[np.ndarray, "_"], ...]
    values: tuple[float, ...]


def climb(
    numbers: SharedNumbers,
    videos: Sequence[LinkedVideo],
    shared: Float[np.ndarray, "shared"],
    locals_: Sequence[Float[np.ndarray, "_"]],
    *,
    towards: Float[np.ndarray, "shared"] | None = None,
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

    Raises
    ------
    ImpossibleStartError
        If a video has no world at the start.
    """
    ascent = _Ascent(numbers, tuple(videos))
    state = ascent.settled(shared, [[one] for one in locals_], None)
    if not np.isfinite(ascent.total(state)):
        raise ImpossibleStartError
    if towards is not None and not np.array_equal(towards, shared):
        state = ascent.stepped(state, ascent.slopes(state), towards - shared) or state
    state = ascent.with_best_noise(state)
    converged = False
    for _ in range(ROUNDS):
        slopes = ascent.slopes(state)
        moved = ascent.stepped(state, slopes, np.where(ascent.noise, 0.0, slopes.shared_step))
        if moved is None:
            converged = slopes.expected_gain < EXPECTED
            break
        moved = ascent.with_best_noise(moved)
        gain = ascent.total(moved) - ascent.total(state)
        state = moved
        if gain < TOLERANCE:
            converged = slopes.expected_gain < EXPECTED
            break
    slopes = ascent.slopes(state, central=True)
    gaussian = slopes.gaussian(state.shared, state.locals, numbers.logarithms)
    return JointFit(numbers, tuple(videos), gaussian, ascent.total(state), converged)


@dataclass(frozen=True)
class _Ascent:
    """What is climbed."""

    numbers: SharedNumbers
    videos: tuple[LinkedVideo, ...]

    @property
    def noise(self) -> Bool[np.ndarray, "shared"]:
        """Which of the shared numbers are noise scales."""
        return np.array([field in NOISE_FIELDS for field, _ in self.numbers.keys], dtype=bool)

    def total(self, state: State) -> float:
        """Joint log posterior."""
        return float(self.numbers.log_prior(state.shared[None])[0]) + sum(state.values)

    def slopes(self, state: State, *, central: bool = False) -> Expansions:
        """Expansion of the density."""

        def one(index: int) -> object:
            return expand(self.videos[index], state.shared, state.locals[index], central=central)

        found = in_parallel(one, range(len(self.videos)))
        return Expansions(expand_prior(self.numbers, state.shared), tuple(found))  # type: ignore[arg-type]

    def stepped(self, state: State, slopes: Expansions, step: Float[np.ndarray, "shared"]) -> State | None:
        """The state after the largest share of a step of the shared numbers that goes up; None where none does."""
        for share in SHARES:
            departure = grown(share * step, self.numbers.logarithms)
            starts = [
                [own + one.slope @ departure + one.local_step]
                for own, one in zip(state.locals, slopes.videos, strict=True)
            ]
            moved = self.settled(state.shared + share * step, starts, state)
            if self.total(moved) > self.total(state):
                return moved
        return None

    def settled(
        self,
        shared: Float[np.ndarray, "shared"],
        starts: Sequence[Sequence[Float[np.ndarray, "_"]]],
        before: State | None,
    ) -> State:
        """The state with given shared numbers where every video looks for its own best numbers."""

        def one(index: int) -> tuple[Float[np.ndarray, "_"], float]:
            video = self.videos[index]
            found = _settled(video, shared, starts[index])
            if before is not None and not found[1] > before.values[index] - SUSPICIOUS_LOSS:
                found = max(found, _settled(video, shared, [before.locals[index]]), key=lambda pair: pair[1])
            return found

        found = in_parallel(one, range(len(self.videos)))
        return State(shared, tuple(own for own, _ in found), tuple(value for _, value in found))

    def with_best_noise(self, state: State) -> State:
        """The state with the most probable shared noise scales for its worlds."""
        places = np.flatnonzero(self.noise)
        if not len(places):
            return state
        points = [video.points(state.shared, own) for video, own in zip(self.videos, state.locals, strict=True)]
        with torch.no_grad():
            left = [
                video.data.discrepancies(torch.from_numpy(point[None]))
                for video, point in zip(self.videos, points, strict=True)
            ]

        def with_noise(values: Float[np.ndarray, "noise"]) -> tuple[Float[np.ndarray, "shared"], list[float]]:
            shared = state.shared.copy()
            shared[places] = values
            moved = (video.points(shared, own) for video, own in zip(self.videos, state.locals, strict=True))
            with torch.no_grad():
                found = [
                    float(video.data.log_density_given(one, torch.from_numpy(point[None]))[0])
                    for video, one, point in zip(self.videos, left, moved, strict=True)
                ]
            return shared, found

        def cost(values: Float[np.ndarray, "noise"]) -> float:
            shared, found = with_noise(values)
            return -sum(found) - float(self.numbers.log_prior(shared[None])[0])

        options = {"xatol": 1e-3, "fatol": 1e-3, "maxfev": 200 * len(places)}
        best = minimize(cost, state.shared[places], method="Nelder-Mead", options=options)
        shared, found = with_noise(best.x)
        return replace(state, shared=shared, values=tuple(found))


def _settled(
    video: LinkedVideo, shared: Float[np.ndarray, "shared"], starts: Sequence[Float[np.ndarray, "local"]]
) -> tuple[Float[np.ndarray, "local"], float]:
    """Best own numbers of a video for given shared ones, from several starts, and its log density there."""
    coordinates = video.likelihood.coordinates
    own = np.zeros(len(coordinates), dtype=bool)
    own[video.local_places] = True
    noise = coordinates.mask(NOISE_FIELDS)
    minima = minimise_all(
        video.data.residuals,
        video.points(shared, np.array(starts)),
        video.data.coordinates.scale,
        active=own & ~noise,
        iterations=LOCAL_ITERATIONS,
        tolerance=LOCAL_TOLERANCE,
    )
    points = [one.point for one in minima]
    if (own & noise).any():
        points = [best_noise(video.data, point, own & noise) for point in points]
    locals_ = np.array([video.split(point)[1] for point in points])
    values = video.log_density(np.tile(shared, (len(locals_), 1)), locals_)
    best = int(np.argmax(values))
    return locals_[best], float(values[best])

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

from vrdp_prob.inference.least_squares import minimise
from vrdp_prob.inference.noise_fit import NOISE_FIELDS, best_noise
from vrdp_prob.inference.parallel import in_parallel
from vrdp_prob.inference.several_videos.arrow import Expansions, grown
from vrdp_prob.inference.several_videos.joint_fit import JointFit, expand, expand_prior
from vrdp_prob.inference.several_videos.linking import LinkedVideo, SharedNumbers

SHARES = (1.0, 0.3, 0.1, 0.02)
"""Shares of a step that are tried until one goes up."""
LOCAL_SHARES = (1.0, 0.3, 0.0)
"""Shares of a video's own Newton step that are tried."""
ENOUGH = 0.3
"""Share of the expected gain with which a step is taken as it is."""
STEEP = 5.0
"""Gain (nats) that its own step promises a video which has just looked for its best own numbers, from which on it is
taken to be at an edge: where two orders of events meet, or a contact just happens."""
ROUNDS = 12
LOCAL_ITERATIONS = 10
LONG = 60
"""The same for a video at an edge or in a narrow bend."""
LOCAL_TOLERANCE = 0.02
"""Gain (nats) of a step of one video's own numbers at which it has converged."""
TOLERANCE = 0.5
"""Gain (nats) of a step, by what is expected of it, below which the search has converged."""
EXPECTED = 1.0
"""The same where no step goes up."""
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
    state = ascent.settled(shared, locals_, None)
    if not np.isfinite(ascent.total(state)):
        raise ImpossibleStartError
    if towards is not None and not np.array_equal(towards, shared):
        state = ascent.stepped(state, ascent.slopes(state), towards - shared) or state
    state = ascent.with_best_noise(state)
    for _ in range(ROUNDS):
        slopes = ascent.slopes(state)
        inside = _inside(slopes)
        smooth = _of(slopes, inside)
        converged = smooth.expected_gain < TOLERANCE
        if converged:
            break
        moved = ascent.stepped(state, slopes, np.where(ascent.noise, 0.0, smooth.shared_step), ~inside)
        if moved is None:
            converged = smooth.expected_gain < EXPECTED
            break
        before, state = ascent.total(state), ascent.with_best_noise(moved)
        if ascent.total(state) - before < TOLERANCE:
            break
    slopes = ascent.slopes(state, central=True)
    gaussian = slopes.gaussian(state.shared, state.locals, numbers.logarithms)
    return JointFit(numbers, tuple(videos), gaussian, ascent.total(state), converged)


def _inside(slopes: Expansions) -> Bool[np.ndarray, "video"]:
    """Which videos are at a smooth maximum of their own numbers, more or less.

    Others are at an edge or in a narrow bend, and what they say there of the shared numbers is not to be believed.
    """
    promised = [-float(one.local_gradient @ one.local_step) / 2 for one in slopes.videos]
    inside = np.array([gain < STEEP for gain in promised])
    return inside if inside.any() else np.ones(len(inside), dtype=bool)


def _of(slopes: Expansions, chosen: Bool[np.ndarray, "video"]) -> Expansions:
    """The expansion of some of the videos."""
    return Expansions(slopes.prior, tuple(one for one, used in zip(slopes.videos, chosen, strict=True) if used))


@dataclass(frozen=True)
class _Ascent:
    """What is climbed."""

    numbers: SharedNumbers
    videos: tuple[LinkedVideo, ...]

    @property
    def noise(self) -> Bool[np.ndarray, "shared"]:
        """Which of the shared numbers are noise scales."""
        return np.array([field in NOISE_FIELDS for field, _ in self.numbers.keys], dtype=bool)

    def total(self, state: State, chosen: Bool[np.ndarray, "video"] | None = None) -> float:
        """Joint log posterior (of some of the videos)."""
        values = np.array(state.values)
        return float(self.numbers.log_prior(state.shared[None])[0]) + float(
            values.sum() if chosen is None else values[chosen].sum()
        )

    def slopes(self, state: State, *, central: bool = False) -> Expansions:
        """Expansion of the density."""

        def one(index: int) -> object:
            return expand(self.videos[index], state.shared, state.locals[index], central=central)

        found = in_parallel(one, range(len(self.videos)))
        return Expansions(expand_prior(self.numbers, state.shared), tuple(found))  # type: ignore[arg-type]

    def stepped(
        self,
        state: State,
        slopes: Expansions,
        step: Float[np.ndarray, "shared"],
        edge: Bool[np.ndarray, "video"] | None = None,
    ) -> State | None:
        """A state further up along a step of the shared numbers; None where no share of it goes up.

        Videos follow by their expansions alone where that brings about what was expected, else they search.
        """
        straight = self._straight(state, slopes, step)
        if self.total(straight) - self.total(state) > ENOUGH * slopes.expected_gain:
            return straight
        for share in SHARES:
            departure = grown(share * step, self.numbers.logarithms)
            starts = [
                own + one.slope @ departure + one.local_step
                for own, one in zip(state.locals, slopes.videos, strict=True)
            ]
            moved = self.settled(state.shared + share * step, starts, state, patient=edge)
            if self.total(moved) > self.total(state):
                return moved
        return None

    def _straight(self, state: State, slopes: Expansions, step: Float[np.ndarray, "shared"]) -> State:
        """The best state on the way of a step where each video takes a share of its own Newton step."""
        shares = np.array(SHARES)
        shared = state.shared + shares[:, None] * step
        departures = grown(shares[:, None] * step, self.numbers.logarithms)

        def one(index: int) -> tuple[Float[np.ndarray, "share local"], Float[np.ndarray, "share"]]:
            slope = slopes.videos[index]
            own = np.array(LOCAL_SHARES)[:, None] * slope.local_step
            starts = state.locals[index] + (departures @ slope.slope.T)[:, None] + own
            repeated = np.repeat(shared, len(LOCAL_SHARES), axis=0)
            found = self.videos[index].log_density(repeated, starts.reshape(len(repeated), -1))
            found = found.reshape(len(shares), -1)
            best = found.argmax(axis=1)
            return starts[np.arange(len(shares)), best], found.max(axis=1)

        found = in_parallel(one, range(len(self.videos)))
        totals = self.numbers.log_prior(shared) + np.sum([values for _, values in found], axis=0)
        best = int(np.argmax(np.where(np.isfinite(totals), totals, -np.inf)))
        return State(shared[best], tuple(own[best] for own, _ in found), tuple(float(v[best]) for _, v in found))

    def settled(
        self,
        shared: Float[np.ndarray, "shared"],
        starts: Sequence[Float[np.ndarray, "_"]],
        before: State | None,
        *,
        patient: Bool[np.ndarray, "video"] | None = None,
    ) -> State:
        """The state with given shared numbers where every video looks for its own best numbers, some for longer."""

        def one(index: int) -> tuple[Float[np.ndarray, "_"], float]:
            video = self.videos[index]
            iterations = LONG if patient is not None and patient[index] else LOCAL_ITERATIONS
            found = _settled(video, shared, starts[index], iterations)
            if before is not None and not found[1] > before.values[index] - SUSPICIOUS_LOSS:
                found = max(found, _settled(video, shared, before.locals[index], iterations), key=lambda pair: pair[1])
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
    video: LinkedVideo, shared: Float[np.ndarray, "shared"], start: Float[np.ndarray, "local"], iterations: int
) -> tuple[Float[np.ndarray, "local"], float]:
    """Best own numbers of a video for given shared ones, and its log density there."""
    coordinates = video.likelihood.coordinates
    own = np.zeros(len(coordinates), dtype=bool)
    own[video.local_places] = True
    noise = coordinates.mask(NOISE_FIELDS)
    point = minimise(
        video.data.residuals,
        video.points(shared, start),
        video.data.coordinates.scale,
        active=own & ~noise,
        iterations=iterations,
        tolerance=LOCAL_TOLERANCE,
    ).point
    if (own & noise).any():
        point = best_noise(video.data, point, own & noise)
    local = video.split(point)[1]
    return local, video.value(shared, local)

"""Where bodies lie still: between two contacts a body that stopped stays where it is, until something hits it.

Without this, the speed of a resting body is only known to be small; with it, it is zero.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float
from scipy.special import expit, logsumexp

from vrdp_prob.reasoning.chance import Random
from vrdp_prob.reasoning.smoother import Smoother

SLOW = 0.5
"""A body may have stopped at a time when its speed in m/s is estimated below this."""

CANDIDATE_SPACING = 0.08
SHORTEST_REST = 0.12
"""Spacing in s of the times at which a body may have stopped, and the shortest rest that is looked for."""

PRIOR_LOG_ODDS = -6.0
"""Log odds of a rest before its evidence, which compares with speeds of metres per second: most doubtful bodies are
slow, not fast."""

MARGIN = 1e-3
"""How far (s) a rest keeps from the contacts around it."""

CERTAIN = 7.0
"""Log odds beyond which a rest is taken for certain."""


@dataclass(frozen=True)
class Rest:
    """A stretch of time in which a body may lie still.

    Parameters
    ----------
    start, stop
        From when to when, in s.
    probability
        That it does.
    """

    start: float
    stop: float
    probability: float


def possible_rests(smoother: Smoother, *, until: float) -> tuple[Rest, ...]:
    """Rests of a body before the end of the video (s), at most one between two contacts."""
    first, last = float(smoother.track.times[0]), min(float(smoother.track.times[-1]), until)
    bounds = [first, *(kick for kick in smoother.kicks if first < kick < last), last]
    rests = [_rest(smoother, start, stop) for start, stop in pairwise(bounds)]
    return tuple(rest for rest in rests if rest is not None)


class DrawnMotion:
    """Draws of the whole motion of one body; in each draw it lies still in those rests that it has there.

    Parameters
    ----------
    smoother
        What its track and its contacts say.
    rests
        Where it may lie still.
    draws
        Number of draws.
    doubt
        Source of the draws of where it lies still.
    numbers
        Source of the draws of its motion.
    """

    def __init__(
        self, smoother: Smoother, rests: tuple[Rest, ...], draws: int, *, doubt: Random, numbers: Random
    ) -> None:
        chance = np.array([rest.probability for rest in rests])
        self.has_rest: Bool[np.ndarray, "draw rest"] = doubt.random((draws, len(rests))) < chance
        self._end = float(smoother.track.times[-1])
        self.rests_at_end: Bool[np.ndarray, "draw"] = np.zeros(draws, dtype=bool)
        self._smoother = smoother
        self._weights = numbers.standard_normal((draws, smoother.weight_count, 2))
        for pattern in np.unique(self.has_rest, axis=0):
            own = np.flatnonzero((self.has_rest == pattern).all(axis=1))
            chosen = tuple((rest.start, rest.stop) for rest, taken in zip(rests, pattern, strict=True) if taken)
            self._weights[own] = smoother.with_rests(chosen).weights(self._weights[own])
            self.rests_at_end[own] = any(stop >= self._end - 2 * MARGIN for _, stop in chosen)

    def state(
        self, times: Float[np.ndarray, "time"], *, before: bool = False
    ) -> tuple[Float[np.ndarray, "draw time 2"], Float[np.ndarray, "draw time 2"]]:
        """Position (m) and velocity (m/s); `before`: a contact at the very time has not happened yet."""
        place, rate = self._smoother.features(times, before=before)
        return np.einsum("tw,dwa->dta", place, self._weights), np.einsum("tw,dwa->dta", rate, self._weights)


def _rest(smoother: Smoother, start: float, stop: float) -> Rest | None:
    times = np.arange(start + MARGIN, stop - SHORTEST_REST, CANDIDATE_SPACING)
    if not len(times):
        return None
    speed = np.linalg.norm(smoother.state(times)[1], axis=1)
    slow = np.append(np.linalg.norm(smoother.state(np.array([stop - MARGIN]))[1], axis=1) < 2 * SLOW, True)
    if not slow.all():
        return None
    candidates = times[speed < SLOW]
    if not len(candidates):
        return None
    evidence = np.array([smoother.rest_evidence(float(time), stop - MARGIN) for time in candidates])
    log_odds = float(logsumexp(evidence) - np.log(len(candidates))) + PRIOR_LOG_ODDS
    if log_odds < -CERTAIN:
        return None
    best = float(candidates[evidence.argmax()])
    return Rest(best, stop - MARGIN, 1.0 if log_odds > CERTAIN else float(expit(log_odds)))

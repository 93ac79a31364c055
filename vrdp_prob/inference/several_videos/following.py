"""A video's own numbers at their best while the shared ones move: curved steps, each as long as the density allows.

Where bodies meet several times in a row own numbers are known to a millionth, and the ridge that they follow is so
curved that a step along its tangent leaves it at once. A step that bends with the residuals' second derivative goes
much further, and what it still leaves is mended before the next one. A step is only as long as what it brings is near
to what it promised, so that the order of events, which jumps, is kept. Source: Transtrum, Machta and Sethna, Geometry
of nonlinear least squares, Physical Review E 83 (2011), 036701; Allgower and Georg, Numerical Continuation Methods
(1990).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import qr, solve_triangular

from vrdp_prob.inference.search.least_squares import jacobian, robust_cost
from vrdp_prob.inference.search.noise_fit import NOISE_FIELDS
from vrdp_prob.inference.several_videos.linking import LinkedVideo

STRIDES = (1.0, 0.6, 0.3, 0.15, 0.07, 0.03, 0.015, 0.006, 0.002)
"""Shares of the way that one batch of worlds tries."""
MOST_STEPS = 100
"""Steps after which a video stays where it is."""
PATIENCE, HALF = 6, 0.5
"""A video stays where it is, too, if the pace of so many strides would leave more than this share of the way."""
ENOUGH = 0.03
"""Gain (nats) of the last step, after which no further one is made."""
SLACK = 20.0
"""A stride may cost so many nats more than its linear expansion promises..."""
SHARE = 0.2
"""...or this share of the change that it promises."""
PROBE = 0.1
"""Share of a step by which the second derivative along it is found."""


@dataclass(frozen=True)
class Followed:
    """Own numbers of a video for given shared ones.

    Parameters
    ----------
    local
        The numbers.
    arrived
        Whether they were reached along the ridge.
    """

    local: Float[np.ndarray, "local"]
    arrived: bool


def follow(
    video: LinkedVideo,
    shared: Float[np.ndarray, "shared"],
    local: Float[np.ndarray, "local"],
    target: Float[np.ndarray, "shared"],
    *,
    steps: int = MOST_STEPS,
) -> Followed:
    """Best own numbers of a video at a target, from those at other shared numbers.

    Parameters
    ----------
    video
        The video; its noise scales are held.
    shared, local
        Where to begin.
    target
        Shared numbers to go to.
    steps
        Steps after which it is given up.
    """
    places = np.setdiff1d(video.local_places, np.flatnonzero(video.likelihood.coordinates.mask(NOISE_FIELDS)))
    point, end = video.points(shared, local), video.points(target, local)
    strides: list[float] = []
    for left in reversed(range(steps)):
        missing = end - point
        missing[video.local_places] = 0.0
        arrived = not missing.any()
        tangent = _Tangent.at(video, point, places, central=arrived)
        cost = tangent.cost
        if not np.isfinite(cost):
            break
        stride, found, reached = tangent.best(missing)
        if reached < np.inf and (stride or reached < cost):
            point = found
        if arrived and not cost - reached > ENOUGH:
            return Followed(video.split(point)[1], arrived=True)
        strides += [stride] if stride else []
        if not arrived and (_too_slow(strides, left) or (not stride and not cost - reached > ENOUGH)):
            break
    end[video.local_places] = point[video.local_places]
    return Followed(video.split(end)[1], arrived=False)


def _too_slow(strides: Sequence[float], left: int) -> bool:
    """Whether the pace of the last strides, each a share of what was left of a way, is too slow for the steps left."""
    last = np.array(strides[-PATIENCE:])
    return len(last) == PATIENCE and float(np.prod(1 - last)) ** (left / PATIENCE) > HALF


@dataclass(frozen=True)
class _Tangent:
    """A video's residuals around a point, as a linear function of all its numbers.

    Parameters
    ----------
    video
        The video.
    places
        Its own numbers that move.
    point
        The point.
    residuals, derivative
        Values and derivative there.
    """

    video: LinkedVideo
    places: Int[np.ndarray, "own"]
    point: Float[np.ndarray, "dimension"]
    residuals: Float[np.ndarray, "residual"]
    derivative: Float[np.ndarray, "residual dimension"]

    @classmethod
    def at(
        cls, video: LinkedVideo, point: Float[np.ndarray, "dimension"], places: Int[np.ndarray, "own"], *, central: bool
    ) -> "_Tangent":
        scale = video.data.coordinates.scale
        residuals, derivative = jacobian(video.data.residuals, point, scale, central=central)
        lost = places[~derivative[:, places].any(axis=0)]
        rows = np.zeros((len(lost), len(point)))
        rows[np.arange(len(lost)), lost] = 1 / video.likelihood.coordinates.prior_sd[lost]
        return cls(video, places, point, np.pad(residuals, (0, len(lost))), np.concatenate([derivative, rows]))

    @property
    def cost(self) -> float:
        return float(robust_cost(self.residuals, None))

    @cached_property
    def _factors(self) -> tuple[Float[np.ndarray, "residual own"], Float[np.ndarray, "own own"]]:
        orthogonal, triangle = qr(self.derivative[:, self.places], mode="economic", check_finite=False)
        return orthogonal, triangle

    def _taken_up(self, residuals: Float[np.ndarray, "residual"]) -> Float[np.ndarray, "dimension"]:
        """Change of the own numbers that lowers residuals most."""
        orthogonal, triangle = self._factors
        change = np.zeros(len(self.point))
        change[self.places] = -solve_triangular(triangle, orthogonal.T @ residuals, check_finite=False)
        return change

    def best(self, missing: Float[np.ndarray, "dimension"]) -> tuple[float, Float[np.ndarray, "dimension"], float]:
        """Longest stride along a way, with the own numbers following, that does not cost more than it promises.

        Gives the stride, where it ends, and the cost there; where no stride will do, the best of the steps that the own
        numbers take alone. What the own numbers have to mend may be an edge away from where they are, so that the way
        is also gone without mending anything.
        """
        along, mend = missing + self._taken_up(self.derivative @ missing), self._taken_up(self.residuals)
        way = along + mend
        strides = np.array(STRIDES)[:, None]
        trials = [self.point + strides * way, self.point + strides * way + strides**2 * self._bend(way) / 2]
        if missing.any():
            trials += [self.point + strides * along, self.point + strides * mend]
        costs = robust_cost(self.video.data.residuals(np.concatenate(trials)), None).reshape(len(trials), -1)
        if not missing.any():
            return self._lowest(np.array(trials), costs)
        allowed = [self._allowed(one) for one in (way, way, along)]
        reached = np.where(costs[:3] <= allowed, costs[:3], np.inf)
        fine = np.flatnonzero(np.isfinite(reached).any(axis=0))
        if not len(fine):
            return self._lowest(trials[3][None], costs[3:])
        first = int(fine[0])
        better = int(reached[:, first].argmin())
        return STRIDES[first], trials[better][first], float(reached[better, first])

    def _allowed(self, way: Float[np.ndarray, "dimension"]) -> Float[np.ndarray, "stride"]:
        """What each stride along a way may cost."""
        line = self.residuals[:, None] + self.derivative @ (way[:, None] * np.array(STRIDES))
        promised = (line**2).sum(axis=0) / 2
        allowed: np.ndarray = promised + SLACK + SHARE * np.abs(promised - self.cost)
        return allowed

    @staticmethod
    def _lowest(
        trials: Float[np.ndarray, "way stride dimension"], costs: Float[np.ndarray, "way stride"]
    ) -> tuple[float, Float[np.ndarray, "dimension"], float]:
        way, stride = np.unravel_index(int(costs.argmin()), costs.shape)
        return 0.0, trials[way, stride], float(costs[way, stride])

    def _bend(self, way: Float[np.ndarray, "dimension"]) -> Float[np.ndarray, "dimension"]:
        """Second derivative of the own numbers along a way on which the residuals do not bend."""
        probe = self.video.data.residuals((self.point + PROBE * way)[None])[0]
        probe = np.pad(probe, (0, len(self.residuals) - len(probe)))
        second = 2 / PROBE * ((probe - self.residuals) / PROBE - self.derivative @ way)
        return self._taken_up(second) if np.isfinite(second).all() else np.zeros(len(way))

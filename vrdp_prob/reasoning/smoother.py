"""Where a body was and how fast, at any time, from its track and the moments at which something hit it.

No physics but this: between contacts a body's acceleration is bounded and changes slowly; a contact changes velocity
and acceleration at once. That is Bayesian linear regression on polynomials and ramps, so the state at every time comes
with its covariance, draws of it are cheap, and the evidence for one more contact has a closed form.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from vrdp_prob.models.roughness import noise_scale, position_sd
from vrdp_prob.scene import Tracks

POSITION_SD = 10.0
VELOCITY_SD = 3.0
ACCELERATION_SD = 0.8
"""Prior of a body's place (m), velocity (m/s) and acceleration (m/s^2) where its track begins."""

KICK_SD = 0.8
"""Prior standard deviation (m/s) of the velocity change in a contact."""

WANDER = 1.0
"""Variance that the acceleration gains per second between contacts, in (m/s^2)^2/s: bodies slip, roll and stop."""

KNOT_SPACING = 0.1
"""Spacing in s of the times at which the acceleration may change between contacts."""

REST_SPEED_SD = 0.005
"""How exactly (m/s) a body that came to rest rests."""

SMALLEST_NOISE = 1e-4
LIKELY_NOISE = 0.01
"""Standard deviation in m of a measured position: never taken to be below the first; the second where tracks are too
short to tell."""


@dataclass(frozen=True)
class BodyTrack:
    """The measured positions of one body.

    Parameters
    ----------
    times
        Times in s at which it was seen.
    positions
        Where, in m.
    noise
        Standard deviation in m of each position.
    """

    times: Float[np.ndarray, "seen"]
    positions: Float[np.ndarray, "seen 2"]
    noise: Float[np.ndarray, "seen"]


def body_tracks(tracks: Tracks) -> tuple[BodyTrack, ...]:
    """The tracks of all bodies with the noise that was measured with them, else estimated from third differences."""
    estimated = noise_scale(tracks)
    scale = max(estimated, SMALLEST_NOISE) if np.isfinite(estimated) else LIKELY_NOISE
    noise = position_sd(tracks, scale)
    positions, seen = tracks.positions, tracks.seen
    return tuple(
        BodyTrack(tracks.times[seen[:, body]], positions[seen[:, body], body], noise[seen[:, body], body])
        for body in range(len(tracks.bodies))
    )


@dataclass(frozen=True)
class OneMoreKick:
    """What a track says about one more contact, for each of several times.

    The log likelihood ratio of a velocity change k (m/s) against no contact is
    `evidence - precision |k|^2 / 2 + pull k`, with the change of the acceleration integrated out.

    Parameters
    ----------
    evidence
        See above; log density ratio.
    precision
        See above, in (m/s)^-2.
    pull
        See above, in (m/s)^-1.
    position, velocity
        Where the body is at that time, in m, and how fast it is just before, in m/s, if k = 0.
    position_shift, velocity_shift
        How they move with k (s, and dimensionless): the position is `position - position_shift k`.
    """

    evidence: Float[np.ndarray, "time"]
    precision: Float[np.ndarray, "time"]
    pull: Float[np.ndarray, "time 2"]
    position: Float[np.ndarray, "time 2"]
    velocity: Float[np.ndarray, "time 2"]
    position_shift: Float[np.ndarray, "time"]
    velocity_shift: Float[np.ndarray, "time"]

    def at(self, chosen: slice) -> "OneMoreKick":
        """The same for some of the times."""
        return OneMoreKick(*(getattr(self, entry.name)[chosen] for entry in fields(self)))

    def kicked(self, kick: Float[np.ndarray, "time 2"]) -> tuple[np.ndarray, np.ndarray]:
        """Position (m), and velocity (m/s) just before, if the velocity changes by `kick` (m/s) at each time."""
        return (
            self.position - self.position_shift[:, None] * kick,
            self.velocity - self.velocity_shift[:, None] * kick,
        )


@dataclass(frozen=True)
class Smoother:
    """The motion of one body given the times of its contacts.

    Parameters
    ----------
    track
        What was seen of it.
    kicks
        Times in s of its contacts.
    rests
        Stretches of time in s, from and to, in which it lies still.
    """

    track: BodyTrack
    kicks: tuple[float, ...] = ()
    rests: tuple[tuple[float, float], ...] = ()
    _knots: Float[np.ndarray, "knot"] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        first, last = self.track.times[0], self.track.times[-1]
        object.__setattr__(self, "_knots", np.arange(first + KNOT_SPACING, last, KNOT_SPACING))

    def with_kick(self, time: float) -> "Smoother":
        """The same body with one more contact."""
        return Smoother(self.track, tuple(sorted((*self.kicks, time))))

    def with_rests(self, rests: tuple[tuple[float, float], ...]) -> "Smoother":
        """The same body that lies still in some stretches of time."""
        return Smoother(self.track, self.kicks, rests)

    def state(
        self, times: Float[np.ndarray, "time"], *, before: bool = False
    ) -> tuple[Float[np.ndarray, "time 2"], Float[np.ndarray, "time 2"]]:
        """Mean position (m) and velocity (m/s); `before`: a contact at the very time has not happened yet."""
        place, rate = self.features(times, before=before)
        return place @ self._mean, rate @ self._mean

    def state_covariance(self, time: float, *, before: bool = False) -> Float[np.ndarray, "2 2"]:
        """Covariance of position (m) and velocity (m/s) along one axis, the same for x and y."""
        place, rate = self.features(np.array([time]), before=before)
        features = np.concatenate([place, rate])
        covariance: Float[np.ndarray, "2 2"] = features @ self._root @ (features @ self._root).T
        return covariance

    def weights(self, normal: Float[np.ndarray, "draw weight 2"]) -> Float[np.ndarray, "draw weight 2"]:
        """Draws of the weights from standard normal numbers; with `features` each is one smooth motion."""
        return np.asarray(self._mean + np.einsum("wk,dka->dwa", self._root, normal))

    def one_more(self, times: Float[np.ndarray, "time"]) -> "OneMoreKick":
        """What the track says about one more contact at each of the times."""
        ramp, bend = _ramps(self.track.times, times)
        precision = self._data_precision
        data = precision @ self.track.positions
        weighted_ramp, weighted_bend = precision @ ramp, precision @ bend
        ramp_ramp, ramp_bend = (ramp * weighted_ramp).sum(axis=0), (ramp * weighted_bend).sum(axis=0)
        bend_bend = (bend * weighted_bend).sum(axis=0)
        bend_data = bend.T @ data
        # the acceleration changes as well: it is integrated out
        held = 1 / (bend_bend + 1 / ACCELERATION_SD**2)
        evidence = 0.5 * held * (bend_data**2).sum(axis=1) + np.log(held / ACCELERATION_SD**2)
        slope = (ramp_bend * held)[:, None]
        means, shifts = [], []
        seen_place, _ = self.features(self.track.times)
        for features in self.features(times, before=True):
            to_seen = (features * self._prior_sd**2) @ seen_place.T
            to_ramp = (to_seen * weighted_ramp.T).sum(axis=1)
            to_bend = (to_seen * weighted_bend.T).sum(axis=1)
            means.append(features @ self._mean - (to_bend * held)[:, None] * bend_data)
            shifts.append(to_ramp - to_bend * ramp_bend * held)
        precision_of_kick = ramp_ramp - ramp_bend**2 * held
        return OneMoreKick(evidence, precision_of_kick, ramp.T @ data - slope * bend_data, *means, *shifts)

    def rest_evidence(self, start: float, stop: float) -> float:
        """Log Bayes factor for lying still from one time (s) to another, against not: the density ratio of speed 0."""
        _, rate = self.features(rest_times(start, stop))
        noise = REST_SPEED_SD**2 * np.eye(len(rate))
        spread = rate @ self._root
        return _log_density(rate @ self._mean, spread @ spread.T + noise) - _log_density(
            np.zeros((len(rate), 2)), (rate * self._prior_sd**2) @ rate.T + noise
        )

    @property
    def weight_count(self) -> int:
        """Number of weights."""
        return 3 + len(self._knots) + 2 * len(self.kicks)

    @cached_property
    def _prior_sd(self) -> Float[np.ndarray, "weight"]:
        knots, kicks = len(self._knots), len(self.kicks)
        wander = np.sqrt(WANDER * KNOT_SPACING)
        start = [POSITION_SD, VELOCITY_SD, ACCELERATION_SD]
        return np.array([*start, *[wander] * knots, *[KICK_SD] * kicks, *[ACCELERATION_SD] * kicks])

    @cached_property
    def _observed(self) -> Float[np.ndarray, "row weight"]:
        """What was seen, and the rests, as linear functions of the weights in units of the noise."""
        place, _ = self.features(self.track.times)
        rows = [place / self.track.noise[:, None]]
        for start, stop in self.rests:
            _, rate = self.features(rest_times(start, stop))
            rows.append(rate / REST_SPEED_SD)
        return np.concatenate(rows)

    @cached_property
    def _root(self) -> Float[np.ndarray, "weight weight"]:
        """A square root of the posterior covariance of the weights."""
        scaled = self._observed * self._prior_sd
        factor = np.linalg.cholesky(scaled.T @ scaled + np.eye(scaled.shape[1]))
        return np.asarray(self._prior_sd[:, None] * np.linalg.inv(factor).T)

    @cached_property
    def _mean(self) -> Float[np.ndarray, "weight 2"]:
        seen = len(self.track.times)
        measured = self._observed[:seen].T @ (self.track.positions / self.track.noise[:, None])
        return np.asarray(self._root @ (self._root.T @ measured))

    @cached_property
    def _data_precision(self) -> Float[np.ndarray, "seen seen"]:
        """Inverse covariance of the seen positions along one axis."""
        place, _ = self.features(self.track.times)
        scaled = place * self._prior_sd
        covariance = scaled @ scaled.T + np.diag(self.track.noise**2)
        return np.asarray(np.linalg.inv(covariance))

    def features(
        self, times: Float[np.ndarray, "time"], *, before: bool = False
    ) -> tuple[Float[np.ndarray, "time weight"], Float[np.ndarray, "time weight"]]:
        """Position and velocity at the times as linear functions of the weights."""
        offset = times - self.track.times[0]
        # far from the data the acceleration is not known: beyond the ends the velocity stays as it was there
        inside = np.clip(times, self.track.times[0], self.track.times[-1])
        knots = _smooth(inside, self._knots)
        kinks = [_kink(inside, np.array(self.kicks), before=before), _smooth(inside, np.array(self.kicks))]
        base = inside - self.track.times[0]
        one, zero = np.ones_like(base), np.zeros_like(base)
        start = (np.stack([one, base, base**2 / 2], axis=1), np.stack([zero, one, base], axis=1))
        place = np.concatenate([start[0], knots[0], kinks[0][0], kinks[1][0]], axis=1)
        rate = np.concatenate([start[1], knots[1], kinks[0][1], kinks[1][1]], axis=1)
        beyond = offset - base
        return place + rate * beyond[:, None], rate


def fitted(tracks: Sequence[BodyTrack]) -> list[Smoother]:
    """Smoothers of all bodies, without any contact yet."""
    return [Smoother(track) for track in tracks]


def _ramps(times: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    late = np.maximum(times[:, None] - at, 0)
    return late, late**2 / 2


def _kink(times: np.ndarray, at: np.ndarray, *, before: bool) -> tuple[np.ndarray, np.ndarray]:
    late = times[:, None] - at
    happened: Bool[np.ndarray, "time kick"] = late > 1e-12 if before else late >= 0
    return np.maximum(late, 0), happened.astype(float)


def _smooth(times: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    late = np.maximum(times[:, None] - at, 0)
    return late**2 / 2, late


def rest_times(start: float, stop: float) -> Float[np.ndarray, "time"]:
    """Times in s at which a body that rests from `start` to `stop` is held."""
    return np.linspace(start, stop, max(round((stop - start) / KNOT_SPACING) + 1, 2))


def _log_density(values: Float[np.ndarray, "row 2"], covariance: Float[np.ndarray, "row row"]) -> float:
    """Log density (nats) of two independent columns of the same Gaussian, up to a constant of the number of rows."""
    factor = np.linalg.cholesky(covariance)
    return float(-0.5 * (np.linalg.solve(factor, values) ** 2).sum() - 2 * np.log(np.diag(factor)).sum())

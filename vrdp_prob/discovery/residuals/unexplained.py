"""Accelerations at random that a model leaves unexplained, beside which a cause has to stand out.

No table is level to a micrometre. Where residuals are alike in neighbouring frames almost any cause follows some of
them, and kicks and jumps follow each of them. So a model is judged by how probable it makes the videos together with an
unknown acceleration in each, of the most probable size and duration: what chance explains as well is no merit of a
cause. The process is that of `vrdp_prob/models/model_error.py`.

Source: Kennedy and O'Hagan, Bayesian calibration of computer models, Journal of the Royal Statistical Society B 63
(2001), section 4.4; restricted likelihood: Rasmussen and Williams, Gaussian Processes for Machine Learning (2006),
section 2.7.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float
from scipy.linalg import solve_triangular
from scipy.optimize import minimize
from scipy.stats import chi2

from vrdp_prob.discovery.residuals.held_out import all_but_each, left_out
from vrdp_prob.discovery.residuals.linear import LinearFit, LinearVideo, log_evidence
from vrdp_prob.discovery.residuals.residual_model import ResidualModel, VideoResiduals
from vrdp_prob.inference.runs.parallel import in_processes
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.models.model_error import Factors, Strand, Whitening, by_law, factors

NEEDED = 6.0
"""Gain (nats) in the probability of a video from which on something is said to be unexplained in it."""
SHARES = (0.001, 0.01, 0.1, 1.0)
DURATIONS = (0.5, 2.0)
"""Where the search begins: share of the accelerations that bodies show, and duration in s."""
SHORTEST, LEAST_FRAMES = 0.3, 8
"""Time in s from which an acceleration lasts, and number of frames that this is at least; what is faster is noise."""
PARABOLA = 3
"""Numbers that a parabola has."""
SIMPLEX = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, -0.5]])
"""Corners of the search's first simplex about its start: logarithms of size, duration and variance of the noise."""
EVALUATIONS = 60
LEAST_NOISE = 1e-6
"""Smallest variance of the noise of an axis in units of the fit's."""
FAR = 1e12
"""Cost of what is out of bounds."""


@dataclass(frozen=True)
class Straying:
    """How the residuals of a video stray along one axis, or along both where the noise mixes them.

    Parameters
    ----------
    size
        Standard deviation in m/s^2 of a random acceleration of every body; 0 for none.
    duration
        Time in s after which it is another.
    noise
        Variance of the noise beside it in units of the fit's.
    """

    size: float
    duration: float
    noise: float


@dataclass(frozen=True)
class Unexplained:
    """What a fit leaves unexplained.

    Parameters
    ----------
    straying
        How each video strays along its axes; of size 0 where noise explains what is left.
    gains
        How much (nats) more probable each video is with them, given the others.
    plain
        Residuals of the fit without them.
    shared_widening, own_widening
        Factors by which the shared unknowns, and each video's own ones, are less well known than noise alone would
        leave them.
    """

    straying: tuple[tuple[Straying, ...], ...]
    gains: Float[np.ndarray, "video"]
    plain: ResidualModel
    shared_widening: Float[np.ndarray, "shared"]
    own_widening: tuple[Float[np.ndarray, "_"], ...]

    @property
    def accelerated(self) -> tuple[Straying, ...]:
        """The largest acceleration of each video that noise does not explain."""
        largest = (max(video, key=lambda one: one.size) for video in self.straying)
        return tuple(one for one in largest if one.size)

    @property
    def videos(self) -> list[int]:
        """Numbers of the videos that stray."""
        return [index for index, axes in enumerate(self.straying) if any(one.size for one in axes)]

    def independent(self) -> ResidualModel:
        """Residuals of the fit with them made independent.

        Not kept: what makes those of n frames independent has n^2 numbers for each body and axis, and a search asks
        each of a hundred models for it once.
        """
        return _independent(self.plain, self.straying)


def unexplained(fit: SharedFit) -> Unexplained:
    """Find the accelerations that make what a fit leaves most probable."""
    plain = ResidualModel.of(fit)
    searches = [
        _Search(video, part.clues.acceleration, plain.linear.prior)
        for video, part in zip(plain.videos, fit.fits, strict=True)
    ]
    straying = tuple(in_processes(_Search.found, searches))
    model = _independent(plain, straying)
    gains = _log_densities(model.linear) - _log_densities(plain.linear)
    shared = _ratio(model.linear.shared_sd, plain.linear.shared_sd)
    own = tuple(
        _ratio(one.own_sd, two.own_sd) for one, two in zip(model.linear.videos, plain.linear.videos, strict=True)
    )
    return Unexplained(straying, gains, plain, shared, own)


def _independent(plain: ResidualModel, straying: Sequence[Sequence[Straying]]) -> ResidualModel:
    """Residuals made independent where they stray."""
    videos = tuple(
        replace(video, linear=video.linear.straying(_whitening(video, one)))
        for video, one in zip(plain.videos, straying, strict=True)
    )
    return ResidualModel(replace(plain.linear, videos=tuple(one.linear for one in videos)), videos)


def _whitening(video: VideoResiduals, straying: Sequence[Straying]) -> Whitening:
    """What makes the residuals of a video independent; angles do not stray."""
    positions: Factors = ()
    for some, one in zip(_strands(video), straying, strict=True):
        positions += factors(some, one.size * _unit(video), one.duration, np.full(video.positions, one.noise))
    angles = np.ones(video.linear.data - video.positions)
    return Whitening(positions, factors(video.likelihood.strands.angles, 0.0, 1.0, angles))


def _strands(video: VideoResiduals) -> list[list[Strand]]:
    """Strands of positions along each axis, or of both together where the noise mixes them."""
    by_axes: dict[tuple[int, ...], list[Strand]] = {}
    for strand in video.likelihood.strands.positions:
        by_axes.setdefault(tuple(sorted({int(place) % 2 for place in strand.places})), []).append(strand)
    return [by_axes[axes] for axes in sorted(by_axes)]


def _unit(video: VideoResiduals) -> float:
    """A metre in units of the noise."""
    return video.noise.slope(2) / video.noise_sd


@dataclass(frozen=True)
class _Search:
    """The search for the unknown acceleration of one video.

    Parameters
    ----------
    video
        The video.
    shown
        Typical acceleration in m/s^2 of its bodies.
    prior
        Curvature of the negative log prior of the shared unknowns.
    """

    video: VideoResiduals
    shown: float
    prior: Float[np.ndarray, "shared shared"]
    _last: dict[int, tuple[Straying, Float[np.ndarray, "number column"], float]] = field(default_factory=dict)

    def found(self) -> tuple[Straying, ...]:
        """The most probable straying; that of noise by itself where this does as well.

        The noise of each axis is free in any case: otherwise a model that leaves something to chance would be credited
        with it, and one that leaves nothing would not.
        """
        noise = tuple(Straying(0.0, SHORTEST, one) for one in self._variances(self._alone.left))
        best = noise
        for axis, fast in enumerate(self._fast_variances):
            best = self._along(axis, best, fast)
        return best if self._density(best) - self._density(noise) > NEEDED else noise

    def _along(self, axis: int, others: tuple[Straying, ...], fast: float) -> tuple[Straying, ...]:
        """The most probable straying along one axis, given that along the others."""

        def with_logs(logs: Float[np.ndarray, "3"]) -> tuple[Straying, ...]:
            return (*others[:axis], Straying(*np.exp(logs).tolist()), *others[axis + 1 :])

        def cost(logs: Float[np.ndarray, "3"]) -> float:
            if not shortest <= np.exp(logs[1]) <= longest or np.exp(logs[2]) < LEAST_NOISE:
                return FAR
            try:
                return -self._density(with_logs(logs))
            except np.linalg.LinAlgError:
                return FAR

        times = self.video.motion.times
        shortest = max(SHORTEST, LEAST_FRAMES * self.video.motion.frame_time)
        longest = max(float(np.ptp(times)), 2 * shortest)
        starts = [
            np.log([share * self.shown, min(max(duration, shortest), longest), noise])
            for share in SHARES
            for duration in DURATIONS
            for noise in (fast, others[axis].noise)
        ]
        best = min(starts, key=cost)
        before = self._density(others)
        if -cost(best) < before:
            return others
        options = {"initial_simplex": best + SIMPLEX, "maxfev": EVALUATIONS, "xatol": 0.05, "fatol": 0.5}
        found = minimize(cost, best, method="Nelder-Mead", options=options)
        return with_logs(found.x) if -found.fun > before else others

    def _density(self, straying: tuple[Straying, ...]) -> float:
        """Log density (nats, up to a constant) of the video by itself."""
        parts = [self._independent(axis, one) for axis, one in enumerate(straying)]
        rows = np.concatenate([*(rows for rows, _ in parts), self._rows[self.video.positions :]])
        return sum(stretch for _, stretch in parts) + log_evidence(rows[:, :-1], rows[:, -1])

    def _independent(self, axis: int, one: Straying) -> tuple[Float[np.ndarray, "number column"], float]:
        """Rows of an axis made independent, and the logarithm of the factor by which the residuals were stretched.

        The last ones are kept: the search changes one axis at a time.
        """
        known = self._last.get(axis)
        if known is None or known[0] != one:
            variance = np.full(self.video.positions, one.noise)
            found, stretch = [], 0.0
            for alike in self._alike[axis]:
                root = np.linalg.cholesky(alike[0].covariance(one.size * _unit(self.video), one.duration, variance))
                side_by_side = np.concatenate([self._rows[strand.places] for strand in alike], axis=1)
                independent = solve_triangular(root, side_by_side, lower=True, check_finite=False)
                found += np.split(independent, len(alike), axis=1)
                stretch -= len(alike) * float(np.log(np.diag(root)).sum())
            known = self._last[axis] = one, np.concatenate(found), stretch
        return known[1:]

    @cached_property
    def _rows(self) -> Float[np.ndarray, "residual column"]:
        """Derivatives by the unknowns, and the residuals in the last column."""
        alone = self._alone
        return np.concatenate([alone.own, alone.residuals[:, None]], axis=1)

    @cached_property
    def _alike(self) -> list[list[list[Strand]]]:
        """Strands of each axis, those together that stray alike."""
        variance = np.ones(self.video.positions)
        return [by_law(some, variance) for some in _strands(self.video)]

    @cached_property
    def _alone(self) -> LinearVideo:
        return self.video.linear.alone(self.prior)

    def _variances(self, residuals: Float[np.ndarray, "residual"]) -> list[float]:
        """Mean square of the residuals, axis by axis."""
        return [
            max(LEAST_NOISE, float(np.mean(residuals[np.concatenate([one.places for one in some])] ** 2)))
            for some in _strands(self.video)
        ]

    @cached_property
    def _fast_variances(self) -> list[float]:
        """Variance of the residuals about short parabolas, axis by axis: of what is faster than an acceleration.

        Bodies shake, and noise may be alike in neighbouring frames.
        """
        residuals, found = self.video.linear.residuals, []
        for some in _strands(self.video):
            several: list[float] = []
            for strand in some:
                several += _about_parabolas(residuals[strand.places].reshape(len(strand.times), -1), strand.times)
            found.append(max(LEAST_NOISE, float(np.median(several))) if several else 1.0)
        return found


def _about_parabolas(values: Float[np.ndarray, "seen axis"], times: Float[np.ndarray, "seen"]) -> list[float]:
    """Variances about parabolas through stretches of neighbours, whose median is that of the noise."""
    if len(times) < LEAST_FRAMES:
        return []
    frames = max(LEAST_FRAMES, round(SHORTEST / float(np.median(np.diff(times)))))
    found = []
    for first in range(0, len(times) - frames + 1, frames):
        inside = slice(first, first + frames)
        since = times[inside] - times[first]
        design = np.stack([since**power for power in range(PARABOLA)], axis=1)
        left = values[inside] - design @ np.linalg.lstsq(design, values[inside], rcond=None)[0]
        found.append(float((left**2).sum() / chi2.median((frames - PARABOLA) * left.shape[1])))
    return found


def _log_densities(linear: LinearFit) -> Float[np.ndarray, "video"]:
    """Log density (nats, up to constants of the tracks) of each video given the others."""
    found = []
    for video, left, slope, others in zip(
        linear.videos, linear.left, linear.slopes, all_but_each(linear.prior, linear.curvatures), strict=True
    ):
        own = video.log_volume + video.log_stretch - float(left @ left) / 2
        found.append(left_out(own, slope, video.reduced_shared, others, np.zeros(len(slope))).log_density)
    return np.array(found)


def _ratio(
    with_it: Float[np.ndarray, "unknown"], without: Float[np.ndarray, "unknown"]
) -> Float[np.ndarray, "unknown"]:
    return np.maximum(with_it / np.maximum(without, 1e-300), 1.0)

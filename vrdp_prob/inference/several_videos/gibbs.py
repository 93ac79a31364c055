"""Draws of the joint posterior of several videos: shared numbers and each video's own ones in turn.

A step of the shared numbers carries all own numbers along their regression on them, which keeps volumes; it is judged
by the sum over videos. Given the shared numbers, every video moves by itself. One video's batch of worlds is in memory
at a time (per thread).
"""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.linalg import solve_triangular

from vrdp_prob.inference.samples import ESS_GOAL, R_HAT_GOAL, chain_statistics
from vrdp_prob.inference.several_videos.arrow import ArrowGaussian
from vrdp_prob.inference.several_videos.bends import BentLocal, bent_locals
from vrdp_prob.inference.several_videos.joint_fit import JointFit
from vrdp_prob.inference.several_videos.linking import LinkedVideo
from vrdp_prob.inference.several_videos.slice_steps import Chains, reference_draws, slice_step
from vrdp_prob.progress import ProgressDisplay, SilentProgress

GROUPS = 4
"""Chains of a group are merged into one before anything is judged."""
CHAINS_PER_GROUP = 16
LOCAL_STEPS = 2
"""Steps of each video's own numbers per step of the shared ones."""
WARM_UP = 24
"""Sweeps that shape the reference and are thrown away."""
SWEEPS_PER_ROUND = 32
ROUNDS = 8
"""Rounds after which sampling stops even if it has not converged; numbers of steps and never times, so that the same
seed gives the same draws on every machine."""
MARGIN = 1.1
"""Effective draws asked of the chains per draw that is needed, since what is kept of them is thinned."""
START_SPREADS = (1.0, 0.3, 0.1, 0.03, 0.01, 0.0)
"""Spreads of the starting places, in turn, until each chain has support."""
FEWEST_PER_DIMENSION = 8.0
"""A reference is shaped in equal parts by draws and as it was where there are so many effective draws per dimension."""
DRAWS_PER_EFFECTIVE = 6.0
"""Draws of a chain that are taken for one effective draw when references are shaped."""

Result = TypeVar("Result")


@dataclass(frozen=True)
class JointDraws:
    """Draws of shared numbers and, for each video, of its own.

    Parameters
    ----------
    shared
        Draws of the shared numbers; one chain per group, chain after chain.
    locals
        Draws of each video's own numbers, in the same order.
    log_density
        Log density of each video given the shared numbers, in the same order.
    drift
        R-hat of the groups' earlier against their later sweeps, over all numbers.
    evaluations
        Number of worlds simulated.
    """

    shared: Float[np.ndarray, "chain draw shared"]
    locals: tuple[Float[np.ndarray, "chain draw _"], ...]
    log_density: tuple[Float[np.ndarray, "chain draw"], ...]
    drift: float
    evaluations: int


def sample_gibbs(
    fit: JointFit,
    *,
    generator: np.random.Generator,
    progress: ProgressDisplay | None = None,
    rounds: int = ROUNDS,
) -> JointDraws:
    """Draw from the joint posterior until the goals for R-hat and effective size are met, or the rounds are over."""
    sampler = _Sampler(fit, generator)
    total = WARM_UP + rounds * SWEEPS_PER_ROUND
    with sampler.workers, (progress or SilentProgress()).stage("Sampling all videos", total=total) as advance:

        def run(sweeps: int) -> None:
            for _ in range(sweeps):
                sampler.sweep()
                advance(1)

        run(WARM_UP // 2)
        sampler.reshape()
        run(WARM_UP - WARM_UP // 2)
        sampler.reshape()
        for _ in range(rounds):
            run(SWEEPS_PER_ROUND)
            if sampler.converged():
                break
    return sampler.draws()


@dataclass(frozen=True)
class _Shape:
    """Affine map from a reference's coordinates to whitened ones, by which draws move and shape it.

    Parameters
    ----------
    shift, scale
        Mean and Cholesky factor of the covariance.
    along
        Change of the mean with the whitened shared numbers (none for the shared numbers themselves).
    """

    shift: Float[np.ndarray, "dimension"]
    scale: Float[np.ndarray, "dimension dimension"]
    along: Float[np.ndarray, "dimension shared"]

    @classmethod
    def unit(cls, dimension: int, shared: int) -> "_Shape":
        return cls(np.zeros(dimension), np.eye(dimension), np.zeros((dimension, shared)))

    @classmethod
    def of(cls, draws: Float[np.ndarray, "draw dimension"], shared: Float[np.ndarray, "draw shared"]) -> "_Shape":
        """Regression of draws on the whitened shared numbers, drawn towards the unit shape."""
        columns = np.column_stack([np.ones(len(draws)), shared])
        effective = len(draws) / DRAWS_PER_EFFECTIVE
        share = effective / (effective + FEWEST_PER_DIMENSION * (draws.shape[1] + columns.shape[1] - 1))
        coefficients = np.linalg.lstsq(columns, draws, rcond=None)[0]
        rest = draws - columns @ coefficients
        covariance = share * rest.T @ rest / len(rest) + (1 - share) * np.eye(draws.shape[1])
        return cls(share * coefficients[0], np.linalg.cholesky(covariance), share * coefficients[1:].T)

    def whitened(
        self, places: Float[np.ndarray, "chain dimension"], shared: Float[np.ndarray, "chain shared"]
    ) -> Float[np.ndarray, "chain dimension"]:
        return self.shift + shared @ self.along.T + places @ self.scale.T

    def places(
        self, whitened: Float[np.ndarray, "chain dimension"], shared: Float[np.ndarray, "chain shared"]
    ) -> Float[np.ndarray, "chain dimension"]:
        away = whitened - self.shift - shared @ self.along.T
        return np.ascontiguousarray(solve_triangular(self.scale, away.T, lower=True).T)


class _Video:
    """Chains of one video's own numbers."""

    def __init__(
        self, video: LinkedVideo, bent: BentLocal, arrow: ArrowGaussian, generator: np.random.Generator
    ) -> None:
        self.video, self._bent, self._arrow, self._generator = video, bent, arrow, generator
        dimension = len(bent.axes)
        self._shape = _Shape.unit(dimension, len(arrow.mean))
        self.chains = Chains(np.zeros((0, dimension)), np.zeros(0))
        self._pending = np.zeros(0)
        self._kept: list[np.ndarray] = []
        self.points: list[np.ndarray] = []
        self.values: list[np.ndarray] = []
        self.looks = 0

    def start(self, shared: Float[np.ndarray, "chain shared"]) -> None:
        """Places drawn around the mode, closer to it where there is no support."""
        count, dimension = len(shared), len(self._bent.axes)
        draws = reference_draws(count, dimension, self._generator)
        places, values = np.zeros((count, dimension)), np.full(count, -np.inf)
        for spread in START_SPREADS:
            failed = np.flatnonzero(~np.isfinite(values))
            if not len(failed):
                break
            places[failed] = spread * draws[failed]
            values[failed] = self._log_density(places[failed], shared[failed])
        self.chains, self._pending = Chains(places, values), values.copy()

    def carried(
        self, chosen: Int[np.ndarray, "chosen"], shared: Float[np.ndarray, "chosen shared"]
    ) -> Float[np.ndarray, "chosen"]:
        """Log density where the shared numbers of some chains move and the own ones follow."""
        self._pending[chosen] = self._log_density(self.chains.places[chosen], shared)
        return self._pending[chosen]

    def follow(self, moved: Bool[np.ndarray, "chain"]) -> None:
        """The chains whose shared numbers have moved take over the density that was looked at last."""
        self.chains.log_density = np.where(moved, self._pending, self.chains.log_density)

    def move(self, shared: Float[np.ndarray, "chain shared"]) -> None:
        """A few steps of the own numbers, then note where the chains are."""
        for _ in range(LOCAL_STEPS):
            slice_step(
                self.chains,
                lambda chosen, places: self._log_density(places, shared[chosen]),
                self._generator,
            )
        self._kept.append(self._shape.whitened(self.chains.places, shared))
        self.points.append(self._bent.points(self._kept[-1], shared))
        self.values.append(self.chains.log_density.copy())

    def reshape(self, shared: Float[np.ndarray, "draw shared"]) -> None:
        """Shape the reference after the draws so far, which are then forgotten."""
        latest = self._kept[-1]
        self._shape = _Shape.of(np.concatenate(self._kept), shared)
        self.chains.places = self._shape.places(latest, shared[-len(latest) :])
        for series in (self._kept, self.points, self.values):
            series.clear()

    def _log_density(
        self, places: Float[np.ndarray, "chosen local"], shared: Float[np.ndarray, "chosen shared"]
    ) -> Float[np.ndarray, "chosen"]:
        self.looks += len(places)
        own = self._bent.points(self._shape.whitened(places, shared), shared)
        return self.video.log_density(self._arrow.shared_points(shared), own)


class _Sampler:
    """All chains, and the order in which they move. Shared numbers are whitened by the Gaussian of the fit."""

    def __init__(self, fit: JointFit, generator: np.random.Generator) -> None:
        self._fit, self._arrow, self._generator = fit, fit.gaussian, generator
        streams = generator.spawn(len(fit.videos))
        bent = bent_locals(fit.videos, fit.gaussian, generator)
        self._videos = [
            _Video(video, one, fit.gaussian, stream)
            for video, one, stream in zip(fit.videos, bent, streams, strict=True)
        ]
        self.workers = ThreadPoolExecutor(max_workers=min(len(fit.videos), os.cpu_count() or 1))
        count = GROUPS * CHAINS_PER_GROUP
        self._shape = _Shape.unit(len(fit.numbers), 0)
        self._chains = Chains(reference_draws(count, len(fit.numbers), generator), np.zeros(count))
        self._nothing = np.zeros((count, 0))
        self._kept: list[np.ndarray] = []
        shared = self._whitened(self._chains.places)
        self._each(lambda video: video.start(shared))
        self._add_up(shared)

    def sweep(self) -> None:
        """Move the shared numbers, then each video's own."""
        before = self._chains.places.copy()
        slice_step(self._chains, self._log_density, self._generator)
        moved = (self._chains.places != before).any(axis=1)
        shared = self._whitened(self._chains.places)
        for video in self._videos:
            video.follow(moved)
        self._each(lambda video: video.move(shared))
        self._add_up(shared)
        self._kept.append(shared)

    def reshape(self) -> None:
        """Shape the references after the draws so far, which are then forgotten."""
        draws, latest = np.concatenate(self._kept), self._kept[-1]
        self._shape = _Shape.of(draws, draws[:, :0])
        self._chains.places = self._shape.places(latest, self._nothing)
        self._each(lambda video: video.reshape(draws))
        self._kept.clear()

    def converged(self) -> bool:
        """Whether all draws since the last reshaping meet the goals."""
        for series in self._series():
            r_hat, ess = chain_statistics(_by_chain(series))
            if max(r_hat, _drift(series)) > R_HAT_GOAL or ess < MARGIN * ESS_GOAL:
                return False
        return True

    def draws(self) -> JointDraws:
        """All draws since the last reshaping."""
        return JointDraws(
            self._arrow.shared_points(_by_chain(self._kept)),
            tuple(_by_chain(video.points) for video in self._videos),
            tuple(_by_chain([values[:, None] for values in video.values])[..., 0] for video in self._videos),
            max(_drift(series) for series in self._series()),
            sum(video.looks for video in self._videos),
        )

    def _series(self) -> list[list[np.ndarray]]:
        """Sweeps of the shared numbers and of each video's own."""
        return [series for series in (self._kept, *(video.points for video in self._videos)) if series[0].shape[1]]

    def _whitened(self, places: Float[np.ndarray, "chain shared"]) -> Float[np.ndarray, "chain shared"]:
        return self._shape.whitened(places, np.zeros((len(places), 0)))

    def _log_density(
        self, chosen: Int[np.ndarray, "chosen"], places: Float[np.ndarray, "chosen shared"]
    ) -> Float[np.ndarray, "chosen"]:
        shared = self._whitened(places)
        values = self._each(lambda video: video.carried(chosen, shared))
        return self._log_prior(shared) + np.sum(values, axis=0)

    def _add_up(self, shared: Float[np.ndarray, "chain shared"]) -> None:
        """Log density of the whole at the present places."""
        values = [video.chains.log_density for video in self._videos]
        self._chains.log_density = self._log_prior(shared) + np.sum(values, axis=0)

    def _log_prior(self, shared: Float[np.ndarray, "chain shared"]) -> Float[np.ndarray, "chain"]:
        return self._fit.numbers.log_prior(self._arrow.shared_points(shared))

    def _each(self, task: Callable[[_Video], Result]) -> list[Result]:
        return list(self.workers.map(task, self._videos))


def _by_chain(sweeps: Sequence[Float[np.ndarray, "chain dimension"]]) -> Float[np.ndarray, "group draw dimension"]:
    """Groups of chains, each merged chain after chain so that autocorrelation within a chain shows."""
    steps = np.stack(sweeps, axis=1)
    return steps.reshape(GROUPS, -1, steps.shape[-1])


def _drift(sweeps: Sequence[Float[np.ndarray, "chain dimension"]]) -> float:
    steps = np.stack(sweeps)
    grouped = steps.reshape(len(steps), GROUPS, -1, steps.shape[-1]).swapaxes(0, 1)
    return chain_statistics(grouped.reshape(GROUPS, -1, steps.shape[-1]))[0]

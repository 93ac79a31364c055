"""Draws of the joint posterior of several videos: shared numbers and each video's own ones in turn.

A step of the shared numbers carries all own numbers along their regression on them, which keeps volumes; it is judged
by the sum over videos. Given the shared numbers, every video moves by itself. One video's batch of worlds is in memory
at a time (per thread).
"""

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.special import logsumexp

from vrdp_prob.inference.draws.diagnostics import Reported, drift, joined, ordered, settled, share_with_error
from vrdp_prob.inference.draws.samples import ESS_GOAL, R_HAT_GOAL, ModeWeight
from vrdp_prob.inference.runs.checkpoint import Checkpoint
from vrdp_prob.inference.several_videos.arrow import ArrowGaussian
from vrdp_prob.inference.several_videos.clouds import Clouds
from vrdp_prob.inference.several_videos.joint_fit import JointFit
from vrdp_prob.inference.several_videos.linking import LinkedVideo
from vrdp_prob.inference.several_videos.shaping import Shape
from vrdp_prob.inference.several_videos.shared_ridge import SharedRidge
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

CHAINS = "chains"
"""Name under which a checkpoint keeps them."""

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
    modes
        Weights of the modes of each video's own numbers; empty where there is one.
    notes
        At which limit sampling has stopped, if at one.
    """

    shared: Float[np.ndarray, "chain draw shared"]
    locals: tuple[Float[np.ndarray, "chain draw _"], ...]
    log_density: tuple[Float[np.ndarray, "chain draw"], ...]
    drift: float
    evaluations: int
    modes: tuple[tuple[ModeWeight, ...], ...]
    notes: tuple[str, ...] = ()


def sample_gibbs(
    fit: JointFit,
    *,
    generator: np.random.Generator,
    progress: ProgressDisplay | None = None,
    rounds: int = ROUNDS,
    reported: Sequence[Reported] | None = None,
    checkpoint: Checkpoint | None = None,
) -> JointDraws:
    """Draw from the joint posterior until the goals for R-hat and effective size are met, or the rounds are over.

    Parameters
    ----------
    fit
        The joint fit.
    generator
        Source of randomness.
    progress
        Told how many sweeps are done.
    rounds
        Rounds after which sampling stops in any case.
    reported
        Quantities of each video that have to be known well enough beside all numbers; none where None.
    checkpoint
        Keeps the chains after every round; a run that is taken up goes on from there.
    """
    kept: Any = None if checkpoint is None else checkpoint.thing(CHAINS)
    warm = (WARM_UP // 2, WARM_UP)
    stops = [*warm, *(WARM_UP + SWEEPS_PER_ROUND * (done + 1) for done in range(rounds))]
    threads = min(len(fit.videos), os.cpu_count() or 1)
    display = progress or SilentProgress()
    with ThreadPoolExecutor(threads) as workers, display.stage("Sampling all videos", total=stops[-1]) as advance:
        known = isinstance(kept, _Sampler)
        sampler: _Sampler = kept.with_workers(workers) if known else _Sampler(fit, generator, workers, reported)
        advance(sampler.sweeps)
        for stop in stops:
            if sampler.sweeps < stop:
                while sampler.sweeps < stop:
                    sampler.sweep()
                    advance(1)
                if stop in warm:
                    sampler.reshape()
                if checkpoint is not None:
                    sampler = checkpoint.keep_thing(CHAINS, sampler).with_workers(workers)
            if stop == sampler.sweeps and stop not in warm and sampler.converged():
                return sampler.draws()
    return replace(sampler.draws(), notes=(f"It stopped after {rounds * SWEEPS_PER_ROUND} sweeps.",))


class _Video:
    """Chains of one video's own numbers.

    Where there are several modes each chain carries the label of a cloud, and its target is the density times the share
    that this cloud has in all clouds there: summed over labels that is the density.
    """

    def __init__(
        self, video: LinkedVideo, clouds: Clouds, arrow: ArrowGaussian, generator: np.random.Generator
    ) -> None:
        self.video, self._clouds, self._arrow, self._generator = video, clouds, arrow, generator
        self._labels = np.zeros(0, dtype=np.int64)
        self.chains = Chains(np.zeros((0, clouds.dimension)), np.zeros(0))
        self._pending = np.zeros(0)
        self._kept_labels: list[np.ndarray] = []
        self.points: list[np.ndarray] = []
        self.values: list[np.ndarray] = []
        self.looks = 0

    def start(self, shared: Float[np.ndarray, "chain shared"]) -> None:
        """Places drawn around the modes, closer to them where there is no support."""
        count, dimension = len(shared), self._clouds.dimension
        chances = np.exp(self._clouds.log_weights)
        self._labels = self._generator.choice(len(chances), size=count, p=chances)
        draws = reference_draws(count, dimension, self._generator)
        places, values = np.zeros((count, dimension)), np.full(count, -np.inf)
        for spread in START_SPREADS:
            failed = np.flatnonzero(~np.isfinite(values))
            if not len(failed):
                break
            places[failed] = spread * draws[failed]
            values[failed] = self._target(failed, places[failed], shared[failed])
        self.chains, self._pending = Chains(places, values), values.copy()

    def carried(
        self, chosen: Int[np.ndarray, "chosen"], shared: Float[np.ndarray, "chosen shared"]
    ) -> Float[np.ndarray, "chosen"]:
        """Target where the shared numbers of some chains move and the own ones follow."""
        self._pending[chosen] = self._target(chosen, self.chains.places[chosen], shared)
        return self._pending[chosen]

    def follow(self, moved: Bool[np.ndarray, "chain"]) -> None:
        """The chains whose shared numbers have moved take over the target that was looked at last."""
        self.chains.log_density = np.where(moved, self._pending, self.chains.log_density)

    def move(self, shared: Float[np.ndarray, "chain shared"]) -> None:
        """A few steps of the own numbers, then note where the chains are."""
        for _ in range(LOCAL_STEPS):
            slice_step(
                self.chains, lambda chosen, places: self._target(chosen, places, shared[chosen]), self._generator
            )
        points = self._clouds.points(self.chains.places, shared, self._labels)
        values = self.chains.log_density - self._log_share(points, shared, self._labels)
        if len(self._clouds.clouds) > 1:
            points, values = self._jumped(points, values, shared)
            joint = self._clouds.log_joint(points, shared)
            self._labels = np.argmax(joint + self._generator.gumbel(size=joint.shape), axis=0)
            self._placed(points, values, shared)
        self._kept_labels.append(self._labels)
        self.points.append(points)
        self.values.append(values)

    def reshape(self, shared: Float[np.ndarray, "draw shared"]) -> None:
        """Shape the clouds after the draws so far, which are then forgotten."""
        points, labels = np.concatenate(self.points), np.concatenate(self._kept_labels)
        clouds = []
        for label, cloud in enumerate(self._clouds.clouds):
            mine = labels == label
            shape = Shape.of(cloud.bent.whitened(points[mine], shared[mine]), shared[mine])
            clouds.append(replace(cloud, shape=shape))
        self._clouds = replace(self._clouds, clouds=tuple(clouds))
        latest = self.points[-1]
        self._placed(latest, self.values[-1], shared[-len(latest) :])
        for series in (self._kept_labels, self.points, self.values):
            series.clear()

    def modes(self) -> tuple[ModeWeight, ...]:
        """Weights of the modes in the draws so far."""
        if len(self._clouds.clouds) == 1:
            return ()
        count = len(self._clouds.clouds)
        # one column per mode, 1 for the chains in it
        inside = _by_chain([np.eye(count)[labels] for labels in self._kept_labels])
        return tuple(ModeWeight(*share_with_error(inside[..., mode])) for mode in range(count))

    def _jumped(
        self,
        points: Float[np.ndarray, "chain local"],
        values: Float[np.ndarray, "chain"],
        shared: Float[np.ndarray, "chain shared"],
    ) -> tuple[Float[np.ndarray, "chain local"], Float[np.ndarray, "chain"]]:
        """Proposals from all clouds that forget the place, where they are accepted."""
        proposed, _ = self._clouds.draws(shared, self._generator)
        self.looks += len(proposed)
        ahead = self.video.log_density(self._arrow.shared_points(shared), proposed)
        gain = ahead - values + self._clouds.log_density(points, shared) - self._clouds.log_density(proposed, shared)
        accepted = np.log(self._generator.random(len(gain))) < gain
        return np.where(accepted[:, None], proposed, points), np.where(accepted, ahead, values)

    def _placed(
        self,
        points: Float[np.ndarray, "chain local"],
        values: Float[np.ndarray, "chain"],
        shared: Float[np.ndarray, "chain shared"],
    ) -> None:
        """Take over own numbers with their log density, in the clouds of the present labels."""
        self.chains.places = self._clouds.places(points, shared, self._labels)
        self.chains.log_density = values + self._log_share(points, shared, self._labels)

    def _target(
        self,
        chosen: Int[np.ndarray, "chosen"],
        places: Float[np.ndarray, "chosen local"],
        shared: Float[np.ndarray, "chosen shared"],
    ) -> Float[np.ndarray, "chosen"]:
        self.looks += len(places)
        own = self._clouds.points(places, shared, self._labels[chosen])
        value = self.video.log_density(self._arrow.shared_points(shared), own)
        return value + self._log_share(own, shared, self._labels[chosen])

    def _log_share(
        self,
        points: Float[np.ndarray, "chosen local"],
        shared: Float[np.ndarray, "chosen shared"],
        labels: Int[np.ndarray, "chosen"],
    ) -> Float[np.ndarray, "chosen"]:
        """Log of the share that the labelled cloud has in all clouds at some points."""
        if len(self._clouds.clouds) == 1:
            return np.zeros(len(points))
        joint = self._clouds.log_joint(points, shared)
        shares: np.ndarray = joint[labels, np.arange(len(points))] - logsumexp(joint, axis=0)
        return shares


class _Sampler:
    """All chains, and the order in which they move. Shared numbers are whitened by the Gaussian of the fit."""

    def __init__(
        self,
        fit: JointFit,
        generator: np.random.Generator,
        workers: ThreadPoolExecutor,
        reported: Sequence[Reported] | None = None,
    ) -> None:
        self._fit, self._arrow, self._generator = fit, fit.gaussian, generator
        self._reported = [one.combined for one in reported or ()]
        streams = generator.spawn(len(fit.videos))
        clouds = [Clouds.of_fit(fit, index, stream) for index, stream in enumerate(streams)]
        self._ridge = SharedRidge.of(fit, clouds, generator)
        self._videos = [
            _Video(video, one, fit.gaussian, stream)
            for video, one, stream in zip(fit.videos, clouds, streams, strict=True)
        ]
        self._workers = workers
        self.sweeps = 0
        count = GROUPS * CHAINS_PER_GROUP
        self._shape = Shape.unit(len(fit.numbers), 0)
        places = reference_draws(count, len(fit.numbers), generator)
        outside = ~np.isfinite(self._ridge.whitened(places)[1])
        places[outside] *= START_SPREADS[-2]
        self._chains = Chains(places, np.zeros(count))
        self._nothing = np.zeros((count, 0))
        self._kept: list[np.ndarray] = []
        self._straight: list[np.ndarray] = []
        shared = self._whitened(self._chains.places)
        self._each(lambda video: video.start(shared))
        self._add_up()

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "_workers"}

    def with_workers(self, workers: ThreadPoolExecutor) -> "_Sampler":
        """The same chains, moved by some threads, which are not kept with them."""
        self._workers = workers
        return self

    def sweep(self) -> None:
        """Move the shared numbers, then each video's own."""
        self.sweeps += 1
        before = self._chains.places.copy()
        slice_step(self._chains, self._log_density, self._generator)
        moved = (self._chains.places != before).any(axis=1)
        shared = self._whitened(self._chains.places)
        for video in self._videos:
            video.follow(moved)
        self._each(lambda video: video.move(shared))
        self._add_up()
        self._kept.append(shared)
        self._straight.append(self._shape.whitened(self._chains.places, self._nothing))

    def reshape(self) -> None:
        """Shape the references after the draws so far, which are then forgotten."""
        straight, draws = np.concatenate(self._straight), np.concatenate(self._kept)
        self._shape = Shape.of(straight, straight[:, :0])
        self._chains.places = self._shape.places(self._straight[-1], self._nothing)
        self._each(lambda video: video.reshape(draws))
        self._add_up()
        self._kept.clear()
        self._straight.clear()

    def converged(self) -> bool:
        """Whether all draws since the last reshaping meet the goals."""
        return all(_met(series) for series in self._series()) and all(
            _met(series, shown) for series, shown in self._combinations()
        )

    def draws(self) -> JointDraws:
        """All draws since the last reshaping."""
        return JointDraws(
            self._arrow.shared_points(_by_chain(self._kept)),
            tuple(_by_chain(video.points) for video in self._videos),
            tuple(_by_chain([values[:, None] for values in video.values])[..., 0] for video in self._videos),
            max(drift(_by_time(series)) for series in self._series()),
            sum(video.looks for video in self._videos),
            tuple(video.modes() for video in self._videos),
        )

    def _combinations(self) -> Iterator[tuple[list[np.ndarray], Reported]]:
        """Sweeps of the whole vector of each video of which combinations are reported, and which."""
        shared = [self._arrow.shared_points(one) for one in self._kept] if any(self._reported) else []
        for video, shown in zip(self._videos, self._reported, strict=False):
            if shown is not None:
                yield [video.video.points(*both) for both in zip(shared, video.points, strict=True)], shown

    def _series(self) -> list[list[np.ndarray]]:
        """Sweeps of the shared numbers and of each video's own."""
        return [series for series in (self._kept, *(video.points for video in self._videos)) if series[0].shape[1]]

    def _whitened(self, places: Float[np.ndarray, "chain shared"]) -> Float[np.ndarray, "chain shared"]:
        return self._ridge.whitened(self._shape.whitened(places, np.zeros((len(places), 0))))[0]

    def _log_density(
        self, chosen: Int[np.ndarray, "chosen"], places: Float[np.ndarray, "chosen shared"]
    ) -> Float[np.ndarray, "chosen"]:
        shared, log_volume = self._ridge.whitened(self._shape.whitened(places, self._nothing[chosen]))
        values = self._each(lambda video: video.carried(chosen, shared))
        return self._log_prior(shared) + log_volume + np.sum(values, axis=0)

    def _add_up(self) -> None:
        """Log density of the whole at the present places."""
        shared, log_volume = self._ridge.whitened(self._shape.whitened(self._chains.places, self._nothing))
        values = [video.chains.log_density for video in self._videos]
        self._chains.log_density = self._log_prior(shared) + log_volume + np.sum(values, axis=0)

    def _log_prior(self, shared: Float[np.ndarray, "chain shared"]) -> Float[np.ndarray, "chain"]:
        return self._fit.numbers.log_prior(self._arrow.shared_points(shared))

    def _each(self, task: Callable[[_Video], Result]) -> list[Result]:
        return list(self._workers.map(task, self._videos))


def _met(sweeps: Sequence[Float[np.ndarray, "chain dimension"]], reported: Reported | None = None) -> bool:
    """Whether sweeps meet the goals."""
    by_chain, by_time = _by_chain(sweeps), _by_time(sweeps)
    return settled(by_chain, by_time, reported, r_hat=R_HAT_GOAL, effective=MARGIN * ESS_GOAL)


def _in_groups(
    sweeps: Sequence[Float[np.ndarray, "chain dimension"]],
) -> Float[np.ndarray, "group member sweep dimension"]:
    steps = np.stack(sweeps, axis=1)
    return steps.reshape(GROUPS, len(steps) // GROUPS, *steps.shape[1:])


def _by_chain(sweeps: Sequence[Float[np.ndarray, "chain dimension"]]) -> Float[np.ndarray, "group draw dimension"]:
    """Groups of chains, each merged chain after chain so that autocorrelation within a chain shows."""
    return joined(_in_groups(sweeps))


def _by_time(sweeps: Sequence[Float[np.ndarray, "chain dimension"]]) -> Float[np.ndarray, "group draw dimension"]:
    """Groups of chains, each merged sweep after sweep."""
    return ordered(_in_groups(sweeps))

"""Whether all samplers say the same of the same scenes, in units of their own Monte Carlo errors."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import count, islice

import numpy as np
from _clock import processor_seconds
from arviz_stats.base.array import array_stats

from tests.inference.prior_scenes import prior_scene
from vrdp_prob.inference import default_model
from vrdp_prob.inference.diagnostics import Reported
from vrdp_prob.inference.infer import sampled
from vrdp_prob.inference.map_fit import MapFit, fit_map
from vrdp_prob.inference.mixture import Mixture
from vrdp_prob.inference.proposals import proposals
from vrdp_prob.inference.samples import Convergence, Samples, assess
from vrdp_prob.inference.straightening import Rates

DRAWS = {"emcee": 1000, "nuts": 1000, "laplace": 8000}
"""Many of the weighted ones, since they are resampled."""
SEEDS = {"emcee": 11, "nuts": 12, "laplace": 13}
ALONE = {"laplace": {"hand_on": False}}
"""Options by which a sampler is compared as itself."""


@dataclass(frozen=True)
class Compared:
    """A quantity of a scene by two samplers: the difference of their means, or sds, over its standard error."""

    quantity: str
    what: str
    samplers: tuple[str, str]
    difference: float


@dataclass(frozen=True)
class SceneAgreement:
    """What the samplers say of one scene.

    Parameters
    ----------
    seed
        The scene.
    verdicts
        What every sampler says of itself.
    seconds
        Processor time of each.
    compared
        All comparisons of pairs of those that say that they have converged.
    """

    seed: int
    verdicts: dict[str, Convergence]
    seconds: dict[str, float]
    compared: tuple[Compared, ...]


def agreement(scenes: int, names: Sequence[str]) -> Iterator[SceneAgreement]:
    """What some samplers say of the first scenes from the prior (2 or 3 bodies, cubes among them)."""
    accepted = ((seed, scene) for seed in count() if (scene := prior_scene(seed)) is not None)
    for seed, scene in islice(accepted, scenes):
        fit = fit_map(scene.tracks, default_model(), np.random.default_rng(seed))
        reported = Reported.of(fit.likelihood.coordinates, fit.contacts, fit.likelihood.tracks.bodies)
        moments, verdicts, seconds = {}, {}, {}
        for name in names:
            begin = processor_seconds()
            samples = sampled(
                fit,
                name,
                draws=DRAWS[name],
                generator=np.random.default_rng([seed, SEEDS[name]]),
                reported=reported,
                **ALONE.get(name, {}),
            )
            seconds[name] = processor_seconds() - begin
            verdicts[name] = assess(name, samples, reported)
            if verdicts[name].converged:
                moments[name] = _moments(samples, reported)
        yield SceneAgreement(seed, verdicts, seconds, tuple(_comparisons(reported.names, moments)))


def start_of(fit: MapFit) -> Mixture:
    """What the samplers set out from."""
    rates = Rates.of(fit.likelihood.tracks, fit.likelihood.coordinates)
    return proposals(fit.modes, fit.likelihood.residuals, rates)


Moments = dict[str, tuple[np.ndarray, np.ndarray]]


def _moments(samples: Samples, reported: Reported) -> Moments:
    """Mean and sd of every quantity, each with its standard error."""
    values = reported.values(samples.points)
    flat = values.reshape(-1, values.shape[-1])
    mean, sd = flat.mean(axis=0), flat.std(axis=0)
    if "log_weight" in samples.statistics:
        weights = np.exp(samples.statistics["log_weight"].reshape(-1, 1))
        squares = (flat - mean) ** 2
        return {
            "mean": (mean, _weighted_error(flat, weights)),
            "sd": (sd, _weighted_error(squares, weights) / (2 * sd)),
        }
    series, squares = np.moveaxis(values, -1, 0), np.moveaxis((values - mean) ** 2, -1, 0)
    # arviz's own error of a standard deviation takes the effective size of the mean, which chains of NUTS, whose draws
    # alternate, have more of: half the error that squares show.
    return {
        "mean": (mean, array_stats.mcse(series, method="mean")),
        "sd": (sd, array_stats.mcse(squares, method="mean") / (2 * sd)),
    }


def _weighted_error(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Standard error of the mean of values that were resampled by normalised weights.

    The variance of a weighted mean, the sum of the squared weights times the squared deviations, is an expectation over
    the resampled values; resampling adds its own.
    """
    squares = (values - values.mean(axis=0)) ** 2
    error: np.ndarray = np.sqrt((weights * squares).mean(axis=0) + squares.mean(axis=0) / len(values))
    return error


def _comparisons(names: Sequence[str], moments: dict[str, Moments]) -> Iterator[Compared]:
    samplers = list(moments)
    for index, first in enumerate(samplers):
        for second in samplers[index + 1 :]:
            for what in ("mean", "sd"):
                (one, error), (other, other_error) = moments[first][what], moments[second][what]
                for name, difference in zip(names, (one - other) / np.hypot(error, other_error), strict=True):
                    yield Compared(name, what, (first, second), float(difference))

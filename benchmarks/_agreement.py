"""Whether all samplers say the same of the same scenes, in units of their own Monte Carlo errors."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from arviz_stats.base.array import array_stats

from tests.inference.generator import observe, random_scene
from vrdp_prob.inference import SAMPLERS, default_model
from vrdp_prob.inference.diagnostics import Reported
from vrdp_prob.inference.map_fit import MapFit, fit_map
from vrdp_prob.inference.proposals import proposals
from vrdp_prob.inference.samples import Samples, assess

DRAWS = 2000
SEEDS = {"emcee": 11, "nuts": 12, "laplace": 13}


@dataclass(frozen=True)
class Compared:
    """A quantity of a scene by two samplers: the difference of their means, or sds, over its standard error."""

    scene: int
    quantity: str
    what: str
    samplers: tuple[str, str]
    difference: float


def agreement(count: int, *, most_gradients: int | None = None) -> Iterator[tuple[int, dict[str, str], list[Compared]]]:
    """For each of some synthetic scenes what every sampler says of itself, and all comparisons of pairs of them."""
    for seed in range(count):
        fit = _fit(seed)
        reported = Reported.of(fit.likelihood.coordinates, fit.contacts)
        moments, verdicts = {}, {}
        for name, sampler in SAMPLERS.items():
            options = {"most_gradients": most_gradients} if name == "nuts" and most_gradients else {}
            samples = sampler(
                fit.likelihood.log_density,
                proposals(fit.modes, fit.likelihood.residuals),
                draws=DRAWS,
                generator=np.random.default_rng(SEEDS[name]),
                reported=reported,
                **options,
            )
            moments[name] = _moments(samples, reported)
            verdicts[name] = assess(name, samples, reported).sentence
        yield seed, verdicts, list(_comparisons(seed, reported.names, moments))


def _fit(seed: int) -> MapFit:
    scene = random_scene(np.random.default_rng(500 + seed), bodies=3 + seed % 2, squares=False)
    return fit_map(observe(scene, noise=0.01, dropout=0.03, seed=seed), default_model(), np.random.default_rng(seed))


def _moments(samples: Samples, reported: Reported) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Mean and sd of every quantity, each with its standard error."""
    values = reported.values(samples.points)
    flat = values.reshape(-1, values.shape[-1])
    mean, sd = flat.mean(axis=0), flat.std(axis=0)
    if samples.known is not None and samples.known.each is not None:
        effective = 1 / (1 / samples.known.each + 1 / len(flat))
        square_sd = ((flat - mean) ** 2).std(axis=0)
        return {"mean": (mean, sd / effective**0.5), "sd": (sd, square_sd / effective**0.5 / (2 * sd))}
    series = np.moveaxis(values, -1, 0)
    return {
        "mean": (mean, array_stats.mcse(series, method="mean")),
        "sd": (sd, array_stats.mcse(series, method="sd")),
    }


def _comparisons(
    scene: int, names: Sequence[str], moments: dict[str, dict[str, tuple[np.ndarray, np.ndarray]]]
) -> Iterator[Compared]:
    samplers = list(moments)
    for index, first in enumerate(samplers):
        for second in samplers[index + 1 :]:
            for what in ("mean", "sd"):
                (one, error), (other, other_error) = moments[first][what], moments[second][what]
                for name, difference in zip(names, (one - other) / np.hypot(error, other_error), strict=True):
                    yield Compared(scene, name, what, (first, second), float(difference))

"""Whether all samplers say the same of the same scenes, in units of their own Monte Carlo errors.

    python benchmarks/agreement.py [--json FILE] [--docs docs] [--scenes 20] [--show]

Scenes are those of the calibration: 2 or 3 bodies from the prior, cubes among them, motion by an integrator that is not
the simulator. They are taken in turn until all samplers say of so many of them that they have converged; those that are
quick or rarely converge go first, and where one has not converged the others are not asked. Compared are means and
standard deviations of all reported quantities, of each two samplers, from one fit, `laplace` without handing on to
emcee. Results are written to `--results` as they come, so that a run that was interrupted goes on; `--show` only reads
those that are there. `--docs` writes the table into `samplers.md` there.
"""

import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import count, islice
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))  # the scenes are those of the tests
os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import torch
from _clock import processor_seconds
from _page import page_parser, publish, table_row
from _resumable import Result, measured, read
from arviz_stats.base.array import array_stats

from tests.inference.prior_scenes import prior_scene
from vrdp_prob.errors import InputError
from vrdp_prob.inference import default_model
from vrdp_prob.inference.draws.diagnostics import Reported
from vrdp_prob.inference.draws.samples import Samples, assess
from vrdp_prob.inference.infer import sampled
from vrdp_prob.inference.map_fit import fit_map
from vrdp_prob.models.simulator.rollout import compile_model

SAMPLERS = {"laplace": 8000, "nuts": 1000, "emcee": 1000}
"""Draws of each, those first that are quick or rarely converge; many of the weighted ones, since they are resampled."""
SEEDS = {"emcee": 11, "nuts": 12, "laplace": 13}
OPTIONS: dict[str, dict[str, object]] = {"laplace": {"hand_on": False}, "nuts": {"processes": 1}}
"""Options by which a sampler is compared as itself, and keeps to one processor."""
FAR, TOO_FAR = 3.0, 5.0
"""Standard errors by which at most 1 % of the quantities, and by which none may differ."""
SHARE = 0.01
SCENES = 20
TOGETHER = 4
"""Scenes that are begun before it is counted again how many are there."""
MOST = 400
"""Scenes after which no further ones are tried."""
RESULTS = Path("out") / "agreement.jsonl"
REFUSED = "none"
"""In place of a sampler where the fit refuses the tracks: nothing moves in them."""

Moments = dict[str, tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Compared:
    """A quantity of a scene by two samplers: the difference of their means, or sds, over its standard error."""

    quantity: str
    what: str
    samplers: tuple[str, str]
    difference: float


def main(arguments: Sequence[str] | None = None) -> int:
    parser = page_parser(__doc__, RESULTS, document="checks")
    parser.add_argument("--scenes", type=int, default=SCENES, help="scenes in which all samplers have converged")
    parser.add_argument("--show", action="store_true", help="compute nothing, show the results there are")
    options = parser.parse_args(arguments)
    if options.show:
        results = read(options.results)
    else:
        compile_model(default_model())
        results = agreement(options.scenes, options.results, options.processes)
    publish(tables(results), "samplers.md", {"checks": checks(results, options.scenes)}, options)
    return 0


def agreement(scenes: int, path: Path, processes: int) -> list[Result]:
    """What samplers say of scenes, until all have converged in enough of them."""
    seeds = (seed for seed in count() if prior_scene(seed) is not None)
    asked: dict[int, int] = {}
    results: list[Result] = []
    while len(agreeing(results)) < scenes and len(asked) < MOST:
        asked |= {seed: seed for seed in islice(seeds, TOGETHER)}
        results = measured(one, asked, path, field="seed", label="Agreement of samplers", processes=processes)
    return results


def one(seed: int) -> Result:
    """What the samplers say of one scene."""
    torch.set_num_threads(1)
    scene = prior_scene(seed)
    assert scene is not None
    try:
        fit = fit_map(scene.tracks, default_model(), np.random.default_rng(seed))
    except InputError as refused:
        return {"seed": seed, "stopped": {"sampler": REFUSED, "sentence": str(refused)}, "compared": []}
    reported = Reported.of(fit.likelihood.coordinates, fit.contacts, fit.likelihood.tracks.bodies)
    moments: dict[str, Moments] = {}
    seconds: dict[str, float] = {}
    stopped = None
    for name, draws in SAMPLERS.items():
        begin = processor_seconds()
        generator = np.random.default_rng([seed, SEEDS[name]])
        samples = sampled(fit, name, draws=draws, generator=generator, reported=reported, **OPTIONS.get(name, {}))
        seconds[name] = processor_seconds() - begin
        verdict = assess(name, samples, reported)
        if not verdict.converged:
            stopped = {"sampler": name, "sentence": verdict.sentence}
            break
        moments[name] = _moments(samples, reported)
    compared = [] if stopped else [asdict(pair) for pair in _comparisons(reported.names, moments)]
    return {"seed": seed, "unknowns": len(fit.point), "seconds": seconds, "stopped": stopped, "compared": compared}


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


def agreeing(results: Sequence[Result]) -> list[Result]:
    """Scenes in which all samplers have converged."""
    return [result for result in results if result["stopped"] is None]


def tables(results: Sequence[Result]) -> str:
    """A row for each scene that was compared, which differences are beyond 3, and why others were not compared."""
    shown = agreeing(results)
    if not shown:
        return f"In none of {len(results)} scenes all samplers have converged."
    lines = [
        table_row("scene", "unknowns", *(f"`{name}`, s" for name in SAMPLERS), "compared", "beyond 3", "largest"),
        table_row(*["---"] * (5 + len(SAMPLERS))),
    ]
    for result in sorted(shown, key=lambda result: result["seed"]):
        sizes = _sizes([result])
        lines.append(
            table_row(
                str(result["seed"]),
                str(result["unknowns"]),
                *(f"{result['seconds'][name]:.0f}" for name in SAMPLERS),
                str(len(sizes)),
                str(int((sizes > FAR).sum())),
                f"{sizes.max():.1f}",
            )
        )
    sizes = _sizes(shown)
    lines += [
        "",
        f"Of {len(sizes)} means and standard deviations in {len(shown)} scenes {100 * _share(shown):.2f} % differ by "
        f"more than {FAR:g} standard errors (goal 1 %), none by more than {sizes.max():.1f} (goal {TOO_FAR:g}). "
        f"Looked at were {len(results)} scenes; in {_stopped(results)}. Seconds are those of the processor; commit "
        f"{_versions(results)}.",
    ]
    far = [
        f"- scene {result['seed']}, {pair['what']} of {pair['quantity']}, {' and '.join(pair['samplers'])}: "
        f"{pair['difference']:.1f}"
        for result in shown
        for pair in result["compared"]
        if abs(pair["difference"]) > FAR
    ]
    return "\n".join([*lines, *(["", *far] if far else [])])


def checks(results: Sequence[Result], scenes: int) -> list[dict[str, object]]:
    """Measured against what is wanted."""
    shown = agreeing(results)
    share, largest = (_share(shown), float(_sizes(shown).max())) if shown else (None, None)
    return [
        {
            "name": "scenes in which all samplers have converged",
            "value": len(shown),
            "goal": scenes,
            "ok": len(shown) >= scenes,
        },
        {
            "name": "share of quantities beyond 3 standard errors",
            "value": share,
            "goal": SHARE,
            "ok": share is not None and share <= SHARE,
        },
        {
            "name": "largest difference in standard errors",
            "value": largest,
            "goal": TOO_FAR,
            "ok": largest is not None and largest <= TOO_FAR,
        },
    ]


def _sizes(results: Sequence[Result]) -> np.ndarray:
    return np.array([abs(pair["difference"]) for result in results for pair in result["compared"]])


def _share(results: Sequence[Result]) -> float:
    """Share of the compared quantities that are far apart."""
    return float((_sizes(results) > FAR).mean())


def _stopped(results: Sequence[Result]) -> str:
    """How many scenes were not compared because of which sampler."""
    by = [result["stopped"]["sampler"] for result in results if result["stopped"]]
    stopped = ", ".join(f"{by.count(name)} `{name}`" for name in SAMPLERS) + " has not converged"
    return stopped + (f", in {refused} nothing moves" if (refused := by.count(REFUSED)) else "")


def _versions(results: Sequence[Result]) -> str:
    return ", ".join(sorted({str(result["version"]) for result in results}))


if __name__ == "__main__":
    sys.exit(main())

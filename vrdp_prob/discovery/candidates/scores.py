"""Score tests of causes at the strength at which they vanish, wherever and whenever they may act.

Sources: C. R. Rao, Large sample tests of statistical hypotheses, Proc. Cambridge Phil. Soc. 44 (1948); for a place or
time that exists only where the cause does, the largest statistic of a scan with its own null distribution: R. B.
Davies, Hypothesis testing when a nuisance parameter is present only under the alternative, Biometrika 64 (1977).
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from jaxtyping import Float
from scipy.stats import chi2

from vrdp_prob.discovery.candidates.first_guess import FirstGuess, Site
from vrdp_prob.discovery.candidates.probes import Probe, probes
from vrdp_prob.discovery.normal import BELOW_95
from vrdp_prob.discovery.residuals.jitter import jitter
from vrdp_prob.discovery.residuals.linear import RANK, Score
from vrdp_prob.discovery.residuals.look_elsewhere import anywhere, independent_places
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.inference.runs.parallel import in_parallel, in_processes
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.inference.several_videos.linking import Key
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.parameters import Parameter, Scope, Transform

REPLICATIONS = 400
"""Scans of noise, of which each scan of what is left is one by chance."""
SITE_LEVEL = 1e-3
"""An effect that happens once in a video is there if chance makes a statistic as large, anywhere, less often."""
OTHER_SIZE = 0.8
"""Share of the largest statistic from which on another size of what is looked for (the radius of a patch) is a start of
its own; a scan is coarse, and what lies on the way of few bodies may be as large as one likes."""
LEAST_START = 0.01
"""Smallest value of a positive strength at which a refit begins, as a share of its default."""


@dataclass(frozen=True)
class Largest:
    """How large a strength may be that was looked for at several places (bodies, videos, points of a search).

    Parameters
    ----------
    bound
        How far (95 %) it may be from where it vanishes, at the place where it may be largest of those that tell
        anything; None where none does.
    places, told
        Number of places, and of those that tell anything.
    strengths
        Estimate and standard deviation at each place that tells anything, if these are what the bound is made of.
    """

    bound: float | None
    places: int
    told: int
    strengths: tuple[tuple[float, float], ...] = ()

    def widened(self, factor: float) -> float | None:
        """The bound where standard deviations are larger by a factor than the residuals say."""
        if self.strengths:
            return max(abs(estimate) + factor * BELOW_95 * sd for estimate, sd in self.strengths)
        return None if self.bound is None else factor * self.bound


@dataclass(frozen=True, kw_only=True)
class CauseScore(FirstGuess):
    """What the residuals say of a cause that the model does not have.

    Parameters
    ----------
    chi_square, degrees
        The statistic that is least probable by chance, and its number of degrees of freedom.
    p_value
        Probability of a statistic as large anywhere if the cause is absent.
    largest
        By the name of a strength: how large it may be, at any searched point if videos share it, else at the best one
        of each body or video that it may belong to.
    by_video
        What each video has of the statistic, if videos share the strength; empty where that is not told apart.
    """

    chi_square: float
    degrees: int
    p_value: float
    largest: Mapping[str, Largest] = field(default_factory=dict)
    by_video: tuple[float, ...] = ()

    def few_videos(self, level: float) -> list[int]:
        """The fewest videos without which chance makes as large a statistic as is left more often than at a level.

        A wrong course of events calls for a cause in its video, a law in most of them. Where a cause has happened
        once, these are the videos in which it did.
        """
        if not self.by_video:
            return list(dict.fromkeys(site.video for site in self.sites))
        alone = float(chi2.sf(self.chi_square, self.degrees))
        may_be_told = alone > 0 and self.p_value > 0  # loud calls have some too small for numbers
        share = alone / self.p_value if may_be_told else 1.0
        least = float(chi2.isf(min(1.0, level * share), self.degrees))
        parts = np.array(self.by_video)
        order = np.argsort(-parts, kind="stable")
        left = self.chi_square - np.cumsum(parts[order])
        enough = np.flatnonzero(left < least)
        return order[: int(enough[0]) + 1 if len(enough) else len(order)].tolist()

    @property
    def size(self) -> float:
        """Twice the gain (nats) in log density that the cause promises, over all places where it is clear."""
        return max(self.chi_square, sum(site.chi_square for site in self.sites))


def happens_once(effect: Effect) -> bool:
    """Whether an effect happens at one time in one video, so that its parameters are not those of other videos."""
    return any(parameter.scope is Scope.VIDEO for parameter in effect.parameters)


def mends_any_course(effect: Effect) -> bool:
    """Whether an effect happens once, and what it does stands as well for a wrong course of events.

    What happens to the clock does not: it shifts bodies along their paths and bends none.
    """
    return happens_once(effect) and not effect.overrides("measured_times")


def score_causes(fit: SharedFit, model: ResidualModel, effects: Iterable[Effect], *, seed: int) -> list[CauseScore]:
    """Scores of causes that have a strength at which they vanish, the least probable by chance first."""
    vanishing = [effect for effect in effects if effect.vanishes_at or effect.vanishes_like]
    present = [one for one in in_processes(partial(_scanned, fit, model, seed), vanishing) if one is not None]
    return sorted(present, key=lambda one: (one.p_value, -one.chi_square))


def telling_rows(names: Sequence[str], effect: Effect) -> Float[np.ndarray, "telling strength"]:
    """What tells of an effect: each of its strengths, or how far those of one name are from the first of them."""
    rows = np.eye(len(names))
    for place, name in enumerate(names):
        if name in effect.told_by_differences:
            rows[place, names.index(name)] -= 1.0
    return rows[np.abs(rows).sum(axis=1) > 0]


def _scanned(fit: SharedFit, model: ResidualModel, seed: int, effect: Effect) -> CauseScore | None:
    if effect.overrides("frame_jitter"):
        return _scan_frames(model, effect)
    scan = _scan_once if happens_once(effect) else _scan_shared
    return scan(fit, model, effect, np.random.default_rng(seed))


def _probed(
    fit: SharedFit, model: ResidualModel, effect: Effect, points: Sequence[Sequence[Mapping[str, float]]]
) -> list[list[Probe]]:
    """What a cause does in each video, at search points of that video."""
    return in_parallel(
        lambda index: probes(fit, index, model.videos[index].noise, effect, points[index]), range(len(fit.fits))
    )


def _scan_shared(
    fit: SharedFit, model: ResidualModel, effect: Effect, generator: np.random.Generator
) -> CauseScore | None:
    """The largest score of strengths that all videos share."""
    points = effect.search_points(fit.tracks)
    probed = _probed(fit, model, effect, [points] * len(fit.fits))
    columns: dict[Key, int] = {}
    for index, video in enumerate(probed):
        for probe in video:
            columns.setdefault(_name(probe, index), len(columns))
    if not columns:
        return None
    names = [name for name, _ in columns]
    directions = []
    for index, (linear_video, found) in enumerate(zip(model.linear.videos, probed, strict=True)):
        block = np.zeros((linear_video.data, len(points), len(columns)))
        for probe in found:
            block[:, :, columns[_name(probe, index)]] = probe.directions.T
        directions.append(block)
    rows = telling_rows(names, effect)
    scores = [
        _one_sided(model.linear.score([one[:, p] for one in directions]).within(rows), names, effect)
        for p in range(len(points))
    ]
    statistics = np.array([score.chi_square for score in scores])
    best, *_ = places = _best_of_each_size(effect, points, statistics)
    degrees = scores[best].degrees
    if not degrees:
        return None
    blocks = [
        linear_video.without_own(linear_video.padded(one.reshape(len(one), -1))).reshape(-1, *one.shape[1:])
        for linear_video, one in zip(model.linear.videos, directions, strict=True)
    ]
    alone = _p_value(scores[best], names, effect)
    p_value = anywhere(alone, _places(blocks, degrees, generator))
    start, *others = (_start(effect, points[place], names, scores[place]) for place in places)
    largest = _largest([zip(names, score.estimate, score.sd, strict=True) for score in scores], effect)
    strengths = scores[best].estimate
    by_video = tuple(
        -float(left @ block[:, best] @ strengths) for left, block in zip(model.linear.left, blocks, strict=True)
    )
    chi_square = float(statistics[best])
    return CauseScore(
        effect,
        start,
        other_starts=tuple(others),
        chi_square=chi_square,
        degrees=degrees,
        p_value=p_value,
        largest=largest,
        by_video=by_video,
    )


def _scan_frames(model: ResidualModel, effect: Effect) -> CauseScore | None:
    """How probable it is that all frames are early or late by chance; the strength is a standard deviation."""
    found = jitter(model)
    if found is None:
        return None
    (name,) = effect.vanishes_at
    largest = {name: Largest(found.bound, 1, 1)}
    return CauseScore(
        effect, {name: found.value}, chi_square=found.chi_square, degrees=1, p_value=found.p_value, largest=largest
    )


def _largest(places: Sequence[Iterable[tuple[str, float, float]]], effect: Effect) -> dict[str, Largest]:
    """How large strengths may be, by name, from estimates and standard deviations at several places.

    A place where next to nothing was seen, of which less is told than is believed beforehand, tells nothing, unless no
    other tells more.
    """
    found: dict[str, list[tuple[int, float, float]]] = {}
    for place, strengths in enumerate(places):
        for name, estimate, sd in strengths:
            found.setdefault(name, []).append((place, float(estimate), float(sd)))
    expected = {parameter.name: _expected_size(parameter, effect) for parameter in effect.parameters}
    largest = {}
    for name, rows in found.items():
        seen = [row for row in rows if row[2] > 0]
        enough = max(expected[name], min((sd for *_, sd in seen), default=0.0))
        told = [row for row in seen if row[2] <= enough]
        each = tuple((estimate, sd) for _, estimate, sd in told)
        bound = max((abs(estimate) + BELOW_95 * sd for estimate, sd in each), default=None)
        largest[name] = Largest(bound, len({row[0] for row in rows}), len({row[0] for row in told}), each)
    return largest


def _expected_size(parameter: Parameter, effect: Effect) -> float:
    """How far a strength is believed to be from where it vanishes, in its unit."""
    if parameter.transform is Transform.IDENTITY:
        return parameter.prior.sd
    usual = effect.vanishes_at.get(parameter.name) or math.exp(parameter.prior.mean)
    return usual * parameter.prior.sd


def _name(probe: Probe, video: int) -> Key:
    """What a strength is shared as, or whose it is."""
    return probe.key or (probe.field, (f"video {video}", str(probe.owner)))


def _positive(effect: Effect) -> set[str]:
    """Strengths that cannot be less than where they vanish: what slips is slowed no less than what rolls."""
    return {
        one.name
        for one in effect.parameters
        if one.transform is Transform.LOG
        and (effect.vanishes_at.get(one.name) == 0.0 or one.name in effect.vanishes_like)
    }


def _p_value(score: Score, names: Sequence[str], effect: Effect) -> float:
    """Probability of as large a statistic of strengths, some of which cannot be negative, if there is nothing.

    With one of these it is chi-square with all degrees half of the time, else with one less; with more the same is an
    upper bound. Source: M. D. Perlman, One-sided testing problems in multivariate analysis, Ann. Math. Statist. 40
    (1969).
    """
    positive = _positive(effect)
    if not any(name in positive and sd > 0 for name, sd in zip(names, score.sd, strict=True)):
        return score.p_value
    if score.chi_square <= 0:
        return 1.0
    laws = [float(chi2.sf(score.chi_square, degrees)) for degrees in (score.degrees, score.degrees - 1) if degrees]
    return sum(laws) / 2


def _one_sided(score: Score, names: Sequence[str], effect: Effect) -> Score:
    """The score with strengths that cannot be negative at zero where the data ask for less than none of them."""
    positive = _positive(effect)
    left = list(range(len(names)))
    while True:
        bounded = np.zeros(len(names))
        bounded[left] = score.of(left).estimate
        negative = [k for k in left if bounded[k] < 0 and names[k] in positive]
        if not negative:
            break
        left.remove(min(negative, key=lambda k: score.gradient[k]))
    return score if len(left) == len(names) else Score(score.information @ bounded, score.information)


def _best_of_each_size(
    effect: Effect, points: Sequence[Mapping[str, float]], statistics: Float[np.ndarray, "point"]
) -> list[int]:
    """The best search point, and the best ones of other sizes that promise nearly as much, the best first."""
    sizes = [one.name for one in effect.parameters if one.transform is Transform.LOG]
    best: dict[tuple[float | None, ...], int] = {}
    for place in np.argsort(-statistics, kind="stable").tolist():
        best.setdefault(tuple(points[place].get(name) for name in sizes), place)
    first, *others = best.values()
    return [first, *(place for place in others if statistics[place] >= OTHER_SIZE * statistics[first])]


def _start(effect: Effect, point: Mapping[str, float], names: Sequence[str], score: Score) -> dict[str, float]:
    """Where a refit begins: at the estimates, positive where they have to be, and where the motion has a slope."""
    estimate = dict(zip(names, score.estimate.tolist(), strict=True))
    if len(estimate) < len(names):
        return dict(point)
    least = {one.name: LEAST_START * one.default for one in effect.parameters if one.transform is Transform.LOG}
    least |= effect.least_start
    return {**point, **{name: max(value, least.get(name, value)) for name, value in estimate.items()}}


def _places(
    blocks: Sequence[Float[np.ndarray, "_ point strength"]], degrees: int, generator: np.random.Generator
) -> float:
    """Number of independent places of a scan, from scans of noise."""
    points, strengths = blocks[0].shape[1:]
    if points == 1:
        return 1.0
    gradients = np.zeros((REPLICATIONS, points, strengths))
    information = np.zeros((points, strengths, strengths))
    for block in blocks:
        noise = generator.standard_normal((REPLICATIONS, len(block)))
        gradients += (noise @ block.reshape(len(block), -1)).reshape(gradients.shape)
        information += np.einsum("rps,rpt->pst", block, block)
    inverse = np.linalg.pinv(information, rcond=RANK, hermitian=True)
    largest = np.einsum("nps,pst,npt->np", gradients, inverse, gradients).max(axis=1)
    return independent_places(largest, degrees, points)


def _scan_once(
    fit: SharedFit, model: ResidualModel, effect: Effect, generator: np.random.Generator
) -> CauseScore | None:
    """The largest scores of strengths of single videos, and where they are."""
    points = [effect.search_points([tracks]) for tracks in fit.tracks]
    probed = _probed(fit, model, effect, points)
    sites, all_degrees = [], []
    strengths: list[Iterable[tuple[str, float, float]]] = []
    for index, video in enumerate(probed):
        for owner in sorted({probe.owner for probe in video}, key=str):
            mine = [probe for probe in video if probe.owner == owner]
            scores, block = model.linear.scores_in(index, np.stack([probe.directions.T for probe in mine], axis=2))
            best = max(range(len(scores)), key=lambda place: scores[place].chi_square)
            degrees = scores[best].degrees
            if not degrees:
                continue
            statistic = scores[best].chi_square
            p_value = anywhere(float(chi2.sf(statistic, degrees)), _places([block], degrees, generator))
            fields = [probe.field for probe in mine]
            values = {**points[index][best], **dict(zip(fields, scores[best].estimate.tolist(), strict=True))}
            sites.append(Site(index, owner, values, statistic, p_value))
            all_degrees.append(degrees)
            strengths.append(zip(fields, scores[best].estimate, scores[best].sd, strict=True))
    if not sites:
        return None
    order = sorted(range(len(sites)), key=lambda k: (sites[k].p_value, -sites[k].chi_square))
    first = sites[order[0]]
    p_value = min(1.0, first.p_value * len(sites))
    clear = tuple(sites[k] for k in order if sites[k].p_value * len(sites) < SITE_LEVEL)
    degrees = all_degrees[order[0]]
    return CauseScore(
        effect,
        {},
        clear,
        len(sites),
        chi_square=first.chi_square,
        degrees=degrees,
        p_value=p_value,
        largest=_largest(strengths, effect),
    )

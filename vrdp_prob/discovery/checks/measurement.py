"""Whether the measurement is what the model believes: clock, lens, outliers, and noise without memory."""

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.stats import chi2, poisson

from vrdp_prob.discovery.checks.flight import SEEN
from vrdp_prob.discovery.checks.replications import sum_p_value, two_sided_p_value
from vrdp_prob.discovery.finding import Check
from vrdp_prob.discovery.residuals.fitted_motion import FittedMotion
from vrdp_prob.discovery.residuals.free_flight import NORMAL_95, FreeFlight
from vrdp_prob.discovery.residuals.residual_model import ResidualModel, VideoResiduals
from vrdp_prob.discovery.words import number, opposite
from vrdp_prob.scene.third_differences import NORMAL_MAD

LOST, SINGLE, OUTLIERS = "time stamps: lost frames", "time stamps: single frames", "outliers"
MEMORY, SIZE = GENERAL = ("memory of the residuals", "size of the residuals")
"""Checks that say that something is wrong, and not what."""
DISTORTION = "distortion of positions"
CUBIC_NOISE_GAIN = 20.0
"""Variance of a third difference of independent noise of unit variance: 1 + 9 + 9 + 1."""
GROSS = 1e-4
"""A position is grossly off if noise puts it as far from those before and after less often."""
FEWEST = 30
"""Numbers that are needed to judge their scatter."""
CONTACT_FRAMES = 2.5
"""Frames around a contact in which a position may be off because the contact comes a little earlier or later."""

Replicas = Sequence[Float[np.ndarray, "_ replica"]]


def measurement_checks(
    model: ResidualModel, replicas: Replicas, flight: FreeFlight, beside: Replicas, generator: np.random.Generator
) -> Iterator[Check]:
    """All checks of the measurement.

    Parameters
    ----------
    model, replicas
        The residuals, and those of each video that noise alone leaves.
    flight, beside
        The patterns of free flight, and what noise leaves where these may show, and contacts leave any velocity. Clock
        and lens are looked for beside all that.
    generator
        Source of randomness, for outliers.
    """
    yield from _clock_checks(flight.beside, beside)
    yield from _lens_check(flight)
    yield from _outlier_check(model, replicas[0].shape[1], generator)
    yield from _noise_checks(model, replicas)


def _clock_checks(model: ResidualModel, replicas: Replicas) -> Iterator[Check]:
    lost, jitter = 0.0, 0.0
    lost_replicas, jitter_replicas = (np.zeros(replicas[0].shape[1]) for _ in range(2))
    strongest, where = (0.0, 0.0), ""
    squares, weights = 0.0, 0.0
    for index, (video, noise) in enumerate(zip(model.videos, replicas, strict=True)):
        motion, frames = video.motion, video.late_frames
        from_there = frames @ np.tril(np.ones((len(motion.times), len(motion.times))))
        late, single = (_scanned(model, index, rows, noise) for rows in (from_there, frames))
        lost += float(late.statistic.max(initial=0.0))
        lost_replicas += late.replicas.max(axis=0, initial=0.0)
        jitter += float(single.statistic.sum())
        jitter_replicas += single.replicas.sum(axis=0)
        squares += float((single.gradient**2 - single.information).sum())
        weights += float((single.information**2).sum()) / model.dispersion
        if len(late.statistic) and late.statistic.max() > strongest[0]:
            best = int(late.statistic.argmax())
            size = np.sqrt(model.dispersion) * late.gradient[best] / late.information[best]
            strongest = float(late.statistic[best]), float(size)
            where = f"video {video.linear.name} from {number(float(motion.times[late.frames[best]]))} s on"
    p_value = sum_p_value(lost, lost_replicas)
    sentence = (
        f"All bodies jump {opposite(strongest[1], 'back', 'ahead')} along their paths together, as if frames were "
        f"missing: most in {where}, by {number(abs(strongest[1]))} s."
        if p_value < SEEN
        else "No jump of all bodies along their paths was seen."
    )
    yield Check(LOST, abs(strongest[1]), p_value, False, sentence)
    p_value = sum_p_value(jitter, jitter_replicas)
    spread = float(np.sqrt(max(squares, 0.0) / weights)) if weights else 0.0
    sentence = (
        f"Single frames come too early or too late for all bodies, by {number(spread)} s (standard deviation)."
        if p_value < SEEN
        else "No frame comes too early or too late for all bodies."
    )
    yield Check(SINGLE, spread, p_value, False, sentence)


class _Scan:
    """A pattern at each of some frames of one video: its statistic, that of replications, and what it is made of.

    Gradients are those of residuals of unit variance.
    """

    def __init__(
        self,
        frames: Int[np.ndarray, "place"],
        gradient: Float[np.ndarray, "place"],
        information: Float[np.ndarray, "place"],
        replicas: Float[np.ndarray, "place replica"],
    ) -> None:
        self.frames, self.gradient, self.information = frames, gradient, information
        self.statistic = gradient**2 / information
        self.replicas = replicas**2 / information[:, None]


def _scanned(
    model: ResidualModel,
    index: int,
    rows: Float[np.ndarray, "data frame"],
    noise: Float[np.ndarray, "residual replica"],
) -> _Scan:
    scores, blocks = model.linear.scores_in(index, rows[:, :, None])
    whole = (rows**2).sum(axis=0)
    information = np.array([float(score.information[0, 0]) for score in scores])
    shown = np.flatnonzero((whole > 0) & (information > 1e-3 * whole))
    gradient = np.array([float(scores[k].gradient[0]) for k in shown])
    scale = np.sqrt(model.dispersion)
    return _Scan(shown, gradient / scale, information[shown], blocks[:, shown, 0].T @ noise)


def _lens_check(flight: FreeFlight) -> Iterator[Check]:
    model, middle = flight.beside, flight.scales.middle
    lens = model.score([video.rows(_bent(video.motion, middle)) for video in model.videos])
    if not lens.degrees:
        return
    strength = float(lens.estimate[0])
    far = max(float(np.nanmax(np.linalg.norm(v.motion.tracks.positions - middle, axis=-1))) for v in model.videos)
    edge = abs(strength) * far**3
    sentence = (
        f"Positions are displaced {opposite(strength, 'towards', 'away from')} the middle of the picture with the cube "
        f"of the distance: by {number(edge)} m at {number(far)} m from it."
        if lens.p_value < SEEN
        else f"Nothing seen; {number(NORMAL_95 * float(lens.of([0], [1, 2]).sd[0]) * far**3)} m at {number(far)} m "
        "from the middle would have shown."
    )
    yield Check(DISTORTION, edge, lens.p_value, False, sentence)


def _bent(motion: FittedMotion, middle: Float[np.ndarray, "2"]) -> Float[np.ndarray, "time body 2 3"]:
    """Displacements by a lens of strength 1 (1/m^2) about a middle, and by other places of the middle."""
    apart = motion.position - middle
    squares = (apart**2).sum(axis=-1)[..., None]
    moved = [squares * np.eye(2)[axis] + 2 * apart[..., axis, None] * apart for axis in range(2)]
    return np.stack([squares * apart, *moved], axis=-1)


def _outlier_check(model: ResidualModel, count: int, generator: np.random.Generator) -> Iterator[Check]:
    found, total, expected = 0, 0, 0.0
    for video in model.videos:
        triples = _runs(video, 3)
        observations = video.likelihood.observations
        residuals = np.einsum("oij,oj->oi", observations.whitening / video.noise.scale, video.raw)
        found += int(_gross(residuals[..., None], triples).sum())
        drawn = video.noise.draws((len(residuals), 2, count), generator)
        expected += float(_gross(drawn, triples).sum()) / count
        total += triples.shape[1]
    if not total:
        return
    p_value = float(poisson.sf(found - 1, max(expected, 1.0 / count)))
    share = found / total
    sentence = (
        f"{found} of {total} positions ({number(100 * share)} %) lie far off those before and after; the noise puts "
        f"{number(expected)} there."
        if p_value < SEEN
        else f"{found} of {total} positions lie far off those before and after, as many as the noise puts there."
    )
    yield Check(OUTLIERS, share, p_value, False, sentence)


def _gross(
    residuals: Float[np.ndarray, "observation 2 column"], triples: Int[np.ndarray, "3 triple"]
) -> Bool[np.ndarray, "triple column"]:
    """Whether the middle one of three residuals is far off both others, and off their mean."""
    before, here, after = (residuals[row] for row in triples)
    apart = ((here - before, 2.0), (here - after, 2.0), (here - (before + after) / 2, 1.5))
    squares = [(difference**2).sum(axis=1) / variance for difference, variance in apart]
    return np.asarray(np.min(squares, axis=0) > chi2.isf(GROSS, 2))


def _noise_checks(model: ResidualModel, replicas: Replicas) -> Iterator[Check]:
    products, drawn, squares = 0.0, np.zeros(replicas[0].shape[1]), 0.0
    fourths, drawn_fourths = [], []
    for video, left, noise in zip(model.videos, model.left, replicas, strict=True):
        observed, simulated = (one[: video.positions].reshape(-1, 2, one.shape[-1]) for one in (left[:, None], noise))
        first, second = _runs(video, 2, near_contacts=True)
        products += float((observed[first] * observed[second]).sum())
        squares += float((observed[first] ** 2).sum())
        drawn += (simulated[first] * simulated[second]).sum(axis=(0, 1))
        runs = _runs(video, 4)
        fourths.append(_third_difference(observed, runs).ravel())
        drawn_fourths.append(_third_difference(simulated, runs).reshape(-1, simulated.shape[-1]))
    if not squares:
        return
    dispersion = model.dispersion
    p_value = two_sided_p_value(products / dispersion, drawn)
    correlation = (products - dispersion * float(drawn.mean())) / squares
    sentence = (
        f"What is left in neighbouring frames is alike (correlation {number(correlation)}): the noise has a memory, or "
        "the motion is not that of the model."
        if p_value < SEEN
        else "What is left in neighbouring frames is as independent as noise."
    )
    yield Check(MEMORY, correlation, p_value, False, sentence)
    rough, drawn_rough = np.concatenate(fourths), np.concatenate(drawn_fourths)
    if len(rough) < FEWEST:
        return
    squared = np.array([_squared_sd(column) for column in drawn_rough.T])
    pairs = zip(model.videos, replicas, strict=True)
    totals = np.sum([(one[: video.linear.data] ** 2).sum(axis=0) for video, one in pairs], axis=0)
    ratio = dispersion / _squared_sd(rough)
    p_value = two_sided_p_value(float(np.log(ratio)), np.log(totals / model.linear.degrees / squared))
    sentence = (
        f"Residuals are {number(float(np.sqrt(ratio)))} times as large as the roughness of the tracks."
        if p_value < SEEN
        else "Residuals are as large as the roughness of the tracks."
    )
    yield Check(SIZE, float(np.sqrt(ratio)), p_value, False, sentence)


def roughness(model: ResidualModel) -> float:
    """Mean square of the residuals if they were as large as the roughness of the tracks; that of all where unknown."""
    differences = [
        _third_difference(left[: video.positions].reshape(-1, 2, 1), _runs(video, 4)).ravel()
        for video, left in zip(model.videos, model.left, strict=True)
    ]
    rough = np.concatenate(differences)
    return min(_squared_sd(rough), model.dispersion) if len(rough) >= FEWEST else model.dispersion


def _runs(video: VideoResiduals, length: int, *, near_contacts: bool = False) -> Int[np.ndarray, "length run"]:
    """Observations of one body in so many frames in a row, apart from contacts unless these are asked for."""
    motion, observations = video.motion, video.likelihood.observations
    place: Int[np.ndarray, "time body"] = np.full(motion.tracks.seen.shape, -1)
    place[observations.frame, observations.body] = np.arange(len(observations.frame))
    if not near_contacts:
        for body in range(len(motion.tracks.bodies)):
            for time in motion.contact_times(body):
                place[np.abs(motion.times - time) < CONTACT_FRAMES * motion.frame_time, body] = -1
    last = len(place) - length + 1
    rows = np.array([place[k : k + max(last, 0)].ravel() for k in range(length)])
    return rows[:, (rows >= 0).all(axis=0)]


def _third_difference(
    residuals: Float[np.ndarray, "observation 2 column"], runs: Int[np.ndarray, "4 run"]
) -> Float[np.ndarray, "run 2 column"]:
    first, second, third, fourth = (residuals[row] for row in runs)
    return fourth - 3 * third + 3 * second - first


def _squared_sd(differences: Float[np.ndarray, "number"]) -> float:
    return float(np.median(np.abs(differences)) / NORMAL_MAD) ** 2 / CUBIC_NOISE_GAIN

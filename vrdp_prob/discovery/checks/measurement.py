"""Whether the measurement is what the model believes: clock, lens, outliers, and noise without memory."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float
from scipy.stats import chi2, poisson

from vrdp_prob.discovery.checks.clock import clock_checks
from vrdp_prob.discovery.checks.false_discovery import SEEN
from vrdp_prob.discovery.checks.neighbours import (
    FEWEST,
    FramesApart,
    Replicas,
    apart_from_neighbours,
    squared_sd,
    third_differences,
)
from vrdp_prob.discovery.checks.replications import two_sided_p_value
from vrdp_prob.discovery.finding import Check
from vrdp_prob.discovery.normal import WITHIN_95
from vrdp_prob.discovery.residuals.fitted_motion import FittedMotion
from vrdp_prob.discovery.residuals.free_flight import FreeFlight
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.discovery.words import number, opposite

OUTLIERS = "outliers"
MEMORY, SIZE = GENERAL = ("memory of the residuals", "size of the residuals")
"""Checks that say that something is wrong, and not what."""
DISTORTION = "distortion of positions"
GROSS = float(np.sqrt(chi2.isf(1e-4, 2)))
"""A position is grossly off from so many standard deviations on; normal noise puts one in ten thousand there."""


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
    yield from clock_checks(flight.beside, beside)
    yield from _lens_check(flight)
    yield from _outlier_check(model, replicas[0].shape[1], generator)
    yield from _noise_checks(model, replicas)


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
        else f"Nothing seen; {number(WITHIN_95 * float(lens.of([0], [1, 2]).sd[0]) * far**3)} m at {number(far)} m "
        "from the middle would have shown."
    )
    yield Check(DISTORTION, edge, lens.p_value, False, sentence, log_p_value=lens.log_p_value)


def _bent(motion: FittedMotion, middle: Float[np.ndarray, "2"]) -> Float[np.ndarray, "time body 2 3"]:
    """Displacements by a lens of strength 1 (1/m^2) about a middle, and by other places of the middle."""
    apart = motion.position - middle
    squares = (apart**2).sum(axis=-1)[..., None]
    moved = [squares * np.eye(2)[axis] + 2 * apart[..., axis, None] * apart for axis in range(2)]
    return np.stack([squares * apart, *moved], axis=-1)


def _outlier_check(model: ResidualModel, count: int, generator: np.random.Generator) -> Iterator[Check]:
    found, total, expected = 0, 0, 0.0
    for video in model.videos:
        apart, by_chance = apart_from_neighbours(video, count, generator)
        found += int((apart > GROSS).sum())
        expected += float((by_chance > GROSS).sum()) / count
        total += len(apart)
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


def _noise_checks(model: ResidualModel, replicas: Replicas) -> Iterator[Check]:
    apart = FramesApart.of(model, replicas, 1)
    if apart is None:
        return
    p_value = two_sided_p_value(apart.products, apart.drawn_products)
    sentence = (
        f"What is left in neighbouring frames is alike (correlation {number(apart.correlation)}): the noise has a "
        "memory, or the motion is not that of the model."
        if p_value < SEEN
        else "What is left in neighbouring frames is as independent as noise."
    )
    yield Check(MEMORY, apart.correlation, p_value, False, sentence)
    rough = third_differences(model, [left[:, None] for left in model.left])
    if len(rough) < FEWEST:
        return
    squared = squared_sd(third_differences(model, replicas))
    pairs = zip(model.videos, replicas, strict=True)
    totals = np.sum([(one[: video.linear.data] ** 2).sum(axis=0) for video, one in pairs], axis=0)
    ratio = model.dispersion / float(squared_sd(rough)[0])
    p_value = two_sided_p_value(float(np.log(ratio)), np.log(totals / model.linear.degrees / squared))
    sentence = (
        f"Residuals are {number(float(np.sqrt(ratio)))} times as large as the roughness of the tracks."
        if p_value < SEEN
        else "Residuals are as large as the roughness of the tracks."
    )
    yield Check(SIZE, float(np.sqrt(ratio)), p_value, False, sentence)

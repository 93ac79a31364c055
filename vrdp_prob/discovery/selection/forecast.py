"""How far off a model's predictions of videos are that it was not fitted to.

What a video shares with others is what the others say; its own unknowns (release states, masses, ...) are fitted to its
first part, and the rest is predicted.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np
import torch
from jaxtyping import Float
from scipy.stats import norm

from vrdp_prob.discovery.finding import ErrorRatio, HeldOut, VideoErrors
from vrdp_prob.discovery.normal import WITHIN_50, WITHIN_90
from vrdp_prob.discovery.residuals.held_out import Cavity
from vrdp_prob.inference.runs.parallel import in_parallel
from vrdp_prob.inference.search.least_squares import jacobian, minimise
from vrdp_prob.inference.search.noise_fit import NOISE_FIELDS
from vrdp_prob.inference.several_videos.linking import LinkedVideo
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.noise import NoiseFamily
from vrdp_prob.models.unknowns import DEGREES_OF_FREEDOM

SEEN_SHARE = 0.6
"""Share of a video's frames to which its own unknowns are fitted."""
AHEAD = 1.0
"""Time in s after the last of them at which the error is looked at."""
AROUND = 2
"""Frames on each side over which it is averaged, and twice as many at the end."""
TENTHS = 10
FEWEST_SEEN = 2
"""Times that a body must have been seen by then, for what comes next to be predicted."""
ITERATIONS = 20
FEWEST_VIDEOS = 5
"""Videos that must tell of an error for its change to be told with an interval: of fewer none holds 95 %."""
REPLICATIONS = 2000


@dataclass(frozen=True)
class Forecast:
    """Errors of the predicted part of one video.

    Parameters
    ----------
    ahead
        Time in s after the last fitted frame.
    squares
        Squared error per axis in m^2.
    standardised
        Error per axis in standard deviations of the prediction.
    """

    ahead: Float[np.ndarray, "observation"]
    squares: Float[np.ndarray, "observation"]
    standardised: Float[np.ndarray, "observation 2"]


def held_out(videos: Sequence[LinkedVideo], points: Sequence[np.ndarray], cavities: Sequence[Cavity]) -> HeldOut:
    """Errors over all videos, each predicted from the others and its own first part.

    Parameters
    ----------
    videos
        The videos.
    points
        Their vectors in the joint fit, near which the own unknowns are looked for.
    cavities
        What the other videos say.
    """
    forecasts = in_parallel(lambda k: _forecast(videos[k], points[k], cavities[k]), range(len(videos)))
    errors = np.concatenate([one.standardised.ravel() for one in forecasts])
    standardised = np.abs(errors)
    frame = min(float(np.median(np.diff(video.likelihood.tracks.times))) for video in videos)
    one_second = [np.abs(one.ahead - AHEAD) <= (AROUND + 0.5) * frame for one in forecasts]
    end = [one.ahead > one.ahead.max(initial=0.0) - (2 * AROUND + 0.5) * frame for one in forecasts]
    by_video = tuple(
        VideoErrors(_error(one.squares), _error(one.squares[near]), _error(one.squares[late]))
        for one, near, late in zip(forecasts, one_second, end, strict=True)
    )
    return HeldOut(
        rmse=math.nan if (rmse := _in_the_middle([one.rmse for one in by_video])) is None else rmse,
        rmse_one_second=_in_the_middle([one.rmse_one_second for one in by_video]),
        rmse_end=_in_the_middle([one.rmse_end for one in by_video]),
        coverage_50=float((standardised < WITHIN_50).mean()),
        coverage_90=float((standardised < WITHIN_90).mean()),
        pit=_tenths(errors),
        by_video=by_video,
    )


def error_ratios(before: HeldOut, after: HeldOut) -> Mapping[str, ErrorRatio]:
    """Errors of one prediction of some videos in units of those of another, each video compared with itself.

    Intervals are those of the median over videos that are drawn anew; without numbers where there are too few.
    """
    found = {}
    for stretch in (one.name for one in fields(VideoErrors)):
        pairs = [
            (getattr(first, stretch), getattr(second, stretch))
            for first, second in zip(before.by_video, after.by_video, strict=True)
        ]
        known = np.array([pair for pair in pairs if None not in pair], dtype=float).reshape(-1, 2)
        known = known[(np.isfinite(known) & (known > 0)).all(axis=1)]
        logs = np.log(known[:, 1] / known[:, 0])
        if not len(logs):
            continue
        middle = math.exp(float(np.median(logs)))
        if len(logs) < FEWEST_VIDEOS:
            found[stretch] = ErrorRatio(middle, math.nan, math.nan)
            continue
        drawn = np.random.default_rng(0).choice(logs, size=(REPLICATIONS, len(logs)))
        low, high = np.exp(np.quantile(np.median(drawn, axis=1), [0.025, 0.975]))
        found[stretch] = ErrorRatio(middle, float(low), float(high))
    return found


def _tenths(standardised: Float[np.ndarray, "error"]) -> tuple[float, ...]:
    """Shares of the observations in the tenths of their predictive distributions."""
    if not len(standardised):
        return ()
    below = norm.cdf(-standardised)  # of the prediction, whose errors these are, lies so much below what was observed
    counts, _ = np.histogram(below, bins=TENTHS, range=(0.0, 1.0))
    return tuple((counts / counts.sum()).tolist())


def _error(squares: Float[np.ndarray, "_"]) -> float | None:
    """Root mean square error; None where there is none."""
    return float(np.sqrt(squares.mean())) if len(squares) else None


def _in_the_middle(errors: Sequence[float | None]) -> float | None:
    """Error of the video in the middle; None where no video has one."""
    known = [one for one in errors if one is not None]
    return float(np.median(known)) if known else None


def _forecast(video: LinkedVideo, point: Float[np.ndarray, "dimension"], cavity: Cavity) -> Forecast:
    likelihood = video.data
    coordinates, observations, tracks = likelihood.coordinates, likelihood.observations, likelihood.tracks
    frames = max(int(SEEN_SHARE * len(tracks.times)), 2)
    start = point.copy()
    start[video.shared_places] = cavity.mean[video.shared_columns] + video.offset
    world = ~coordinates.mask(NOISE_FIELDS)
    own = np.zeros(len(coordinates), dtype=bool)
    own[video.local_places] = True

    def early(points: Float[np.ndarray, "point dimension"]) -> Float[np.ndarray, "point residual"]:
        return likelihood.residuals(points, frames)

    fitted = minimise(early, start, coordinates.scale, active=own & world, iterations=ITERATIONS).point
    _, known = jacobian(early, fitted, coordinates.scale, active=world, central=True)
    residuals, derivative = jacobian(likelihood.residuals, fitted, coordinates.scale, active=world, central=True)
    precision = known.T @ known
    shared = video.shared_places
    columns = np.ix_(video.shared_columns, video.shared_columns)
    precision[np.ix_(shared, shared)] += np.linalg.inv(cavity.covariance[columns])
    used = np.flatnonzero(world)
    covariance = np.linalg.pinv(precision[np.ix_(used, used)], rcond=1e-12, hermitian=True)
    count = len(observations.frame)
    begun = np.bincount(observations.body[observations.frame < frames], minlength=len(tracks.bodies)) >= FEWEST_SEEN
    late = (observations.frame >= frames) & begun[observations.body]
    scale = _unit_scale(likelihood, fitted)
    rows = scale * derivative[: 2 * count, used]
    variance = 1.0 + np.einsum("ri,ij,rj->r", rows, covariance, rows).reshape(count, 2)
    predicted = likelihood.predicted(torch.from_numpy(fitted[None]))[0, :, :, :2]
    errors = (predicted - tracks.positions)[observations.frame, observations.body]
    return Forecast(
        ahead=tracks.times[observations.frame[late]] - tracks.times[frames - 1],
        squares=(errors[late] ** 2).mean(axis=1),
        standardised=(scale * residuals[: 2 * count].reshape(count, 2) / np.sqrt(variance))[late],
    )


def _unit_scale(likelihood: Likelihood, point: Float[np.ndarray, "dimension"]) -> float:
    """Factor by which residuals of positions are standard normal where the model is right.

    The root of twice the negative log density of a bivariate Student-t variable is a normal one with a variance of
    (nu + 2) / nu.
    """
    if likelihood.noise is NoiseFamily.GAUSSIAN:
        return 1.0
    degrees = float(likelihood.coordinates.quantities(torch.from_numpy(point[None]))[DEGREES_OF_FREEDOM][0, 0])
    return math.sqrt(degrees / (degrees + 2))

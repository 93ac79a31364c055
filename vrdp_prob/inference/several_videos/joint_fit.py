"""The most probable values of several videos at once, the Gaussian around them, and further modes of single videos."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import solve_triangular

from vrdp_prob.inference.draws.samples import evaluate_with_gradient
from vrdp_prob.inference.runs.parallel import in_parallel
from vrdp_prob.inference.search.least_squares import jacobian, minimise
from vrdp_prob.inference.search.noise_fit import NOISE_FIELDS, noise_curvature
from vrdp_prob.inference.search.prior_mass import log_prior_constant
from vrdp_prob.inference.several_videos.arrow import (
    LOG_TWO_PI,
    ArrowGaussian,
    Expansion,
    Expansions,
    LocalGaussian,
    SharedExpansion,
)
from vrdp_prob.inference.several_videos.following import MOST_STEPS, SLACK, follow
from vrdp_prob.inference.several_videos.linking import LinkedVideo, SharedNumbers
from vrdp_prob.models.coordinates import Coordinates

LOCAL_ITERATIONS = 8
SAME_MODE = 1.5
"""Searches that end within so many standard deviations of each other have found the same mode."""
HOPELESS = 12.0
"""Modes whose weight (nats) is so much lower than the best one's are left out."""


@dataclass(frozen=True)
class LocalMode:
    """A mode of a video's own numbers.

    Parameters
    ----------
    gaussian
        The Gaussian around it.
    log_weight
        Log of its weight by Laplace's approximation, where the heaviest mode has 0.
    """

    gaussian: LocalGaussian
    log_weight: float


@dataclass(frozen=True)
class JointFit:
    """The most probable values of several videos and the Gaussian around them.

    Parameters
    ----------
    numbers
        The shared numbers.
    videos
        The videos in terms of them.
    gaussian
        Gaussian around the most probable values, which are its mean.
    log_density
        Log posterior (nats, up to the constants of the priors and of the data) there.
    converged
        Whether the next step promises next to nothing in the videos that are at no edge.
    alternatives
        Further modes of each video's own numbers, where the shared ones are at their mean.
    """

    numbers: SharedNumbers
    videos: tuple[LinkedVideo, ...]
    gaussian: ArrowGaussian
    log_density: float
    converged: bool
    alternatives: tuple[tuple[LocalMode, ...], ...] = ()

    @cached_property
    def log_evidence(self) -> float:
        """Log probability (nats) of the tracks under the model by Laplace's approximation.

        It holds the priors' constants but not those of the data, so only differences between models of the same tracks
        mean something.
        """
        constants = log_prior_constant(self.numbers.entries)
        for video in self.videos:
            entries = video.likelihood.coordinates.entries
            constants += log_prior_constant(entries[place] for place in video.local_places)
        gaussian = self.gaussian
        return self.log_density + constants + gaussian.dimension * LOG_TWO_PI / 2 + gaussian.log_volume

    def modes(self, index: int) -> tuple[LocalMode, ...]:
        """Modes of one video's own numbers, that of the fit first."""
        return self.alternatives[index] if self.alternatives else (LocalMode(self.gaussian.locals[index], 0.0),)

    def precision(self, index: int) -> Float[np.ndarray, "dimension dimension"]:
        """Curvature of the negative log posterior of one video's vector, the other videos integrated out."""
        video, gaussian = self.videos[index], self.gaussian
        own, local = video.local_places, gaussian.locals[index]
        slope = local.slope[:, video.shared_columns]
        covariance = (gaussian.root @ gaussian.root.T)[np.ix_(video.shared_columns, video.shared_columns)]
        result = np.zeros((len(own) + len(slope.T), len(own) + len(slope.T)))
        inverse = solve_triangular(local.root, np.eye(len(own)), lower=True)
        precision = inverse.T @ inverse
        result[np.ix_(own, own)] = precision
        result[np.ix_(own, video.shared_places)] = -precision @ slope
        result[np.ix_(video.shared_places, own)] = -slope.T @ precision
        result[np.ix_(video.shared_places, video.shared_places)] = (
            np.linalg.inv(covariance) + slope.T @ precision @ slope
        )
        return result

    def point(self, index: int) -> Float[np.ndarray, "dimension"]:
        """Most probable vector of one video."""
        return self.videos[index].points(self.gaussian.mean, self.gaussian.locals[index].centre)


def expand(
    video: LinkedVideo,
    shared: Float[np.ndarray, "shared"],
    local: Float[np.ndarray, "local"],
) -> Expansion:
    """Expand a video's negative log density; the gradient is exact, the curvature that of its residuals."""
    likelihood, point = video.data, video.points(shared, local)
    _, derivative = jacobian(likelihood.residuals, point, likelihood.coordinates.scale, central=True)
    places, noise = noise_curvature(likelihood, point)
    derivative[:, places] = 0.0
    _, gradient = evaluate_with_gradient(likelihood.log_density, point[None])
    own, used, columns = video.local_places, video.shared_places, video.shared_columns
    rows = [derivative, _noise_rows(places, noise, len(point)), _prior_rows(likelihood.coordinates, derivative, own)]
    derivative = np.concatenate(rows)
    shared_gradient, shared_derivative = np.zeros(len(shared)), np.zeros((len(derivative), len(shared)))
    shared_gradient[columns] = -gradient[0, used]
    shared_derivative[:, columns] = derivative[:, used]
    return Expansion(shared_gradient, -gradient[0, own], shared_derivative, derivative[:, own])


def _noise_rows(
    places: Int[np.ndarray, "noise"], curvature: Float[np.ndarray, "noise noise"], dimension: int
) -> Float[np.ndarray, "noise dimension"]:
    """Residual derivatives that make up the curvature along the noise scales."""
    rows = np.zeros((len(places), dimension))
    values, vectors = np.linalg.eigh(curvature)
    rows[:, places] = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
    return rows


def _prior_rows(
    coordinates: Coordinates, derivative: Float[np.ndarray, "residual dimension"], own: Int[np.ndarray, "local"]
) -> Float[np.ndarray, "lost dimension"]:
    """Priors of own numbers whose derivative is lost, since the worlds on the way fail."""
    lost = own[~coordinates.mask(NOISE_FIELDS)[own] & ~derivative[:, own].any(axis=0)]
    rows = np.zeros((len(lost), derivative.shape[1]))
    rows[np.arange(len(lost)), lost] = 1 / coordinates.prior_sd[lost]
    return rows


def expand_prior(numbers: SharedNumbers, shared: Float[np.ndarray, "shared"]) -> SharedExpansion:
    """Expand the negative log prior of the shared numbers."""
    if not len(numbers):
        return SharedExpansion(np.zeros(0), np.zeros((0, 0)))
    residuals, derivative = jacobian(numbers.prior_residuals, shared, numbers.scale, central=True)
    return SharedExpansion(derivative.T @ residuals, derivative)


def expand_all(
    numbers: SharedNumbers,
    videos: Sequence[LinkedVideo],
    shared: Float[np.ndarray, "shared"],
    locals_: Sequence[Float[np.ndarray, "_"]],
) -> Expansions:
    """Expand the negative log density of all videos, and the prior of what they share."""
    found = in_parallel(lambda index: expand(videos[index], shared, locals_[index]), range(len(videos)))
    return Expansions(expand_prior(numbers, shared), tuple(found))


def settle(
    video: LinkedVideo, shared: Float[np.ndarray, "shared"], starts: Sequence[Float[np.ndarray, "local"]]
) -> Float[np.ndarray, "local"]:
    """Best own numbers of a video for given shared ones, from several starts."""
    active = np.zeros(len(video.likelihood.coordinates), dtype=bool)
    active[video.local_places] = True
    active &= ~video.likelihood.coordinates.mask(NOISE_FIELDS)
    found = []
    for start in starts:
        minimum = minimise(
            video.data.residuals,
            video.points(shared, start),
            video.data.coordinates.scale,
            active=active,
            iterations=LOCAL_ITERATIONS,
            tolerance=0.1,
        )
        found.append(video.split(minimum.point)[1])
    return found[int(np.argmax(video.log_density(np.tile(shared, (len(found), 1)), np.array(found))))]


def follow_or_settle(
    video: LinkedVideo,
    shared: Float[np.ndarray, "shared"],
    local: Float[np.ndarray, "local"],
    target: Float[np.ndarray, "shared"],
    *,
    steps: int = MOST_STEPS,
) -> Float[np.ndarray, "local"]:
    """Best own numbers of a video at a target, from those at other shared numbers; parameters as those of `follow`.

    Where it does not arrive along its ridge, or arrives far below, it begins at the target, from both ends of the way.
    """
    one = follow(video, shared, local, target, steps=steps)
    if one.arrived and video.value(target, one.local) > video.value(shared, local) - SLACK:
        return one.local
    return settle(video, target, [local, one.local])


def with_alternatives(fit: JointFit, starts: Sequence[Float[np.ndarray, "_ _"]]) -> JointFit:
    """A fit with the further modes of each video's own numbers that are reached from some vectors of it."""

    def found(index: int) -> tuple[LocalMode, ...]:
        if len(starts[index]) == 1:
            return fit.modes(index)
        own = fit.videos[index].split(starts[index])[1]
        return local_modes(fit.videos[index], fit.numbers, fit.gaussian.mean, own, fit.gaussian.locals[index])

    return replace(fit, alternatives=tuple(in_parallel(found, range(len(fit.videos)))))


def local_modes(
    video: LinkedVideo,
    numbers: SharedNumbers,
    shared: Float[np.ndarray, "shared"],
    starts: Float[np.ndarray, "start local"],
    first: LocalGaussian | None = None,
) -> tuple[LocalMode, ...]:
    """Modes of a video's own numbers for given shared ones: one that is known, and those reached from some starts."""
    found = [] if first is None else [(first, video.value(shared, first.centre) + first.log_volume)]
    nothing = np.zeros(len(shared))
    for start in starts:
        own = settle(video, shared, [start])
        if not math.isfinite(value := video.value(shared, own)):  # it has no world at what all videos say
            continue
        if any(np.abs(one.whitened(own, nothing)).max() < SAME_MODE for one, _ in found):
            continue
        gaussian = expand(video, shared, own).around(own, numbers.logarithms)
        found.append((gaussian, value + gaussian.log_volume))
    best = max((weight for _, weight in found), default=0.0)
    return tuple(LocalMode(one, weight - best) for one, weight in found if weight > best - HOPELESS or one is first)

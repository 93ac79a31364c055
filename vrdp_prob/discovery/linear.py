"""The residuals of a joint fit as a linear function of everything that is unknown, and what is left without it.

Each video's own unknowns are projected out by themselves, then the shared ones of all videos together. What remains
of a direction is the part of an effect that the model cannot absorb, and its product with the residuals is the
efficient score (Cox and Hinkley, Theoretical Statistics, 1974, section 9.3).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float
from scipy.linalg import cho_factor, cho_solve

from vrdp_prob.inference.least_squares import jacobian
from vrdp_prob.inference.noise_fit import NOISE_FIELDS
from vrdp_prob.inference.parallel import in_parallel
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.inference.several_videos.joint_fit import expand_prior
from vrdp_prob.inference.several_videos.linking import LinkedVideo

RIDGE = 1e-9
"""Relative size below which what unknowns do counts as nothing."""


@dataclass(frozen=True)
class LinearVideo:
    """Residuals of one video near the fit.

    Parameters
    ----------
    name
        Name of the video.
    residuals
        Residuals of unit variance: those of the data, then those of the prior of the video's own unknowns.
    own, shared
        Their derivatives by the video's own unknowns, and by those that all videos share.
    data
        Number of the residuals that are of the data.
    """

    name: str
    residuals: Float[np.ndarray, "residual"]
    own: Float[np.ndarray, "residual own"]
    shared: Float[np.ndarray, "residual shared"]
    data: int

    @classmethod
    def of(cls, video: LinkedVideo, point: Float[np.ndarray, "dimension"], shared: int) -> "LinearVideo":
        """The video at a point of its vector; `shared` is the number of all shared unknowns."""
        likelihood = video.data
        coordinates = likelihood.coordinates
        world = ~coordinates.mask(NOISE_FIELDS)
        values, derivative = jacobian(likelihood.residuals, point, coordinates.scale, active=world, central=True)
        own = derivative[:, [place for place in video.local_places if world[place]]]
        columns = np.zeros((len(values), shared))
        columns[:, video.shared_columns] = derivative[:, video.shared_places]
        observations = likelihood.observations
        return cls(video.name, values, own, columns, 2 * len(observations.frame) + len(observations.angle))

    @cached_property
    def _basis(self) -> Float[np.ndarray, "residual rank"]:
        """Orthonormal basis of what the own unknowns can do."""
        scale = np.maximum(np.linalg.norm(self.own, axis=0), 1e-300)
        basis, values, _ = np.linalg.svd(self.own / scale, full_matrices=False)
        kept: np.ndarray = basis[:, values > RIDGE * values.max(initial=0.0)]
        return kept

    def without_own(
        self, directions: Float[np.ndarray, "residual direction"]
    ) -> Float[np.ndarray, "residual direction"]:
        """What is left of directions when the video's own unknowns follow."""
        left: np.ndarray = directions - self._basis @ (self._basis.T @ directions)
        return left

    @cached_property
    def reduced_shared(self) -> Float[np.ndarray, "residual shared"]:
        """Derivatives by the shared unknowns when the video's own ones follow."""
        return self.without_own(self.shared)

    def padded(self, data: Float[np.ndarray, "data direction"]) -> Float[np.ndarray, "residual direction"]:
        """Directions of the data's residuals, continued by zeros for the prior."""
        return np.concatenate([data, np.zeros((len(self.residuals) - self.data, data.shape[1]))])


@dataclass(frozen=True)
class Score:
    """What the residuals say of some strengths that are zero in the fit.

    Parameters
    ----------
    gradient
        Derivative of the log density by the strengths at zero, all other unknowns following.
    information
        Information (inverse covariance) about them.
    """

    gradient: Float[np.ndarray, "strength"]
    information: Float[np.ndarray, "strength strength"]

    @property
    def estimate(self) -> Float[np.ndarray, "strength"]:
        """Most probable strengths, to first order."""
        return np.linalg.lstsq(self.information, self.gradient, rcond=1e-10)[0]

    @property
    def sd(self) -> Float[np.ndarray, "strength"]:
        """Standard deviation of the strengths."""
        return np.sqrt(np.maximum(np.diag(np.linalg.pinv(self.information, rcond=1e-10)), 0.0))

    @property
    def chi_square(self) -> float:
        """Score statistic: chi-square with one degree per strength if there is nothing."""
        return float(self.gradient @ self.estimate)


@dataclass(frozen=True)
class LinearFit:
    """Residuals of all videos near a joint fit.

    Parameters
    ----------
    videos
        The single videos.
    prior_gradient, prior
        Gradient and curvature of the negative log prior of the shared unknowns.
    """

    videos: tuple[LinearVideo, ...]
    prior_gradient: Float[np.ndarray, "shared"]
    prior: Float[np.ndarray, "shared shared"]

    @classmethod
    def of(cls, fit: SharedFit) -> "LinearFit":
        """The linear model at the most probable values."""
        joint = fit.joint
        prior = expand_prior(joint.numbers, joint.gaussian.mean)
        videos = in_parallel(
            lambda k: LinearVideo.of(joint.videos[k], joint.point(k), len(joint.numbers)), range(len(joint.videos))
        )
        return cls(tuple(videos), prior.gradient, prior.curvature)

    @cached_property
    def _factor(self) -> tuple[np.ndarray, bool]:
        curvature = self.prior + sum(video.reduced_shared.T @ video.reduced_shared for video in self.videos)
        found: tuple[np.ndarray, bool] = cho_factor(curvature + RIDGE * np.diag(np.diag(curvature) + 1e-300))
        return found

    @cached_property
    def left(self) -> tuple[Float[np.ndarray, "residual"], ...]:
        """The residuals when all unknowns are at their best, one array per video."""
        return self.left_of([video.residuals for video in self.videos], self.prior_gradient)

    def left_of(
        self, residuals: Sequence[Float[np.ndarray, "_"]], prior_gradient: Float[np.ndarray, "shared"]
    ) -> tuple[Float[np.ndarray, "_"], ...]:
        """What all unknowns together leave of some residuals."""
        reduced = [video.without_own(one[:, None])[:, 0] for video, one in zip(self.videos, residuals, strict=True)]
        gradient = prior_gradient + sum(
            video.reduced_shared.T @ one for video, one in zip(self.videos, reduced, strict=True)
        )
        step = cho_solve(self._factor, gradient)
        return tuple(one - video.reduced_shared @ step for video, one in zip(self.videos, reduced, strict=True))

    def score(self, directions: Sequence[Float[np.ndarray, "_ strength"] | None]) -> Score:
        """Score of strengths, given what each does to the data's residuals of each video (None where nothing)."""
        pairs = [
            (video, video.without_own(video.padded(one)), left)
            for video, one, left in zip(self.videos, directions, self.left, strict=True)
            if one is not None
        ]
        gradient = -sum(reduced.T @ left for _, reduced, left in pairs)
        cross = sum(video.reduced_shared.T @ reduced for video, reduced, _ in pairs)
        information = sum(reduced.T @ reduced for _, reduced, _ in pairs) - cross.T @ cho_solve(self._factor, cross)
        return Score(np.asarray(gradient), np.asarray((information + information.T) / 2))

    def scores_in(
        self, index: int, directions: Float[np.ndarray, "data place strength"]
    ) -> tuple[list[Score], Float[np.ndarray, "residual place strength"]]:
        """Scores of strengths that act in one video, for each of many places, and the directions left of them."""
        video, left = self.videos[index], self.left[index]
        count, places, strengths = directions.shape
        reduced = video.without_own(video.padded(directions.reshape(count, -1)))
        gradient = -(reduced.T @ left).reshape(places, strengths)
        cross = (video.reduced_shared.T @ reduced).reshape(-1, places, strengths)
        solved = cho_solve(self._factor, cross.reshape(len(cross), -1)).reshape(cross.shape)
        blocks = reduced.reshape(-1, places, strengths)
        information = np.einsum("rps,rpt->pst", blocks, blocks) - np.einsum("kps,kpt->pst", cross, solved)
        return [Score(g, (i + i.T) / 2) for g, i in zip(gradient, information, strict=True)], blocks

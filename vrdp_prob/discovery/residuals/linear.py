"""The residuals of a joint fit as a linear function of everything that is unknown, and what is left without it.

Each video's own unknowns are projected out by themselves, then the shared ones of all videos together. What remains
of a direction is the part of an effect that the model cannot absorb, and its product with the residuals is the
efficient score (Cox and Hinkley, Theoretical Statistics, 1974, section 9.3).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Float
from scipy.special import gammaln
from scipy.stats import chi2

from vrdp_prob.models.model_error import Whitening

RIDGE = 1e-9
"""Relative size below which what unknowns do counts as nothing."""
RANK = 1e-8
"""Relative information below which a strength cannot be seen at all."""
FAINTEST = 1e-290
"""P-value below which the first term of the expansion for large statistics is used.

The second term changes the logarithm by 0.01 there with twenty degrees. Source: NIST Digital Library of Mathematical
Functions, 8.11.2.
"""


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
    whitening
        What makes the data's residuals independent, where they stray; None where they are independent.
    at_edge
        Whether the fit ends at an edge between two courses of events, where derivatives promise what does not come.
    """

    name: str
    residuals: Float[np.ndarray, "residual"]
    own: Float[np.ndarray, "residual own"]
    shared: Float[np.ndarray, "residual shared"]
    data: int
    whitening: Whitening | None = None
    at_edge: bool = False

    @cached_property
    def _decomposed(
        self,
    ) -> tuple[Float[np.ndarray, "residual own"], Float[np.ndarray, "own"], Float[np.ndarray, "own own"]]:
        """Singular value decomposition of what the own unknowns do, each in a unit in which it does as much."""
        basis, values, turn = np.linalg.svd(self.own / self._scale, full_matrices=False)
        return basis, values, turn

    @property
    def _scale(self) -> Float[np.ndarray, "own"]:
        return _lengths(self.own)

    @cached_property
    def _basis(self) -> Float[np.ndarray, "residual rank"]:
        """Orthonormal basis of what the own unknowns can do."""
        basis, values, _ = self._decomposed
        return _kept(basis, values)

    @property
    def log_volume(self) -> float:
        """Logarithm of the root of the determinant of the own unknowns' covariance where the shared ones are known."""
        values = self._decomposed[1]
        return -float(np.log(_told(values) * self._scale).sum())

    @property
    def log_stretch(self) -> float:
        """Logarithm of the factor by which the residuals were stretched when they were made independent."""
        return 0.0 if self.whitening is None else float(self.whitening.position_log_volume.sum())

    @property
    def own_sd(self) -> Float[np.ndarray, "own"]:
        """Standard deviations of the own unknowns where the shared ones are known."""
        _, values, turn = self._decomposed
        sd: np.ndarray = np.linalg.norm(turn.T / _told(values), axis=1) / self._scale
        return sd

    @property
    def absorbed(self) -> float:
        """Mean sum of squares that the own unknowns absorb of the data's residuals if these are noise."""
        return float((self._basis[: self.data] ** 2).sum())

    @property
    def promised(self) -> float:
        """Gain (nats) that the derivatives promise where the own unknowns follow."""
        return float(((self._basis.T @ self.residuals) ** 2).sum()) / 2

    @property
    def left(self) -> Float[np.ndarray, "residual"]:
        """The residuals when the own unknowns are at their best, the shared ones being those of the fit."""
        return self.without_own(self.residuals[:, None])[:, 0]

    def pulling(self, residuals: Float[np.ndarray, "residual column"]) -> Float[np.ndarray, "residual column"]:
        """What is left of residuals when the own unknowns follow; at an edge nothing that shared ones could take up.

        What derivatives promise there of shared unknowns would else stand for whatever acts as these do.
        """
        left = self.without_own(residuals)
        if not self.at_edge:
            return left
        basis = _kept(*np.linalg.svd(self.reduced_shared / _lengths(self.reduced_shared), full_matrices=False)[:2])
        return left - basis @ (basis.T @ left)

    def slope(self, left: Float[np.ndarray, "residual column"]) -> Float[np.ndarray, "shared column"]:
        """Derivative of half the sum of squares of such residuals by the shared unknowns; none at an edge."""
        slope: np.ndarray = self.reduced_shared.T @ left
        return np.zeros_like(slope) if self.at_edge else slope

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

    def freed(self, data: Float[np.ndarray, "data extra"]) -> "LinearVideo":
        """The video with further own unknowns of which nothing is known beforehand."""
        return replace(self, own=np.concatenate([self.own, self.padded(data)], axis=1))

    def alone(self, prior: Float[np.ndarray, "shared shared"] | None = None) -> "LinearVideo":
        """The video where the shared unknowns are its own, too.

        Parameters
        ----------
        prior
            Curvature of their negative log prior; nothing is known of them beforehand where None.
        """
        if prior is None:
            return replace(self, own=np.concatenate([self.own, self.shared], axis=1), shared=self.shared[:, :0])
        values, vectors = np.linalg.eigh(prior)
        rows = np.zeros((len(prior), self.own.shape[1] + len(prior)))
        rows[:, self.own.shape[1] :] = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
        return replace(
            self,
            residuals=np.concatenate([self.residuals, np.zeros(len(prior))]),
            own=np.concatenate([np.concatenate([self.own, self.shared], axis=1), rows]),
            shared=np.zeros((len(self.residuals) + len(prior), 0)),
        )

    def padded(self, data: Float[np.ndarray, "data direction"]) -> Float[np.ndarray, "residual direction"]:
        """Directions of the data's residuals, independent where these stray, continued by zeros for the prior."""
        return np.concatenate([self._whitened(data), np.zeros((len(self.residuals) - self.data, data.shape[1]))])

    def straying(self, whitening: Whitening) -> "LinearVideo":
        """The video where its data's residuals stray, made independent."""

        def independent(rows: Float[np.ndarray, "residual column"]) -> Float[np.ndarray, "residual column"]:
            return np.concatenate([straying._whitened(rows[: self.data]), rows[self.data :]])

        straying = replace(self, whitening=whitening)
        return replace(
            straying,
            residuals=independent(self.residuals[:, None])[:, 0],
            own=independent(self.own),
            shared=independent(self.shared),
        )

    def _whitened(self, data: Float[np.ndarray, "data column"]) -> Float[np.ndarray, "data column"]:
        if self.whitening is None:
            return data
        positions = len(self.whitening.position_log_volume)
        rows = torch.from_numpy(np.ascontiguousarray(data.T))
        parts = (
            self.whitening.whitened_positions(rows[:, :positions]),
            self.whitening.whitened_angles(rows[:, positions:]),
        )
        whitened: np.ndarray = torch.cat(parts, dim=1).numpy().T
        return whitened


def log_evidence(own: Float[np.ndarray, "residual own"], residuals: Float[np.ndarray, "residual"]) -> float:
    """Log density (nats, up to a constant) of residuals of unit variance, with all that is unknown integrated out.

    Parameters
    ----------
    own
        Derivatives by the unknowns.
    residuals
        The residuals, with those of the unknowns' prior.
    """
    # The triangle alone is decomposed further: it is some tens of rows instead of hundreds.
    triangle = np.asarray(np.linalg.qr(np.concatenate([own, residuals[:, None]], axis=1), mode="r"))
    scale = _lengths(triangle[:, :-1])
    values = np.linalg.svd(triangle[:-1, :-1] / scale, compute_uv=False)
    return -float(np.log(_told(values) * scale).sum()) - float(triangle[-1, -1] ** 2) / 2


def _lengths(columns: Float[np.ndarray, "row column"]) -> Float[np.ndarray, "column"]:
    """Lengths of columns, none of them 0."""
    return np.maximum(np.linalg.norm(columns, axis=0), 1e-300)


def _kept(basis: Float[np.ndarray, "row value"], values: Float[np.ndarray, "value"]) -> Float[np.ndarray, "row rank"]:
    """Those left singular vectors whose values do not count as nothing."""
    kept: np.ndarray = basis[:, values > RIDGE * values.max(initial=0.0)]
    return kept


def _told(values: Float[np.ndarray, "value"]) -> Float[np.ndarray, "value"]:
    """Singular values, those that count as nothing as large as they can be for that."""
    return np.maximum(values, RIDGE * values.max(initial=0.0))


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

    @cached_property
    def _root(self) -> Float[np.ndarray, "strength known"]:
        """Root of the covariance of the strengths, in the directions of which something is known."""
        return _covariance_root(self.information, RANK)

    @property
    def estimate(self) -> Float[np.ndarray, "strength"]:
        """Most probable strengths, to first order."""
        return self._root @ (self._root.T @ self.gradient)

    @property
    def sd(self) -> Float[np.ndarray, "strength"]:
        """Standard deviation of the strengths."""
        return np.linalg.norm(self._root, axis=1)

    @property
    def degrees(self) -> int:
        """Number of independent strengths of which something is known."""
        return self._root.shape[1]

    @property
    def chi_square(self) -> float:
        """Score statistic: chi-square with one degree per known strength if there is nothing."""
        return float(((self._root.T @ self.gradient) ** 2).sum())

    @property
    def p_value(self) -> float:
        """Probability of as large a statistic if there is nothing; 1 where nothing is known."""
        return float(chi2.sf(self.chi_square, self.degrees)) if self.degrees else 1.0

    @property
    def log_p_value(self) -> float:
        """Its natural logarithm, also where it is smaller than any number of the machine."""
        if self.p_value > FAINTEST:
            return float(np.log(self.p_value))
        half, shape = self.chi_square / 2, self.degrees / 2
        return float((shape - 1) * np.log(half) - half - gammaln(shape))

    def within(self, rows: Float[np.ndarray, "row strength"]) -> "Score":
        """The score where the strengths lie in the span of some rows, and what is across these stays zero."""
        onto = np.linalg.pinv(rows) @ rows
        return Score(onto @ self.gradient, onto @ self.information @ onto)

    def of(self, chosen: Sequence[int], given: Sequence[int] = ()) -> "Score":
        """The score of some of the strengths, where some others may differ from zero, and no more."""
        inside, known = np.array(chosen, dtype=int), np.array(given, dtype=int)
        information = self.information[np.ix_(inside, inside)]
        others = Score(self.gradient[known], self.information[np.ix_(known, known)])
        pulled = others._root.T @ self.information[np.ix_(known, inside)]
        gradient = self.gradient[inside] - pulled.T @ (others._root.T @ others.gradient)
        left = information - pulled.T @ pulled
        seen = np.diag(left) > RANK * np.diag(information)
        return Score(np.where(seen, gradient, 0.0), np.where(np.outer(seen, seen), left, 0.0))


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

    def sharing(self, directions: Sequence[Float[np.ndarray, "_ extra"]]) -> "LinearFit":
        """The fit of a model with further shared unknowns of which nothing is known beforehand."""
        videos = tuple(
            replace(video, shared=np.concatenate([video.shared, video.padded(one)], axis=1))
            for video, one in zip(self.videos, directions, strict=True)
        )
        room = (0, videos[0].shared.shape[1] - len(self.prior_gradient))
        return LinearFit(videos, np.pad(self.prior_gradient, room), np.pad(self.prior, room))

    @cached_property
    def curvature(self) -> Float[np.ndarray, "shared shared"]:
        """Information about the shared unknowns, the own ones of all videos following."""
        return self.prior + sum(self.curvatures)

    @cached_property
    def curvatures(self) -> list[Float[np.ndarray, "shared shared"]]:
        """What each video says of them, its own unknowns following."""
        return [video.reduced_shared.T @ video.reduced_shared for video in self.videos]

    @cached_property
    def _root(self) -> Float[np.ndarray, "shared known"]:
        """Root of the covariance of the shared unknowns, in the directions of which something is known."""
        return _covariance_root(self.curvature, RIDGE)

    @property
    def shared_sd(self) -> Float[np.ndarray, "shared"]:
        """Standard deviations of the shared unknowns."""
        sd: np.ndarray = np.linalg.norm(self._root, axis=1)
        return sd

    def _step(self, gradient: Float[np.ndarray, "shared column"]) -> Float[np.ndarray, "shared column"]:
        """Step of the shared unknowns."""
        step: np.ndarray = self._root @ (self._root.T @ gradient)
        return step

    @cached_property
    def left(self) -> tuple[Float[np.ndarray, "residual"], ...]:
        """The residuals when all unknowns are at their best, one array per video."""
        left = self.left_of([video.residuals[:, None] for video in self.videos], self.prior_gradient[:, None])
        return tuple(one[:, 0] for one in left)

    @property
    def slopes(self) -> list[Float[np.ndarray, "shared"]]:
        """Derivative of each video's negative log density by the shared unknowns when all are at their best."""
        slopes, step = self._pulled([video.left[:, None] for video in self.videos], self.prior_gradient[:, None])
        return [(slope - curvature @ step)[:, 0] for slope, curvature in zip(slopes, self.curvatures, strict=True)]

    @cached_property
    def degrees(self) -> float:
        """Number of the data's residuals, less what the unknowns can absorb of noise."""
        absorbed = sum(video.absorbed for video in self.videos)
        shared = [video.reduced_shared[: video.data] for video in self.videos]
        gram = np.asarray(sum(one.T @ one for one in shared))
        return sum(video.data for video in self.videos) - absorbed - float(np.trace(self._step(gram)))

    def left_of(
        self,
        residuals: Sequence[Float[np.ndarray, "_ column"]],
        prior_gradient: Float[np.ndarray, "shared column"],
    ) -> tuple[Float[np.ndarray, "_ column"], ...]:
        """What all unknowns together leave of some residuals, each column by itself."""
        reduced = [video.pulling(one) for video, one in zip(self.videos, residuals, strict=True)]
        _, step = self._pulled(reduced, prior_gradient)
        return tuple(one - video.reduced_shared @ step for video, one in zip(self.videos, reduced, strict=True))

    def _pulled(
        self, reduced: Sequence[Float[np.ndarray, "_ column"]], prior_gradient: Float[np.ndarray, "shared column"]
    ) -> tuple[list[Float[np.ndarray, "shared column"]], Float[np.ndarray, "shared column"]]:
        """How residuals, without the own unknowns, pull at the shared ones in each video, and the step of these."""
        slopes = [video.slope(one) for video, one in zip(self.videos, reduced, strict=True)]
        return slopes, self._step(prior_gradient + sum(slopes))

    def score(self, directions: Sequence[Float[np.ndarray, "_ strength"] | None]) -> Score:
        """Score of strengths, given what each does to the data's residuals of each video (None where nothing)."""
        pairs = [
            (video, video.without_own(video.padded(one)), left)
            for video, one, left in zip(self.videos, directions, self.left, strict=True)
            if one is not None
        ]
        gradient = -sum(reduced.T @ left for _, reduced, left in pairs)
        cross = sum(video.reduced_shared.T @ reduced for video, reduced, _ in pairs)
        information = sum(reduced.T @ reduced for _, reduced, _ in pairs) - cross.T @ self._step(cross)
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
        solved = self._step(cross.reshape(len(cross), -1)).reshape(cross.shape)
        blocks = reduced.reshape(-1, places, strengths)
        information = np.einsum("rps,rpt->pst", blocks, blocks) - np.einsum("kps,kpt->pst", cross, solved)
        return [Score(g, (i + i.T) / 2) for g, i in zip(gradient, information, strict=True)], blocks


def _covariance_root(
    information: Float[np.ndarray, "number number"], least: float
) -> Float[np.ndarray, "number known"]:
    """Root of a covariance, in the directions in which the information exceeds a share of each number's own."""
    size = np.sqrt(np.maximum(np.diag(information), 1e-300))
    values, vectors = np.linalg.eigh(information / np.outer(size, size))
    known = values > least
    root: np.ndarray = vectors[:, known] / np.sqrt(values[known]) / size[:, None]
    return root

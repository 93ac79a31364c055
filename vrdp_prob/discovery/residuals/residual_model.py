"""Residuals of a joint fit beside the motion that it believes in, and what noise alone would leave of them.

Residuals of Student-t noise enter by their influence (bounded, for outliers near 0), scaled to unit variance; by the
information equality the same factor belongs to their derivative. Source: Lange, Little and Taylor, Robust statistical
modeling using the t distribution, Journal of the American Statistical Association 84 (1989).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from vrdp_prob.discovery.residuals.fitted_motion import FittedMotion
from vrdp_prob.discovery.residuals.linear import LinearFit, LinearVideo, Score
from vrdp_prob.inference.runs.parallel import in_parallel
from vrdp_prob.inference.search.least_squares import jacobian
from vrdp_prob.inference.search.noise_fit import NOISE_FIELDS
from vrdp_prob.inference.several_videos.arrow import STEEP
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.inference.several_videos.joint_fit import expand_prior
from vrdp_prob.inference.several_videos.linking import LinkedVideo
from vrdp_prob.models.lateness import Lateness
from vrdp_prob.models.likelihood import Discrepancies, Likelihood
from vrdp_prob.models.noise import NoiseFamily
from vrdp_prob.models.unknowns import ANGLE_NOISE, DEGREES_OF_FREEDOM, NOISE

ABSORBED = 1e-10
"""A pattern of which the fit absorbs all but this share of its squared length is not tested: what is left is an error
of the derivatives."""


@dataclass(frozen=True)
class Noise:
    """The fitted measurement noise of one video.

    Parameters
    ----------
    family
        Its distribution.
    scale, angle_scale
        Scales of positions and angles in units of the video's references.
    degrees
        Degrees of freedom of Student-t noise.
    lateness
        How frames are late by chance; None where the model has no such frames.
    """

    family: NoiseFamily
    scale: float
    angle_scale: float
    degrees: float
    lateness: Lateness | None = None

    @classmethod
    def of(cls, likelihood: Likelihood, point: Float[np.ndarray, "dimension"]) -> "Noise":
        """The noise at a point of a video's density."""
        rows = torch.from_numpy(point[None])
        quantities = likelihood.coordinates.quantities(rows)
        scale, angle_scale, degrees = (
            float(quantities[name][0, 0]) for name in (NOISE, ANGLE_NOISE, DEGREES_OF_FREEDOM)
        )
        return cls(likelihood.noise, scale, angle_scale, degrees, likelihood.lateness(rows))

    def slope(self, numbers: int) -> float:
        """Derivative of the influence, of unit variance, of an observation of 1 or 2 numbers of unit scale."""
        if self.family is NoiseFamily.GAUSSIAN:
            return 1.0
        return float(np.sqrt((self.degrees + numbers) / (self.degrees + numbers + 2)))

    def linear(self, discrepancies: Discrepancies) -> Float[np.ndarray, "point data"]:
        """Differences of what was seen from worlds, in the units in which residuals of unit variance follow them."""
        rows = self.independent(discrepancies)
        positions = 2 * discrepancies.positions.shape[1]
        rows[:, :positions] *= self.slope(2)
        rows[:, positions:] *= self.slope(1)
        return rows

    def independent(self, discrepancies: Discrepancies) -> Float[np.ndarray, "point data"]:
        """Differences of what was seen from worlds in units of the noise, as independent numbers."""
        parts = [discrepancies.positions.flatten(1) / self.scale, discrepancies.angles / self.angle_scale]
        rows: np.ndarray = self.on_time(torch.cat(parts, dim=1)).detach().numpy()
        return rows

    def on_time(self, rows: Float[Tensor, "row data"]) -> Float[Tensor, "row data"]:
        """Numbers in units of the noise as independent ones."""
        return rows if self.lateness is None else self.lateness.independent(rows)

    def influence(
        self, residuals: Float[np.ndarray, "observation number column"]
    ) -> Float[np.ndarray, "observation number column"]:
        """Influence, of unit variance, of residuals of unit scale."""
        if self.family is NoiseFamily.GAUSSIAN:
            return residuals
        numbers = residuals.shape[1]
        squares = (residuals**2).sum(axis=1, keepdims=True)
        return residuals * (self.degrees + numbers) / (self.degrees + squares) / self.slope(numbers)

    def draws(
        self, shape: tuple[int, int, int], generator: np.random.Generator
    ) -> Float[np.ndarray, "observation number column"]:
        """Residuals of unit scale."""
        normal = generator.standard_normal(shape)
        if self.family is NoiseFamily.GAUSSIAN:
            return normal
        return normal / np.sqrt(generator.chisquare(self.degrees, (shape[0], 1, shape[2])) / self.degrees)


@dataclass(frozen=True)
class VideoResiduals:
    """Residuals of one video, linear about its best point, and its motion there.

    Parameters
    ----------
    linear
        Residuals of unit variance, predicted less observed: positions (x and y in turn), angles, own priors.
    likelihood
        The video's density.
    motion
        The motion at the best point.
    noise
        The fitted noise.
    raw
        Differences of positions in m, observed less predicted.
    own_places
        Places of the video's own unknowns in its vector, in the order of the columns of `linear.own`.
    """

    linear: LinearVideo
    likelihood: Likelihood
    motion: FittedMotion
    noise: Noise
    raw: Float[np.ndarray, "observation 2"]
    own_places: tuple[int, ...]

    @classmethod
    def of(cls, video: LinkedVideo, point: Float[np.ndarray, "dimension"], shared: int) -> "VideoResiduals":
        """The video at a point of its vector; `shared` is the number of all shared unknowns."""
        likelihood = replace(video.data, model_error=None)
        coordinates, observations = likelihood.coordinates, likelihood.observations
        noise = Noise.of(likelihood, point)

        def differences(points: Float[np.ndarray, "point dimension"]) -> Float[np.ndarray, "point row"]:
            rows = torch.from_numpy(np.ascontiguousarray(points))
            with torch.no_grad():
                found = likelihood.discrepancies(rows)
                prior = coordinates.prior_residuals(rows)
            return np.concatenate([noise.independent(found), prior.numpy()], axis=1)

        world = ~coordinates.mask(NOISE_FIELDS)
        values, derivative = jacobian(differences, point, coordinates.scale, active=world, central=True)
        positions = 2 * len(observations.frame)
        data = positions + len(observations.angle_frame)
        for numbers, first, last in ((2, 0, positions), (1, positions, data)):
            values[first:last] = noise.influence(values[first:last].reshape(-1, numbers, 1)).ravel()
            derivative[first:last] *= noise.slope(numbers)
        columns = np.zeros((len(values), shared))
        columns[:, video.shared_columns] = derivative[:, video.shared_places]
        own = [place for place in video.local_places if world[place]]
        predicted = likelihood.fitted(torch.from_numpy(point[None]))[0, observations.frame, observations.body, :2]
        linear = LinearVideo(video.name, values, derivative[:, own], columns, data)
        return cls(
            replace(linear, at_edge=linear.promised > STEEP),
            likelihood,
            FittedMotion.of(likelihood, point),
            noise,
            observations.position - predicted,
            tuple(int(place) for place in own),
        )

    @property
    def positions(self) -> int:
        """Number of the residuals that are of positions."""
        return 2 * len(self.likelihood.observations.frame)

    @property
    def noise_sd(self) -> float:
        """Scale of a coordinate's noise in m."""
        return self.noise.scale * self.likelihood.observations.position_reference

    def rows(self, changes: Float[np.ndarray, "time body number column"]) -> Float[np.ndarray, "data column"]:
        """What changes of the measured places (m) and angles (rad, where given) do to the data's residuals."""
        observations = self.likelihood.observations
        seen = changes[observations.frame, observations.body, :2]
        scaled = np.einsum("oij,ojc->oic", observations.whitening / self.noise.scale, seen)
        result = np.zeros((self.linear.data, changes.shape[-1]))
        result[: self.positions] = scaled.reshape(self.positions, -1)
        if changes.shape[2] > 2:
            turned = changes[observations.angle_frame, observations.angle_body, 2]
            result[self.positions :] = turned / (self.noise.angle_scale * observations.angle_reference)
        if self.noise.lateness is not None:
            result = self.noise.on_time(torch.from_numpy(np.ascontiguousarray(result.T))).numpy().T.copy()
        result[: self.positions] *= self.noise.slope(2)
        result[self.positions :] *= self.noise.slope(1)
        return result

    def late_frames(self) -> Float[np.ndarray, "data frame"]:
        """What 1 s does to the data's residuals by which each single frame is late; large, and not kept."""
        motion = self.motion
        rates = np.concatenate([motion.velocity, motion.spin[..., None]], axis=-1)
        moves = np.where(motion.moving[..., None], rates, 0.0)
        return self.rows(moves[..., None] * np.eye(len(motion.times))[:, None, None, :])

    def drawn(self, count: int, generator: np.random.Generator) -> Float[np.ndarray, "residual replica"]:
        """Residuals of pure noise before anything is absorbed."""
        positions, data, rows = self.positions, self.linear.data, len(self.linear.residuals)
        parts = [
            self.noise.influence(self.noise.draws((size // numbers, numbers, count), generator)).reshape(size, count)
            for numbers, size in ((2, positions), (1, data - positions))
        ]
        return np.concatenate([*parts, generator.standard_normal((rows - data, count))])


@dataclass(frozen=True)
class ResidualModel:
    """Residuals of several videos, linear in everything that is unknown.

    Parameters
    ----------
    linear
        The linear model.
    videos
        The single videos.
    """

    linear: LinearFit
    videos: tuple[VideoResiduals, ...]

    @classmethod
    def of(cls, fit: SharedFit) -> "ResidualModel":
        """The linear model at the most probable values."""
        joint = fit.joint
        prior = expand_prior(joint.numbers, joint.gaussian.mean)
        videos = in_parallel(
            lambda k: VideoResiduals.of(joint.videos[k], joint.point(k), len(joint.numbers)), range(len(joint.videos))
        )
        linear = LinearFit(tuple(video.linear for video in videos), prior.gradient, prior.curvature)
        return cls(linear, tuple(videos))

    @property
    def without_beliefs(self) -> "ResidualModel":
        """The model of a fit that believes nothing of what videos share, as nothing is wrong with an unusual table."""
        linear = self.linear
        nothing = np.zeros_like(linear.prior_gradient), np.zeros_like(linear.prior)
        return replace(self, linear=LinearFit(linear.videos, *nothing))

    def freed(self, columns: Sequence[Float[np.ndarray, "_ _"]]) -> "ResidualModel":
        """The model of a fit that could also absorb further patterns, some in each video."""
        videos = tuple(
            replace(video, linear=video.linear.freed(extra)) for video, extra in zip(self.videos, columns, strict=True)
        )
        return replace(self, linear=replace(self.linear, videos=tuple(v.linear for v in videos)), videos=videos)

    def sharing(self, patterns: Sequence[Float[np.ndarray, "_ extra"]]) -> "ResidualModel":
        """The model of a fit that could also absorb further patterns, each with one amplitude for all videos."""
        linear = self.linear.sharing(patterns)
        videos = tuple(replace(video, linear=one) for video, one in zip(self.videos, linear.videos, strict=True))
        return ResidualModel(linear, videos)

    @cached_property
    def dispersion(self) -> float:
        """Mean squared residual of the data over what noise of the fitted scale would leave; 1 where all is well."""
        squares = sum(float((left[: v.linear.data] ** 2).sum()) for left, v in zip(self.left, self.videos, strict=True))
        return squares / self.linear.degrees

    def score(self, patterns: Sequence[Float[np.ndarray, "_ column"]]) -> Score:
        """How strongly patterns show in units of what is left; no information where the fit absorbs everything."""
        score = self.linear.score(patterns)
        whole = sum((one**2).sum(axis=0) for one in patterns)
        kept = np.diag(score.information) > ABSORBED * whole
        gradient = np.where(kept, score.gradient, 0.0) / self.dispersion
        return Score(gradient, np.where(np.outer(kept, kept), score.information, 0.0) / self.dispersion)

    @cached_property
    def left(self) -> tuple[Float[np.ndarray, "_"], ...]:
        """Residuals of each video when all unknowns are at their best."""
        return self.linear.left

    def replicas(self, count: int, generator: np.random.Generator) -> tuple[Float[np.ndarray, "_ replica"], ...]:
        """The same where the model is right: noise of the fitted family and scale, less what the fit absorbs of it."""
        values, vectors = np.linalg.eigh(self.linear.prior)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        pull = root @ generator.standard_normal((len(root), count))
        return self.linear.left_of([video.drawn(count, generator) for video in self.videos], pull)


def joined(
    model: ResidualModel, patterns: Mapping[str, Sequence[Float[np.ndarray, "_ _"]]]
) -> tuple[Score, dict[str, list[int]]]:
    """The score of several sets of patterns together, and the places of each set."""
    places, first = {}, 0
    for name, rows in patterns.items():
        width = rows[0].shape[1]
        places[name] = list(range(first, first + width))
        first += width
    columns = [np.concatenate(parts, axis=1) for parts in zip(*patterns.values(), strict=True)]
    return model.score(columns), places

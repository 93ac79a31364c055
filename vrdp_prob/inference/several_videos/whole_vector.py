"""All numbers of several videos as one vector, from which the samplers of one video draw.

Each step simulates all videos, and an ensemble needs a few walkers for each number: this is for a handful of videos,
and a check of `gibbs`, which is for many.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
import torch
from jaxtyping import Float, Int
from scipy.linalg import solve_triangular
from torch import Tensor

from vrdp_prob.inference.draws.diagnostics import Reported
from vrdp_prob.inference.draws.mode import Mode
from vrdp_prob.inference.samplers.straightening import Rates
from vrdp_prob.inference.search.events import Pairs, courses_at
from vrdp_prob.inference.several_videos.joint_fit import JointFit
from vrdp_prob.inference.several_videos.linking import LinkedVideo, SharedNumbers


@dataclass(frozen=True)
class WholeVector:
    """Log posterior of the shared numbers, followed by the own numbers of each video in turn.

    Parameters
    ----------
    fit
        The fit of the videos.
    """

    fit: JointFit

    @property
    def numbers(self) -> SharedNumbers:
        """The shared numbers."""
        return self.fit.numbers

    @property
    def videos(self) -> tuple[LinkedVideo, ...]:
        """The videos in terms of them."""
        return self.fit.videos

    def __call__(self, points: Float[Tensor, "point dimension"]) -> Float[Tensor, "point"]:
        """Log density (nats, up to a constant); differentiable."""
        total = self.numbers.log_density(points[:, : len(self.numbers)])
        for video, vectors in zip(self.videos, self._vectors(points), strict=True):
            total = total + video.data.log_density(vectors)
        return total

    def courses(self, points: Float[Tensor, "point dimension"]) -> list[tuple[Pairs, ...]]:
        """Which bodies meet, in which order, in the worlds of all videos."""
        parts = zip(self.videos, self._vectors(points), strict=True)
        return list(zip(*(courses_at(video.data, vectors) for video, vectors in parts), strict=True))

    def _vectors(self, points: Float[Tensor, "point dimension"]) -> Iterator[Float[Tensor, "point _"]]:
        """The vectors of each video in turn."""
        for video, places in zip(self.videos, self._places, strict=True):
            offset = np.zeros(len(places))
            offset[video.shared_places] = video.offset
            yield points[:, torch.from_numpy(places)] + torch.from_numpy(offset)

    @cached_property
    def own_places(self) -> tuple[Int[np.ndarray, "_"], ...]:
        """Places of each video's own numbers."""
        ends = len(self.numbers) + np.cumsum([0, *(len(video.local_places) for video in self.videos)])
        return tuple(np.arange(begin, end) for begin, end in pairwise(ends.tolist()))

    def residuals(self, points: Float[np.ndarray, "point dimension"]) -> Float[np.ndarray, "point residual"]:
        """Numbers whose half sum of squares falls off as the density does."""
        shared = points[:, : len(self.numbers)]
        own = [
            video.points(shared, points[:, places]) for video, places in zip(self.videos, self.own_places, strict=True)
        ]
        rows = [video.data.residuals(one) for video, one in zip(self.videos, own, strict=True)]
        return np.concatenate([self.numbers.prior_residuals(shared), *rows], axis=1)

    @property
    def mode(self) -> Mode:
        """The most probable values and the curvature around them."""
        gaussian, count = self.fit.gaussian, len(self.numbers)
        root = np.zeros((gaussian.dimension, gaussian.dimension))
        root[:count, :count] = gaussian.root
        for own, local in zip(self.own_places, gaussian.locals, strict=True):
            root[own, :count] = local.slope @ gaussian.root
            root[np.ix_(own, own)] = local.root
        inverse = solve_triangular(root, np.eye(len(root)), lower=True)
        point = np.concatenate([gaussian.mean, *(local.centre for local in gaussian.locals)])
        return Mode(point, inverse.T @ inverse, self.fit.log_density)

    @cached_property
    def rates(self) -> Rates:
        """The rates of slowing down among all numbers."""
        dimension = len(self.numbers) + sum(map(len, self.own_places))
        mean, sd = np.zeros(dimension), np.ones(dimension)
        found: dict[int, Float[np.ndarray, "dimension"]] = {}
        for video, whole in zip(self.videos, self._places, strict=True):
            one = Rates.of(video.likelihood.tracks, video.likelihood.coordinates)
            mean[whole], sd[whole] = one.prior_mean, one.prior_sd
            for place, direction in zip(whole[one.places].tolist(), one.directions, strict=True):
                found.setdefault(place, np.zeros(dimension))[whole] = direction
        mean[: len(self.numbers)], sd[: len(self.numbers)] = self.numbers.prior_mean, self.numbers.prior_sd
        directions = np.array(list(found.values())).reshape(-1, dimension)
        return Rates(directions, np.array(list(found), dtype=int), mean, sd)

    @property
    def _places(self) -> list[Int[np.ndarray, "_"]]:
        """Where the numbers of each video's vector are among all."""
        found = []
        for video, own in zip(self.videos, self.own_places, strict=True):
            places = np.zeros(len(video.likelihood.coordinates), dtype=np.int64)
            places[video.shared_places], places[video.local_places] = video.shared_columns, own
            found.append(places)
        return found

    def reported(self, each: Sequence[Reported]) -> Reported:
        """What is reported of each video, of the whole vector."""
        names = [f"the {name.replace('_', ' ')}" for name in self.numbers.names]
        rows = [np.eye(len(names), len(names) + sum(map(len, self.own_places)))]
        for video, places, shown in zip(self.videos, self._places, each, strict=True):
            known = shown.combinations.shape[1]
            whole = np.zeros((len(shown.names), rows[0].shape[1]))
            whole[:, places[:known]] = shown.combinations
            rows.append(whole)
            names += [f"{name} in {video.name}" for name in shown.names]
        return Reported(tuple(names), np.concatenate(rows))

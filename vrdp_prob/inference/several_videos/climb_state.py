"""Where a climb of several videos is, and what is raised where none can begin."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from scipy.optimize import minimize

from vrdp_prob.errors import InputError
from vrdp_prob.inference.search.noise_fit import NOISE_FIELDS, best_noise
from vrdp_prob.inference.several_videos.joint_fit import expand_prior
from vrdp_prob.inference.several_videos.linking import LinkedVideo, SharedNumbers

TOLERANCE = 0.2
"""Gain (nats) of a step, expected or real, below which a climb ends..."""
EXPECTED = 1.0
"""...and has converged, if no more than so much was expected; where a common step brought nothing, none is tried until
the videos by themselves have gained as much."""


class ImpossibleStartError(Exception):
    """A search was to begin where the world of some video cannot be simulated, or where it is not worth its while.

    Its text names the videos that cannot be simulated.
    """


class NoCommonWorldError(ImpossibleStartError, InputError):
    """Some video has no world at what all of them say of the numbers that they share."""


@dataclass(frozen=True)
class State:
    """Where a climb is: shared numbers, those of each video, and the log density of each video."""

    shared: Float[np.ndarray, "shared"]
    locals: tuple[Float[np.ndarray, "_"], ...]
    values: tuple[float, ...]

    @classmethod
    def at(
        cls,
        videos: Sequence[LinkedVideo],
        shared: Float[np.ndarray, "shared"],
        locals_: Sequence[Float[np.ndarray, "_"]],
    ) -> "State":
        """That of some numbers."""
        values = (video.value(shared, local) for video, local in zip(videos, locals_, strict=True))
        return cls(shared, tuple(locals_), tuple(values))

    def impossible(self, videos: Sequence[LinkedVideo]) -> ImpossibleStartError:
        """What is raised where nothing can begin here: it names the videos that cannot be simulated."""
        values = zip(videos, self.values, strict=True)
        return ImpossibleStartError(", ".join(video.name for video, value in values if not np.isfinite(value)))

    def total(self, numbers: SharedNumbers) -> float:
        """Joint log posterior (nats, up to a constant)."""
        return float(numbers.log_prior(self.shared[None])[0]) + sum(self.values)


def with_best_noise(numbers: SharedNumbers, videos: Sequence[LinkedVideo], state: State) -> State:
    """The state with the most probable sizes of the noise for its worlds."""
    locals_ = []
    for video, local in zip(videos, state.locals, strict=True):
        own = video.likelihood.coordinates.mask(NOISE_FIELDS)
        own[video.shared_places] = False
        point = video.points(state.shared, local)
        locals_.append(video.split(best_noise(video.data, point, own))[1] if own.any() else local)
    columns = np.flatnonzero([field in NOISE_FIELDS for field, _ in numbers.keys])
    shared = _best_shared_noise(numbers, videos, state.shared, locals_, columns) if len(columns) else state.shared
    found = State.at(videos, shared, locals_)
    return found if found.total(numbers) > state.total(numbers) else state


def _best_shared_noise(
    numbers: SharedNumbers,
    videos: Sequence[LinkedVideo],
    shared: Float[np.ndarray, "shared"],
    locals_: Sequence[Float[np.ndarray, "_"]],
    columns: np.ndarray,
) -> Float[np.ndarray, "shared"]:
    """Shared numbers with the most probable noise for given worlds."""
    with torch.no_grad():
        discrepancies = [
            video.data.discrepancies(torch.from_numpy(video.points(shared, local)[None]))
            for video, local in zip(videos, locals_, strict=True)
        ]
    if not all(bool(torch.isfinite(one.positions).all()) for one in discrepancies):
        return shared

    def descend(values: Float[np.ndarray, "noise"]) -> tuple[float, Float[np.ndarray, "noise"]]:
        moved = shared.copy()
        moved[columns] = values
        prior = expand_prior(numbers, moved)
        loss, slope = -float(numbers.log_prior(moved[None])[0]), prior.gradient.copy()
        for video, local, one in zip(videos, locals_, discrepancies, strict=True):
            point = torch.from_numpy(video.points(moved, local)[None]).requires_grad_()
            value = video.data.log_density_given(one, point)[0]
            (gradient,) = torch.autograd.grad(value, point)
            loss -= float(value.detach())
            slope[video.shared_columns] -= gradient[0].numpy()[video.shared_places]
        return loss, slope[columns]

    result = minimize(descend, shared[columns], jac=True, method="L-BFGS-B", options={"maxiter": 30})
    moved = shared.copy()
    moved[columns] = result.x
    return moved

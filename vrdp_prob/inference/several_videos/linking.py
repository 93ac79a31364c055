"""Which unknowns several videos share, and each video's vector of unknowns in terms of the shared and its own ones.

A video's vector holds every shared parameter, even one that does nothing in it, so that its draws are those of all.
Its density leaves the prior of the shared numbers out, so that the prior counts once in the sum over videos.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from vrdp_prob.errors import InputError
from vrdp_prob.inference.draws.samples import evaluate
from vrdp_prob.inference.search.noise_fit import NOISE_FIELDS
from vrdp_prob.models.coordinates import Coordinate, Coordinates
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.parameters import WALL_RESTITUTION, Group, Prior, Scope, Transform, group_words
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.unknowns import ANGLE_NOISE, NOISE
from vrdp_prob.scene import Tracks

FLAT_SD = 1e8
"""Standard deviation of a prior that says nothing."""

Key = tuple[str, Group]
"""A shared number: its quantity, and for the restitution of a wall where the wall is, or the name of a material."""


@dataclass(frozen=True)
class SharedNumbers:
    """The numbers that several videos have in common.

    Parameters
    ----------
    keys
        What they are.
    entries
        Their transforms, priors and scales.
    noise_reference
        Standard deviation in m that the shared noise scale 1 stands for; None where it multiplies what each video
        states.
    """

    keys: tuple[Key, ...]
    entries: tuple[Coordinate, ...]
    noise_reference: float | None

    def __len__(self) -> int:
        return len(self.keys)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """A name for each number."""
        return tuple(field + (f"({words})" if (words := group_words(place)) else "") for field, place in self.keys)

    @cached_property
    def logarithms(self) -> Bool[np.ndarray, "shared"]:
        """Which of them are inferred as logarithms."""
        return np.array([entry.transform is Transform.LOG for entry in self.entries], dtype=bool)

    @cached_property
    def _prior(self) -> Coordinates:
        return Coordinates(self.entries, {})

    @cached_property
    def scale(self) -> Float[np.ndarray, "shared"]:
        """Typical size of a change of each number."""
        return self._prior.scale

    @cached_property
    def prior_mean(self) -> Float[np.ndarray, "shared"]:
        """Mean of the Gaussian prior."""
        return self._prior.prior_mean

    @cached_property
    def prior_sd(self) -> Float[np.ndarray, "shared"]:
        """Standard deviation of the Gaussian prior."""
        return self._prior.prior_sd

    def quantities(self, shared: Float[np.ndarray, "*batch shared"]) -> Float[np.ndarray, "*batch shared"]:
        """The numbers in their units, where they are inferred as logarithms, too."""
        values: np.ndarray = np.where(self.logarithms, np.exp(np.where(self.logarithms, shared, 0.0)), shared)
        return values

    def log_priors(self, shared: Float[np.ndarray, "point shared"]) -> Float[np.ndarray, "point shared"]:
        """Log prior of each number, up to constants."""
        values: np.ndarray = self._prior.log_prior(torch.from_numpy(np.ascontiguousarray(shared))).numpy()
        return values

    def log_prior(self, shared: Float[np.ndarray, "point shared"]) -> Float[np.ndarray, "point"]:
        """Log prior up to a constant."""
        values: np.ndarray = self.log_density(torch.from_numpy(np.ascontiguousarray(shared))).numpy()
        return values

    def log_density(self, shared: Float[Tensor, "point shared"]) -> Float[Tensor, "point"]:
        """The same, differentiable."""
        return self._prior.log_prior(shared).sum(dim=1)

    def prior_residuals(self, shared: Float[np.ndarray, "point shared"]) -> Float[np.ndarray, "point residual"]:
        """Numbers whose half sum of squares is the negative log prior."""
        values: np.ndarray = self._prior.prior_residuals(torch.from_numpy(np.ascontiguousarray(shared))).numpy()
        return values


@dataclass(frozen=True)
class LinkedVideo:
    """One video whose vector holds every shared number.

    Parameters
    ----------
    likelihood
        Its posterior density, priors as stated.
    shared_columns
        Which of the shared numbers have a place in it.
    shared_places
        Their places in its vector.
    offset
        What is added to them there (a noise scale in this video's units).
    """

    likelihood: Likelihood
    shared_columns: Int[np.ndarray, "used"]
    shared_places: Int[np.ndarray, "used"]
    offset: Float[np.ndarray, "used"]

    @property
    def name(self) -> str:
        """Name of the video."""
        return self.likelihood.tracks.video

    @cached_property
    def local_places(self) -> Int[np.ndarray, "local"]:
        """Places of its own numbers."""
        return np.setdiff1d(np.arange(len(self.likelihood.coordinates)), self.shared_places)

    @cached_property
    def data(self) -> Likelihood:
        """Its density without the prior of the shared numbers."""
        return self._with_priors({int(place): Prior(0.0, FLAT_SD) for place in self.shared_places})

    def points(
        self, shared: Float[np.ndarray, "*#batch shared"], local: Float[np.ndarray, "*#batch local"]
    ) -> Float[np.ndarray, "*batch dimension"]:
        """Vectors of this video; a batch of one is spread over the other's."""
        batch = np.broadcast_shapes(shared.shape[:-1], local.shape[:-1])
        result = np.empty((*batch, len(self.likelihood.coordinates)))
        result[..., self.shared_places] = shared[..., self.shared_columns] + self.offset
        result[..., self.local_places] = local
        return result

    def split(
        self, points: Float[np.ndarray, "*batch dimension"]
    ) -> tuple[Float[np.ndarray, "*batch used"], Float[np.ndarray, "*batch local"]]:
        """Those of the shared numbers that have a place in the video, and the video's own ones."""
        return points[..., self.shared_places] - self.offset, points[..., self.local_places]

    def believing(self, mean: Float[np.ndarray, "shared"], sd: Float[np.ndarray, "shared"]) -> Likelihood:
        """Its density with what all videos say of the shared numbers as their prior."""
        priors = zip(self.shared_places, mean[self.shared_columns] + self.offset, sd[self.shared_columns], strict=True)
        return self._with_priors({int(place): Prior(float(m), float(s)) for place, m, s in priors})

    def _with_priors(self, priors: Mapping[int, Prior]) -> Likelihood:
        coordinates = self.likelihood.coordinates
        entries = tuple(
            replace(entry, prior=priors.get(place, entry.prior)) for place, entry in enumerate(coordinates.entries)
        )
        return replace(self.likelihood, coordinates=replace(coordinates, entries=entries))

    def value(self, shared: Float[np.ndarray, "shared"], local: Float[np.ndarray, "local"]) -> float:
        """Log density of the tracks and of the video's own numbers, given the shared ones."""
        return float(self.log_density(shared[None], local[None])[0])

    def log_density(
        self, shared: Float[np.ndarray, "point shared"], local: Float[np.ndarray, "point local"]
    ) -> Float[np.ndarray, "point"]:
        """The same of many points."""
        return evaluate(self.data.log_density, self.points(shared, local))


def link(
    likelihoods: Sequence[Likelihood], names: Collection[str] | None
) -> tuple[SharedNumbers, tuple[LinkedVideo, ...]]:
    """Link videos by the numbers that they share.

    Parameters
    ----------
    likelihoods
        Density of each video, priors as stated.
    names
        Quantities that are shared; all that have one value per video, and restitutions of walls at the same place,
        where None.
    """
    reference = _noise_reference(likelihoods)
    found: dict[Key, Coordinate] = {}
    for likelihood in likelihoods:
        for entry in likelihood.coordinates.entries:
            key = shared_key(entry, likelihood.tracks)
            if key is not None and (names is None or entry.field in names):
                found.setdefault(key, replace(entry, owner=None))
    numbers = SharedNumbers(tuple(found), tuple(found.values()), reference)
    return numbers, tuple(linked(likelihood, numbers) for likelihood in likelihoods)


def linked(likelihood: Likelihood, numbers: SharedNumbers) -> LinkedVideo:
    """A video in terms of given shared numbers; parameters that do nothing in it are added to its vector.

    Walls of other videos are not, nor the noise where it was found together with a model error.
    """
    coordinates = likelihood.coordinates
    places = {shared_key(entry, likelihood.tracks): place for place, entry in enumerate(coordinates.entries)}
    entries, columns, shared_places = list(coordinates.entries), [], []
    for column, (key, entry) in enumerate(zip(numbers.keys, numbers.entries, strict=True)):
        place = places.get(key)
        if place is None and (key[1] or key[0] in NOISE_FIELDS):
            continue
        if place is None:
            place = len(entries)
            entries.append(entry)
        columns.append(column)
        shared_places.append(place)
    offset = np.array([_offset(numbers.keys[column][0], likelihood, numbers.noise_reference) for column in columns])
    return LinkedVideo(
        replace(likelihood, coordinates=replace(coordinates, entries=tuple(entries))),
        np.array(columns, dtype=np.int64),
        np.array(shared_places, dtype=np.int64),
        offset,
    )


def check_names(names: Sequence[str], model: PhysicsModel) -> None:
    """Refuse names of quantities that videos cannot share.

    Raises
    ------
    InputError
        If the names are one text, the model has no such parameter, or each body has its own.
    """
    if isinstance(names, str):
        raise InputError(f"shared is the text '{names}'; give a list of names: ['{names}'].")
    per_video = [parameter.name for parameter in model.parameters if parameter.scope not in (Scope.BODY, Scope.VIDEO)]
    possible = [*per_video, WALL_RESTITUTION.name, NOISE, ANGLE_NOISE]
    for name in names:
        if name not in possible:
            raise InputError(
                f"shared: videos cannot share '{name}' under the model {model.name}; "
                f"name some of {', '.join(possible)}."
            )


def shared_key(entry: Coordinate, tracks: Tracks) -> Key | None:
    """What a number of a video's vector may be shared as; None where it is the video's own."""
    if entry.owner is None:
        return None if entry.single_video else (entry.field, ())
    if entry.group is not None:
        return entry.field, (entry.group,)
    if entry.field != WALL_RESTITUTION.name:
        return None
    return entry.field, tracks.walls[entry.owner].place


def _noise_reference(likelihoods: Sequence[Likelihood]) -> float | None:
    """Unit in m of the shared noise scale; None where every video states the size of its noise."""
    if all(likelihood.tracks.position_covariance is not None for likelihood in likelihoods):
        return None
    references = [likelihood.observations.position_reference for likelihood in likelihoods]
    return float(np.exp(np.mean(np.log(references))))


def _offset(field: str, likelihood: Likelihood, noise_reference: float | None) -> float:
    if field != NOISE or noise_reference is None:
        return 0.0
    return math.log(noise_reference / likelihood.observations.position_reference)

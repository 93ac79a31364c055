"""The unknowns of one video as one unconstrained vector, and back.

Positive quantities go in as logarithms: a collision identifies a difference of log masses and a sum of log
restitutions, so the ridges of the posterior are straight lines here. With a logit instead, every sampler failed.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from vrdp_prob.models.parameters import Parameter, Prior, Scope, Transform


@dataclass(frozen=True)
class Coordinate:
    """One number of the vector.

    Parameters
    ----------
    field
        Name of the quantity, for example `mass` or `velocity_x`.
    owner
        Body (or wall) that it belongs to; None where it is shared by the video.
    transform
        What the vector holds: the quantity, or (roughly) its logarithm.
    prior
        Prior in the vector's units.
    scale
        Typical size of a change, for finite differences and damping.
    group
        What those have in common that share the number, for example a material; None where it has one owner.
    others
        Its further owners.
    single_video
        Whether every video has its own even where several are looked at together.
    """

    field: str
    owner: int | None
    transform: Transform
    prior: Prior
    scale: float = 1.0
    group: str | None = None
    others: tuple[int, ...] = ()
    single_video: bool = False

    @property
    def name(self) -> str:
        """A name with its owner, for example `mass[2]`."""
        owner = self.owner if self.group is None else self.group
        return self.field if owner is None else f"{self.field}[{owner}]"

    @classmethod
    def of(cls, parameter: Parameter, owner: int | None = None, *, scale: float = 0.1) -> "Coordinate":
        """The number that stands for a parameter of the model."""
        single = parameter.scope is Scope.VIDEO
        return cls(parameter.name, owner, parameter.transform, parameter.prior, scale, single_video=single)


@dataclass(frozen=True)
class Coordinates:
    """All numbers of the vector, in order, with the values of what is not sampled.

    Parameters
    ----------
    entries
        The sampled numbers.
    defaults
        Value of every quantity where it is not sampled: one per owner, or a single one (axis of length 1) if shared.
    """

    entries: tuple[Coordinate, ...]
    defaults: Mapping[str, Float[np.ndarray, "owner"]]

    def __len__(self) -> int:
        return len(self.entries)

    @cached_property
    def places(self) -> dict[tuple[str, int | None], int]:
        """Place in the vector of a quantity and its owner."""
        return {(entry.field, entry.owner): place for place, entry in enumerate(self.entries)}

    @cached_property
    def prior_mean(self) -> Float[np.ndarray, "dimension"]:
        """Mean of the Gaussian prior."""
        return np.array([entry.prior.mean for entry in self.entries])

    @cached_property
    def prior_sd(self) -> Float[np.ndarray, "dimension"]:
        """Standard deviation of the Gaussian prior."""
        return np.array([entry.prior.sd for entry in self.entries])

    @cached_property
    def scale(self) -> Float[np.ndarray, "dimension"]:
        """Typical size of a change of each number."""
        return np.array([entry.scale for entry in self.entries])

    @cached_property
    def names(self) -> tuple[str, ...]:
        """A name for each number, for example `mass[2]`."""
        return tuple(entry.name for entry in self.entries)

    def mask(self, fields: Iterable[str], owners: Iterable[int] | None = None) -> Bool[np.ndarray, "dimension"]:
        """Which numbers belong to some quantities (and owners)."""
        chosen_fields = set(fields)
        chosen_owners = None if owners is None else set(owners)
        return np.array(
            [
                entry.field in chosen_fields and (chosen_owners is None or entry.owner in chosen_owners)
                for entry in self.entries
            ],
            dtype=bool,
        )

    def held(self, fields: Iterable[str], point: Float[np.ndarray, "dimension"]) -> "Coordinates":
        """The vector without some quantities, which keep the values that they have at a point."""
        values = self.quantities(torch.from_numpy(point[None]))
        kept = set(fields)
        defaults = {name: values[name][0].numpy() if name in kept else old for name, old in self.defaults.items()}
        return Coordinates(tuple(entry for entry in self.entries if entry.field not in kept), defaults)

    def carried(
        self, point: Float[np.ndarray, "dimension"], target: "Coordinates"
    ) -> Float[np.ndarray, "target_dimension"]:
        """The same values in another vector; what is new there is at the mean of its prior."""
        carried = target.prior_mean.copy()
        for key, place in target.places.items():
            if key in self.places:
                carried[place] = point[self.places[key]]
        return carried

    def quantities(self, points: Float[Tensor, "point dimension"]) -> dict[str, Float[Tensor, "point owner"]]:
        """Values of every quantity for all its owners (one column if it is shared)."""
        flat = self._all_defaults.expand(len(points), -1)
        for transform, places, targets in self._targets:
            flat = flat.index_copy(1, targets, transform.from_coordinate(points[:, places]))
        sizes = [len(values) for values in self.defaults.values()]
        return dict(zip(self.defaults, torch.split(flat, sizes, dim=1), strict=True))

    def prior_residuals(self, points: Float[Tensor, "point dimension"]) -> Float[Tensor, "point residual"]:
        """Numbers whose half sum of squares is the negative log prior (up to a constant): normal terms, then edges."""
        mean, sd, places, edges, softness = self._prior
        gaussian = (points - mean) / sd
        if not len(places):
            return gaussian
        beyond = (points[:, places] - edges) / softness
        return torch.cat([gaussian, (2 * torch.nn.functional.softplus(beyond) + TINY).sqrt()], dim=1)

    def log_prior(self, points: Float[Tensor, "point dimension"]) -> Float[Tensor, "point dimension"]:
        """Log prior density (nats, up to a constant) of each number by itself."""
        squares = self.prior_residuals(points) ** 2
        terms, (_, _, places, _, _) = squares[:, : len(self)], self._prior
        return -terms.index_add(1, places, squares[:, len(self) :]) / 2

    def prior_draws(self, count: int, generator: np.random.Generator) -> Float[np.ndarray, "draw dimension"]:
        """Draws of the prior."""
        columns = [entry.prior.sample(generator, (count,)) for entry in self.entries]
        return np.stack(columns, axis=1) if columns else np.zeros((count, 0))

    @cached_property
    def _all_defaults(self) -> Float[Tensor, "owner"]:
        """Defaults of all quantities, one after the other."""
        return torch.from_numpy(np.concatenate([np.asarray(v, dtype=float) for v in self.defaults.values()]))

    @cached_property
    def _targets(self) -> list[tuple[Transform, Int[Tensor, "entry"], Int[Tensor, "entry"]]]:
        """Per transform its places in the vector and in `_all_defaults`."""
        sizes = [len(values) for values in self.defaults.values()]
        begin = dict(zip(self.defaults, np.cumsum([0, *sizes[:-1]]), strict=True))
        targets = []
        for transform in {entry.transform: None for entry in self.entries}:
            chosen = [
                (place, begin[entry.field] + owner)
                for place, entry in enumerate(self.entries)
                for owner in (entry.owner or 0, *entry.others)
                if entry.transform is transform
            ]
            places, owners = (torch.tensor(column, dtype=torch.int64) for column in zip(*chosen, strict=True))
            targets.append((transform, places, owners))
        return targets

    @cached_property
    def _prior(self) -> tuple[Tensor, Tensor, Tensor, Tensor, Tensor]:
        """Mean and sd of the Gaussian prior of all entries; places, edges and softness of those with an edge."""
        limited = [(place, e.prior) for place, e in enumerate(self.entries) if e.prior.upper is not None]
        places = torch.tensor([place for place, _ in limited], dtype=torch.int64)
        edges = torch.tensor([prior.upper or 0.0 for _, prior in limited], dtype=torch.float64)
        softness = torch.tensor([prior.softness for _, prior in limited], dtype=torch.float64)
        return torch.from_numpy(self.prior_mean), torch.from_numpy(self.prior_sd), places, edges, softness


TINY = 1e-30
"""Keeps the slope of a square root finite far below an edge."""

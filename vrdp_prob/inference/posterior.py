"""The posterior of one video: draws with names and units, what they can be trusted for, and worlds made of them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import torch
import xarray as xr
from jaxtyping import Float
from torch import Tensor

from vrdp_prob.inference.draws.samples import Convergence
from vrdp_prob.inference.draws.summaries import ObjectSummary, PairSummary, ParameterSummary, Summary
from vrdp_prob.inference.identifiability.status import BodyStatus, CollisionGroup, ParameterStatus, Status
from vrdp_prob.inference.search.misfit import Misfit
from vrdp_prob.inference.tree import for_arviz
from vrdp_prob.models.parameters import MASS, RESTITUTION, WALL_RESTITUTION
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.scenery import Scenery
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.scene import Tracks
from vrdp_prob.spread import evenly_spread

Kind = TypeVar("Kind", bound="Posterior")
PairFunction = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Posterior:
    """Everything that was learned from the tracks of one video.

    Parameters
    ----------
    tracks
        What was seen.
    model
        The physics that was believed.
    seed
        Seed of all randomness.
    data
        The groups of `vrdp_prob.inference.tree.posterior_tree`; the draws have the axes `chain` and `draw`, then `body`
        where there is one value per body. SI units, as attributes.
    status
        What the data say about each body's mass and restitution, by id.
    convergence
        Whether the draws can be trusted.
    warnings
        Plain sentences: first a misfit of the model, then what else limits the result.
    pairs
        Ids of the pairs that collide in the most probable world, in order of time.
    groups
        Bodies that collisions link, with the combinations of masses and restitutions that the data determine.
    misfit
        How the residuals of the best fit compare with the noise, and what model error the intervals allow for.
    """

    tracks: Tracks
    model: PhysicsModel
    seed: int
    data: xr.DataTree
    status: Mapping[str, BodyStatus]
    convergence: Convergence
    warnings: tuple[str, ...]
    pairs: tuple[tuple[str, str], ...]
    groups: tuple[CollisionGroup, ...] = ()
    misfit: Misfit | None = None

    @property
    def draw_count(self) -> int:
        """Number of draws over all chains."""
        sizes = self.data["posterior"].sizes
        return int(sizes["chain"] * sizes["draw"])

    def worlds(self, count: int | None = None, *, generator: np.random.Generator | None = None) -> Worlds:
        """Draws as a batch of worlds, ready to be simulated.

        Parameters
        ----------
        count
            Number of worlds; all draws where None or where there are not so many.
        generator
            Chooses the draws at random; evenly spaced ones where None.
        """
        total = self.draw_count
        if count is None or count >= total:
            chosen = np.arange(total)
        elif generator is None:
            chosen = evenly_spread(count, total)
        else:
            chosen = np.sort(generator.choice(total, size=count, replace=False))
        draws = self.data["posterior"].to_dataset().stack(world=("chain", "draw")).isel(world=chosen)
        return self._worlds(draws.transpose("world", ...))

    def map_worlds(self) -> Worlds:
        """The most probable world, as a batch of one."""
        return self._worlds(self.data["map_estimate"].to_dataset().expand_dims("world"))

    def object_summary(self, body: str | int) -> ObjectSummary:
        """Mass and restitution of a body, by its id, with their intervals and status.

        Raises
        ------
        InputError
            If no object has that id.
        """
        body = str(body)
        index, status = self.tracks.index(body), self.status[body]
        mass, restitution = (Summary.of(self._draws(name)[..., index]) for name in ("mass", "restitution"))
        return ObjectSummary(
            body,
            _parameter_summary(mass, status.mass),
            _parameter_summary(restitution, status.restitution),
        )

    def mass_ratios(self) -> tuple[PairSummary, ...]:
        """Mass of the first over mass of the second body of every pair that collides."""
        return tuple(self._pair_summary(pair, MASS.name, np.divide) for pair in self.pairs)

    def restitution_pairs(self) -> tuple[PairSummary, ...]:
        """Restitution (product of both factors) of every pair that collides."""
        return tuple(self._pair_summary(pair, RESTITUTION.name, np.multiply) for pair in self.pairs)

    def tells(self, pair: tuple[str, str], name: str) -> bool:
        """Whether the data tell the ratio of `mass`, or the product of `restitution`, of two bodies that collide."""
        each = all(getattr(self.status[body], name).status is not Status.DEFAULT for body in pair)
        combinations = (one for group in self.groups for one in group.combinations)
        return each and all(
            one.linked for one in combinations if one.objects == pair and one.quantity.startswith(f"{name}_")
        )

    def to_arviz(self) -> Any:
        """All groups as what the installed ArviZ works with: `InferenceData` before its version 1, else `DataTree`."""
        return for_arviz(self.data)

    def write(self, path: Path | str) -> None:
        """Save as one netCDF file that needs nothing else to be read again; an interruption leaves no half file.

        Raises
        ------
        InputError
            If the file cannot be written.
        """
        from vrdp_prob.inference.storage import write_posterior  # noqa: PLC0415 (storage knows this class)

        write_posterior(self, Path(path))

    @classmethod
    def read(cls: "type[Kind]", path: Path | str, tracks: Tracks | None = None) -> "Kind":
        """Open what `write` saved; `AskablePosterior.read` gives one that can be asked.

        Parameters
        ----------
        path
            The file.
        tracks
            In place of the tracks in the file.

        Raises
        ------
        InputError
            If the file cannot be read or is not a posterior.
        """
        from vrdp_prob.inference.storage import read_posterior  # noqa: PLC0415 (storage knows this class)

        saved = read_posterior(Path(path), tracks)
        return cls(**{entry.name: getattr(saved, entry.name) for entry in fields(Posterior)})

    def _draws(self, name: str) -> Float[np.ndarray, "chain draw *axes"]:
        values: np.ndarray = self.data["posterior"][name].transpose("chain", "draw", ...).values
        return values

    def _pair_summary(self, pair: tuple[str, str], name: str, combine: PairFunction) -> PairSummary:
        draws = self._draws(name)
        first, second = (draws[..., self.tracks.index(body)] for body in pair)
        return PairSummary(pair, Summary.of(combine(first, second)), determined=self.tells(pair, name))

    def _worlds(self, draws: xr.Dataset) -> Worlds:
        return Scenery.of(self.tracks).worlds(self.model, quantities(draws))


def _parameter_summary(summary: Summary, status: ParameterStatus) -> ParameterSummary:
    return ParameterSummary(summary, str(status.status), status.partners, status.contraction)


def quantities(draws: xr.Dataset) -> dict[str, Float[Tensor, "world owner"]]:
    """Values of the likelihood's quantities from draws by name; every variable begins with the axis `world`."""
    split = {
        "x": draws["position"].isel(axis=0),
        "y": draws["position"].isel(axis=1),
        "velocity_x": draws["velocity"].isel(axis=0),
        "velocity_y": draws["velocity"].isel(axis=1),
    }
    # netCDF knows no axis of length 0, so a video without walls has no such variable
    nothing = {WALL_RESTITUTION.name: torch.zeros(draws.sizes["world"], 0, dtype=torch.float64)}
    plain = {str(name): values for name, values in draws.data_vars.items() if name not in ("position", "velocity")}
    return nothing | {
        name: torch.from_numpy(np.array(values.values, dtype=float).reshape(draws.sizes["world"], -1))
        for name, values in {**split, **plain}.items()
    }

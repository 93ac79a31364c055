"""The posterior of several videos: draws of what they share, and each video's posterior that goes with them."""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from jaxtyping import Float

from vrdp_prob.errors import InputError
from vrdp_prob.files import write_atomically
from vrdp_prob.inference.draws.samples import Convergence
from vrdp_prob.inference.draws.summaries import Summary
from vrdp_prob.inference.posterior import Posterior
from vrdp_prob.inference.several_videos.linking import SharedNumbers
from vrdp_prob.inference.storage import check_format, from_tree, reading, to_tree
from vrdp_prob.inference.tree import for_arviz
from vrdp_prob.models import model_file
from vrdp_prob.models.coordinates import Coordinate
from vrdp_prob.models.parameters import WALL_RESTITUTION, Prior, Transform, group_words
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.unknowns import NOISE

FORMAT = 1
"""Version of the layout of the file."""


class VideoPosteriors(Mapping[str, Posterior]):
    """Posteriors of the videos by name, each made when it is asked for, so that not all need be in memory.

    Parameters
    ----------
    makers
        What makes each.
    """

    def __init__(self, makers: Mapping[str, Callable[[], Posterior]]) -> None:
        self._makers = dict(makers)

    def __getitem__(self, video: str) -> Posterior:
        return self._makers[video]()

    def __iter__(self) -> Iterator[str]:
        return iter(self._makers)

    def __len__(self) -> int:
        return len(self._makers)


@dataclass(frozen=True)
class SharedPosterior:
    """Everything that was learned from the tracks of several videos.

    Parameters
    ----------
    model
        The physics that was believed.
    seed
        Seed of all randomness.
    numbers
        The shared numbers, with their priors.
    points
        Draws of them as they are inferred (logarithms of positive quantities).
    most_probable
        Their most probable values in the same form.
    log_evidence
        Log probability (nats) of the tracks under the model, up to a constant of the tracks: by importance sampling
        where that drew the numbers, else by Laplace's approximation.
    convergence
        Whether the draws of the shared numbers can be trusted.
    warnings
        Plain sentences about what limits the result; those of a video begin with its name.
    videos
        Each video's posterior by name, its draws those of the shared numbers; made anew whenever it is asked for.
    """

    model: PhysicsModel
    seed: int
    numbers: SharedNumbers
    points: Float[np.ndarray, "chain draw shared"]
    most_probable: Float[np.ndarray, "shared"]
    log_evidence: float
    convergence: Convergence
    warnings: tuple[str, ...]
    videos: Mapping[str, Posterior]

    def video(self, name: str) -> Posterior:
        """The posterior of one video, which goes with the draws of the shared numbers.

        Raises
        ------
        InputError
            If there is no video of that name.
        """
        if name not in self.videos:
            raise InputError(f"there is no video '{name}'; the videos are {', '.join(self.videos)}.")
        return self.videos[name]

    @property
    def shared(self) -> xr.Dataset:
        """Draws of the shared quantities by name, with the axes `chain` and `draw` (and `wall`); units as attributes.

        A `noise_scale` of 1 stands for the `reference_m` among its attributes, or for what each video states where
        there is none.
        """
        return self._named(self.numbers.quantities(self.points), ("chain", "draw"))

    @property
    def map_estimate(self) -> xr.Dataset:
        """The most probable values in the same form, without axes."""
        return self._named(self.numbers.quantities(self.most_probable), ())

    def summary(self, name: str) -> Summary:
        """A shared quantity in four numbers.

        Raises
        ------
        InputError
            If the videos share no quantity of that name.
        """
        shared = self.shared
        if name not in shared or shared[name].ndim > len(("chain", "draw")):
            known = [str(one) for one, values in shared.items() if values.ndim == len(("chain", "draw"))]
            raise InputError(f"the videos share no single '{name}'; they share {', '.join(known) or 'nothing'}.")
        return Summary.of(shared[name].values)

    def to_arviz(self) -> Any:
        """What is shared as what the installed ArviZ works with: `InferenceData` before its version 1, else `DataTree`.

        Its groups are `posterior`, `log_prior` and `map_estimate`; those of a video are in `video(name).to_arviz()`.
        """
        groups = {"posterior": self.shared, "log_prior": self._log_prior(), "map_estimate": self.map_estimate}
        return for_arviz(xr.DataTree.from_dict(groups))

    def write(self, path: Path | str) -> None:
        """Save as one netCDF file that needs nothing else to be read again; an interruption leaves no half file.

        Raises
        ------
        InputError
            If the file cannot be written.
        """
        with write_atomically(path) as temporary:
            shared = self.shared.assign_attrs(vrdp_prob=json.dumps(self._document()), format=FORMAT)
            shared = shared.assign(
                points=(("chain", "draw", "number"), self.points), most_probable=("number", self.most_probable)
            )
            shared.to_netcdf(temporary, engine="h5netcdf")
            for index, posterior in enumerate(self.videos.values()):
                _append(to_tree(posterior), temporary, f"video_{index}")

    @classmethod
    def read(cls, path: Path | str) -> "SharedPosterior":
        """Open what `write` saved; the posterior of a video is read when it is asked for.

        Raises
        ------
        InputError
            If the file cannot be read or is not such a posterior.
        """
        file = Path(path)
        with reading(file):
            with xr.open_dataset(file, engine="h5netcdf") as opened:
                shared = opened.load()
            document = json.loads(shared.attrs["vrdp_prob"])
            if "numbers" not in document:
                raise InputError("the posterior of one video; open it with vrdp_prob.AskablePosterior.read.")
            check_format(shared.attrs.get("format"), FORMAT)
            return cls(
                model=PhysicsModel(*model_file.parse(document["model"])),
                seed=document["seed"],
                numbers=_numbers(document["numbers"], document["noise_reference"]),
                points=shared["points"].values,
                most_probable=shared["most_probable"].values,
                log_evidence=document["log_evidence"],
                convergence=Convergence.of_document(document["convergence"]),
                warnings=tuple(document["warnings"]),
                videos=VideoPosteriors(
                    {name: _reader(file, f"video_{index}") for index, name in enumerate(document["videos"])}
                ),
            )

    def _document(self) -> dict[str, Any]:
        """What the file holds beside the arrays."""
        return {
            "model": self.model.text,
            "seed": self.seed,
            "numbers": [
                {
                    "field": key[0],
                    "place": list(key[1]),
                    "transform": str(entry.transform),
                    "prior": asdict(entry.prior),
                    "scale": entry.scale,
                }
                for key, entry in zip(self.numbers.keys, self.numbers.entries, strict=True)
            ],
            "noise_reference": self.numbers.noise_reference,
            "log_evidence": self.log_evidence,
            "convergence": asdict(self.convergence),
            "warnings": list(self.warnings),
            "videos": list(self.videos),
        }

    def _log_prior(self) -> xr.Dataset:
        """Log prior (up to a constant) of each shared number in each draw, by the names of the posterior."""
        chains, draws, count = self.points.shape
        terms = self.numbers.log_priors(self.points.reshape(chains * draws, count))
        named = self._named(terms.reshape(self.points.shape), ("chain", "draw"))
        return named.map(lambda values: values.drop_attrs(), keep_attrs=False)

    def _named(self, values: Float[np.ndarray, "*batch shared"], axes: tuple[str, ...]) -> xr.Dataset:
        """Columns of the shared quantities by name."""
        units = {parameter.name: parameter.unit for parameter in self.model.parameters}
        keys = self.numbers.keys
        variables: dict[str, Any] = {}
        coordinates: dict[str, Any] = {
            axis: np.arange(size) for axis, size in zip(axes, values.shape[:-1], strict=True)
        }
        for field in dict.fromkeys(field for field, _ in keys):
            places = [place for place, (other, _) in enumerate(keys) if other == field]
            attributes: dict[str, Any] = {"units": units.get(field, "1")}
            if field == NOISE and self.numbers.noise_reference is not None:
                attributes["reference_m"] = self.numbers.noise_reference
            labels = [group_words(keys[place][1]) for place in places]
            if not any(labels):
                variables[field] = (axes, values[..., places[0]], attributes)
                continue
            axis, meaning = ("wall", "x1, y1, x2, y2 in m") if field == WALL_RESTITUTION.name else ("material", "")
            variables[field] = ((*axes, axis), values[..., places], attributes)
            coordinates[axis] = (axis, labels, {"long_name": meaning} if meaning else {})
        return xr.Dataset(variables, coordinates)


def _append(tree: xr.DataTree, path: Path, group: str) -> None:
    """Write the groups of a posterior below a group of a file."""
    for node in tree.subtree:
        dataset = node.to_dataset(inherit=False)
        encoding = {
            str(name): {"compression": "gzip", "compression_opts": 4, "shuffle": True}
            for name, values in dataset.data_vars.items()
            if values.ndim
        }
        place = group if node.path == "/" else group + node.path
        dataset.to_netcdf(path, mode="a", group=place, engine="h5netcdf", encoding=encoding)


def _reader(path: Path, group: str) -> Callable[[], Posterior]:
    def read() -> Posterior:
        with reading(path), xr.open_datatree(path, group=group, engine="h5netcdf") as opened:
            return from_tree(opened.load().copy())

    return read


def _numbers(documents: Sequence[Mapping[str, Any]], noise_reference: float | None) -> SharedNumbers:
    return SharedNumbers(
        tuple((one["field"], tuple(one["place"])) for one in documents),
        tuple(
            Coordinate(one["field"], None, Transform(one["transform"]), Prior(**one["prior"]), one["scale"])
            for one in documents
        ),
        noise_reference,
    )

"""A posterior as one netCDF file, written to a temporary name first, and read back without anything else."""

import json
import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from vrdp_prob.errors import InputError
from vrdp_prob.files import write_atomically
from vrdp_prob.inference.draws.samples import Convergence
from vrdp_prob.inference.identifiability.status import BodyStatus, CollisionGroup, Combination, ParameterStatus, Status
from vrdp_prob.inference.posterior import Posterior
from vrdp_prob.inference.search.misfit import Misfit
from vrdp_prob.models import model_file
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.scene import Body, Camera, Shape, Tracks, Wall

FORMAT = 2
"""Version of the layout of the file."""
COMPRESSION = {"compression": "gzip", "compression_opts": 4, "shuffle": True}


def write_posterior(posterior: Posterior, path: Path) -> None:
    """Save a posterior; an interruption leaves no half file.

    Raises
    ------
    InputError
        If the file cannot be written: the folder, or a full disk.
    """
    with write_atomically(path) as temporary:
        fill_file(posterior, temporary)


def fill_file(posterior: Posterior, path: Path) -> None:
    """Write a posterior straight into a file, for those who see to its being whole themselves.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    tree = to_tree(posterior)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        # in memory first: on a full disk the HDF5 library would go on to fail whenever it frees an object
        content = tree.to_netcdf(engine="h5netcdf", encoding=_compressed(tree))
    path.write_bytes(content)


def to_tree(posterior: Posterior) -> xr.DataTree:
    """The groups of a posterior, with all that it holds beside them as an attribute of the root."""
    tree = posterior.data.copy()
    tree.attrs = {"vrdp_prob": json.dumps(_document(posterior)), "format": FORMAT}
    return tree


def from_tree(tree: xr.DataTree, tracks: Tracks | None = None) -> Posterior:
    """The posterior of such groups; the tracks come from them unless given.

    Raises
    ------
    InputError
        If they are of another layout.
    """
    check_format(tree.attrs.get("format"), FORMAT)
    return _posterior(json.loads(tree.attrs["vrdp_prob"]), tree, tracks)


def read_posterior(path: Path, tracks: Tracks | None = None) -> Posterior:
    """Open a saved posterior; the tracks come from the file unless given.

    Raises
    ------
    InputError
        If the file cannot be read or is not a posterior.
    """
    with reading(path):
        with xr.open_dataset(path, engine="h5netcdf") as root:
            if "numbers" in json.loads(root.attrs["vrdp_prob"]):
                raise InputError("the posterior of several videos; open it with SharedPosterior.read.")
        with xr.open_datatree(path, engine="h5netcdf") as opened:
            tree = opened.load().copy()
        return from_tree(tree, tracks)


def check_format(found: object, known: int) -> None:
    """Refuse a file of another layout than the known one.

    Raises
    ------
    InputError
        If it is.
    """
    if found != known:
        raise InputError(
            f"the posterior is of file format {found}, this program reads {known}; run the inference again."
        )


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn what goes wrong while a posterior is read into one sentence.

    Raises
    ------
    InputError
        If the file cannot be read or is not a posterior.
    """
    try:
        yield
    except FileNotFoundError as error:
        raise InputError(f"{path}: the posterior cannot be read (no such file); check the path.") from error
    except OSError as error:
        if path.is_file() and os.access(path, os.R_OK):
            raise InputError(
                f"{path}: not a posterior of this tool, or not a whole one; give a posterior.nc, or run the inference "
                "again."
            ) from error
        reason = "a folder has its name" if path.is_dir() else "no permission"
        raise InputError(f"{path}: the posterior cannot be read ({reason}); check the path.") from error
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    except (KeyError, ValueError, TypeError) as error:
        raise InputError(f"{path}: not a posterior of this tool ({error}); run the inference again.") from error


def _compressed(tree: xr.DataTree) -> dict[str, dict[str, dict[str, Any]]]:
    """How each array of each group is stored."""
    return {
        group.path: {str(name): dict(COMPRESSION) for name, values in group.data_vars.items() if values.ndim}
        for group in tree.subtree
    }


def _document(posterior: Posterior) -> dict[str, Any]:
    """What the file holds beside the arrays."""
    tracks, model = posterior.tracks, posterior.model
    return {
        "video": tracks.video,
        "bodies": [asdict(body) for body in tracks.bodies],
        "walls": [asdict(wall) for wall in tracks.walls],
        "camera": None if tracks.camera is None else tracks.camera.to_document(),
        "model": model.text,
        "seed": posterior.seed,
        "status": {name: asdict(status) for name, status in posterior.status.items()},
        "convergence": asdict(posterior.convergence),
        "warnings": list(posterior.warnings),
        "pairs": [list(pair) for pair in posterior.pairs],
        "groups": [asdict(group) for group in posterior.groups],
        "misfit": None if posterior.misfit is None else asdict(posterior.misfit),
    }


def _posterior(document: dict[str, Any], tree: xr.DataTree, tracks: Tracks | None) -> Posterior:
    status = {
        name: BodyStatus(_parameter_status(value["mass"]), _parameter_status(value["restitution"]))
        for name, value in document["status"].items()
    }
    return Posterior(
        tracks=_tracks(document, tree) if tracks is None else tracks,
        model=PhysicsModel(*model_file.parse(document["model"])),
        seed=document["seed"],
        data=tree,
        status=status,
        convergence=Convergence.of_document(document["convergence"]),
        warnings=tuple(document["warnings"]),
        pairs=tuple((first, second) for first, second in document["pairs"]),
        groups=tuple(_group(group) for group in document.get("groups", ())),
        misfit=Misfit(**document["misfit"]) if document.get("misfit") else None,
    )


def _group(document: dict[str, Any]) -> CollisionGroup:
    return CollisionGroup(
        tuple(document["bodies"]),
        tuple(Combination(**{**one, "objects": tuple(one["objects"])}) for one in document["combinations"]),
    )


def _parameter_status(document: dict[str, Any]) -> ParameterStatus:
    return ParameterStatus(Status(document["status"]), tuple(document["partners"]), document.get("contraction", 0.0))


def _tracks(document: dict[str, Any], tree: xr.DataTree) -> Tracks:
    """The tracks that the posterior was inferred from."""
    camera = document["camera"]
    return Tracks(
        document["video"],
        tuple(Body(**{**body, "shape": Shape(body["shape"])}) for body in document["bodies"]),
        tree["observed_data"].to_dataset().drop_vars(("position", "axis"), errors="ignore"),
        tuple(Wall(**wall) for wall in document["walls"]),
        None if camera is None else _camera(camera),
    )


def _camera(document: dict[str, Any]) -> Camera:
    return Camera(
        np.array(document["projection"]),
        document["width"],
        document["height"],
        document["fps"],
        document["pixel_sd"],
    )

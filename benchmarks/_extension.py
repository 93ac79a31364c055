"""A model that discovery extends on some videos, what these tell of the numbers that others share, and forecasts."""

import pickle
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from _finding_figures import keep_figures
from jaxtyping import Float

from vrdp_prob.discovery.discover import discover
from vrdp_prob.discovery.page.document import write_finding
from vrdp_prob.files import write_atomically
from vrdp_prob.inference import default_model
from vrdp_prob.inference.map_fit import fit_map
from vrdp_prob.inference.runs.parallel import several_processes
from vrdp_prob.inference.several_videos import SharedFit, fit_together, learned_model
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.progress import progress_display
from vrdp_prob.scene import Tracks


@dataclass(frozen=True)
class Learned:
    """What some videos tell under a model: their fit, and the model that believes it."""

    fit: SharedFit
    model: PhysicsModel


def base_model(training: Sequence[Tracks], folder: Path) -> PhysicsModel:
    """The default model with what some videos tell; the file `base.toml` of a folder, which is made where it lacks."""
    path = folder / "base.toml"
    if not path.exists():
        learned_base(training, folder).model.write(path)
    return PhysicsModel.read(path)


def extended_model(training: Sequence[Tracks], folder: Path, *, searched: int | None) -> PhysicsModel:
    """The model of a finding: `model.toml` of its folder, for which discovery looks where it lacks."""
    path = folder / "model.toml"
    return PhysicsModel.read(path) if path.exists() else learned_extension(training, folder, searched=searched).model


def learned_base(training: Sequence[Tracks], folder: Path) -> Learned:
    """What some videos tell under the default model; the fit is kept in a folder."""

    def found() -> SharedFit:
        with several_processes(None):
            return fit_together(training, model=default_model(), seed=0, progress=progress_display(quiet=False))

    fit = _kept(folder / "base.pickle", found)
    return Learned(fit, learned_model(fit))


def learned_extension(training: Sequence[Tracks], folder: Path, *, searched: int | None) -> Learned:
    """The default model extended by what discovery finds on some videos, of which so many are searched for causes.

    The finding is kept in a folder, and on the way to it what is done.
    """

    def found() -> SharedFit:
        finding = discover(
            training,
            seed=0,
            searched=searched,
            progress=progress_display(quiet=False),
            checkpoint=folder / "steps",
        )
        write_finding(finding, folder)
        keep_figures(finding, folder)
        assert finding.fit is not None
        return finding.fit

    fit = _kept(folder / "fit.pickle", found)
    return Learned(fit, PhysicsModel.read(folder / "model.toml"))


def _kept(path: Path, found: Callable[[], SharedFit]) -> SharedFit:
    """A fit from a file, which is made where it is missing."""
    if not path.exists():
        fit = found()
        with write_atomically(path) as temporary:
            temporary.write_bytes(pickle.dumps(fit))
    fit = pickle.loads(path.read_bytes())
    assert isinstance(fit, SharedFit)
    return fit


def first_part(tracks: Tracks, share: float) -> tuple[Tracks, Tracks]:
    """A share of the frames of a video, and all of them, of the bodies that were seen by then."""
    seen = tracks.until(tracks.times[int(share * len(tracks.times)) - 1])
    return seen, replace(seen, data=tracks.data.sel(body=[body.id for body in seen.bodies]))


def forecast(seen: Tracks, longer: Tracks, model: PhysicsModel) -> Float[np.ndarray, "time body 2"]:
    """Positions in m by the best fit to the first frames of a video, at the times of longer tracks of it."""
    fit = fit_map(seen, model, np.random.default_rng(0), model_error=False)
    likelihood = replace(fit.likelihood, tracks=longer)
    positions: np.ndarray = likelihood.rollout(torch.from_numpy(fit.point[None])).trajectory[0, :, :, :2].numpy()
    return positions

"""A model that discovery extends on some videos, what these tell of the numbers that others share, and forecasts."""

import pickle
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float

from vrdp_prob.discovery.discover import discover
from vrdp_prob.discovery.document import write_finding
from vrdp_prob.files import write_atomically
from vrdp_prob.inference.map_fit import fit_map
from vrdp_prob.inference.several_videos import SharedFit, fit_together
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.progress import progress_display
from vrdp_prob.scene import Tracks


def extended_model(training: Sequence[Tracks], folder: Path) -> PhysicsModel:
    """The default model extended by what discovery finds on some videos; the finding is kept in a folder."""
    if not (folder / "model.toml").exists():
        write_finding(discover(training, seed=0, progress=progress_display(quiet=False)), folder)
    return PhysicsModel.read(folder / "model.toml")


def fit_of(training: Sequence[Tracks], model: PhysicsModel, folder: Path, name: str) -> SharedFit:
    """What some videos tell under a model of some name; the fit is kept in a folder."""
    path = folder / f"{name.replace(' ', '-')}.pickle"
    if not path.exists():
        fit = fit_together(training, model=model, seed=0, progress=progress_display(quiet=False))
        with write_atomically(path) as temporary:
            temporary.write_bytes(pickle.dumps(fit))
    fit = pickle.loads(path.read_bytes())
    assert isinstance(fit, SharedFit)
    return fit


def forecast(seen: Tracks, longer: Tracks, model: PhysicsModel) -> Float[np.ndarray, "time body 2"]:
    """Positions in m by the best fit to the first frames of a video, at the times of longer tracks of it."""
    fit = fit_map(seen, model, np.random.default_rng(0), model_error=False)
    likelihood = replace(fit.likelihood, tracks=longer)
    positions: np.ndarray = likelihood.rollout(torch.from_numpy(fit.point[None])).trajectory[0, :, :, :2].numpy()
    return positions

"""A model that discovery extends on some videos, and what these videos then tell of the numbers that others share."""

import pickle
from collections.abc import Sequence
from pathlib import Path

from vrdp_prob.discovery.discover import discover
from vrdp_prob.discovery.document import write_finding
from vrdp_prob.files import write_atomically
from vrdp_prob.inference.several_videos import SharedFit, fit_together
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.progress import progress_display
from vrdp_prob.scene import Tracks


def extended_model(training: Sequence[Tracks], folder: Path) -> PhysicsModel:
    """The default model extended by what discovery finds on some videos; the finding is kept in a folder."""
    if not (folder / "model.toml").exists():
        write_finding(discover(training, seed=0, progress=progress_display(quiet=False)), folder)
    return PhysicsModel.read(folder / "model.toml")


def fit_of(training: Sequence[Tracks], model: PhysicsModel, path: Path) -> SharedFit:
    """What some videos tell under a model; the fit is kept in a file."""
    if not path.exists():
        fit = fit_together(training, model=model, seed=0, progress=progress_display(quiet=False))
        with write_atomically(path) as temporary:
            temporary.write_bytes(pickle.dumps(fit))
    fit = pickle.loads(path.read_bytes())
    assert isinstance(fit, SharedFit)
    return fit

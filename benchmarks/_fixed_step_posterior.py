"""The posterior of a video of discs under the base model, with the fixed-step simulator in place of ours."""

import torch
from _fixed_step_contacts import Laws
from _fixed_step_torch import FORMULATIONS, positions
from torch import Tensor

from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.scenery import Scenery
from vrdp_prob.models.unknowns import NOISE


class FixedStepPosterior:
    """Log posterior density; all bodies are released at the first frame, and positions alone are seen.

    Parameters
    ----------
    likelihood
        That of our simulator, for unknowns, priors and what was seen.
    """

    def __init__(self, likelihood: Likelihood) -> None:
        self._likelihood, self._scenery = likelihood, Scenery.of(likelihood.tracks)
        self._seen = torch.from_numpy(likelihood.tracks.positions.copy())
        self._there = torch.isfinite(self._seen)

    def __call__(self, points: Tensor) -> Tensor:
        likelihood = self._likelihood
        quantities = likelihood.coordinates.quantities(points)
        worlds = self._scenery.worlds(likelihood.model, quantities)
        shown = positions(worlds, len(self._seen), Laws(), FORMULATIONS["all pairs"])
        noise = quantities[NOISE][:, :1, None, None] * likelihood.observations.position_reference
        residuals = torch.where(self._there, (shown - self._seen.nan_to_num()) / noise, 0.0)
        scale = int(self._there.sum()) * quantities[NOISE][:, 0].log()
        prior = (likelihood.coordinates.prior_residuals(points) ** 2).sum(dim=1) / 2
        return -(residuals**2).sum(dim=(1, 2, 3)) / 2 - scale - prior

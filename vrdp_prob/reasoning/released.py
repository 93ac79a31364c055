"""Posterior draws as they are, simulated from the release on."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Float

from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.rollout import Rollout, simulate
from vrdp_prob.models.simulator.worlds import Worlds


@dataclass(frozen=True)
class Released:
    """Posterior draws and their rollouts from the release on.

    Parameters
    ----------
    worlds
        The posterior draws.
    times
        Times in s of the frames of the video.
    model
        The physics.
    """

    worlds: Worlds
    times: Float[np.ndarray, "frame"]
    model: PhysicsModel

    @cached_property
    def rollout(self) -> Rollout:
        """What happened in the video if nothing but the draws is asked."""
        with torch.no_grad():
            return simulate(self.worlds, torch.from_numpy(self.times.copy()), self.model)

"""Answers of a single best fit, as VRDP gives them: what probabilities are compared with."""

from dataclasses import dataclass

import numpy as np

from vrdp_prob.inference import Posterior
from vrdp_prob.inference.draws.samples import Convergence
from vrdp_prob.inference.identifiability.status import BodyStatus
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.reasoning.chance import MostProbable
from vrdp_prob.reasoning.worlds import PosteriorWorlds
from vrdp_prob.scene import Tracks


@dataclass(frozen=True)
class _BestFit:
    """A posterior whose every draw is the most probable world."""

    posterior: Posterior

    @property
    def tracks(self) -> Tracks:
        return self.posterior.tracks

    @property
    def model(self) -> PhysicsModel:
        return self.posterior.model

    @property
    def seed(self) -> int:
        return self.posterior.seed

    @property
    def convergence(self) -> Convergence:
        return self.posterior.convergence

    @property
    def status(self) -> "dict[str, BodyStatus]":
        return dict(self.posterior.status)

    def worlds(self, count: int | None = None, *, generator: np.random.Generator | None = None) -> Worlds:
        del generator
        return self.posterior.map_worlds().select([0] * (count or 1))


def plug_in_worlds(posterior: Posterior) -> PosteriorWorlds:
    """The worlds of the most probable values alone: one draw, every answer with probability 1.

    Masses, restitutions and motion are those of the MAP; what the tracks leave open (doubtful contacts and rests,
    attributes) is as is most probable.
    """
    return PosteriorWorlds(_BestFit(posterior), draws=1, chance=MostProbable(), deviating=None)

"""What reasoning needs of a posterior."""

from typing import Protocol, runtime_checkable

import numpy as np

from vrdp_prob.inference.draws.samples import Convergence
from vrdp_prob.inference.identifiability.status import BodyStatus
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.scene import Tracks


@runtime_checkable
class StatusByBody(Protocol):
    """A mapping from the id of a body to its status."""

    def __getitem__(self, body: str, /) -> BodyStatus: ...


@runtime_checkable
class PosteriorLike(Protocol):
    """What is needed of a posterior."""

    @property
    def tracks(self) -> Tracks:
        """What was seen."""
        ...

    @property
    def model(self) -> PhysicsModel:
        """The physics."""
        ...

    @property
    def seed(self) -> int:
        """Seed of all randomness."""
        ...

    @property
    def convergence(self) -> Convergence:
        """How far the draws can be trusted."""
        ...

    @property
    def status(self) -> StatusByBody:
        """What the data say about each body, by id."""
        ...

    def worlds(self, count: int | None = None, *, generator: np.random.Generator | None = None) -> Worlds:
        """Posterior draws."""
        ...

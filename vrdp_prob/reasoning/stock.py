"""Where the draws of a video come from, batch by batch, and how many are worth taking."""

from functools import cached_property

import numpy as np
from jaxtyping import Int

from vrdp_prob.inference.identifiability.status import BodyStatus
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.reasoning.batch import Batch, Common
from vrdp_prob.reasoning.chance import Chance, Purpose, Seeded
from vrdp_prob.reasoning.defaults import DEFAULT, DRAWN, Defaults, with_defaults
from vrdp_prob.reasoning.deviations import DeviationModel
from vrdp_prob.reasoning.posterior_like import PosteriorLike
from vrdp_prob.reasoning.released import Released
from vrdp_prob.reasoning.sight import Sight
from vrdp_prob.spread import evenly_spread


class Stock:
    """The draws of a posterior in batches, each made when it is asked for and kept.

    The first batch holds evenly spaced draws, the others what is left, in random order: no draw is used twice.

    Parameters
    ----------
    posterior
        The posterior of one video.
    size
        Draws in a batch.
    defaults
        See `vrdp_prob.reasoning.defaults`.
    chance
        Where draws of what the tracks leave open come from.
    deviating
        How motion deviates from the model; None where it follows it exactly.
    own_courses
        Whether draws that show what was seen may follow their own course.
    """

    def __init__(
        self,
        posterior: PosteriorLike,
        size: int,
        *,
        defaults: Defaults,
        chance: Chance,
        deviating: DeviationModel | None = None,
        own_courses: bool = True,
    ) -> None:
        self.posterior, self._size, self._defaults, self._chance = posterior, size, defaults, chance
        drawn = posterior.worlds(size)
        common = Common(
            Sight(posterior.tracks), posterior.model, drawn.select([len(drawn) // 2]), deviating, own_courses
        )
        self._common = common
        self._batches = [self._batch(drawn, 0)]

    @property
    def worth(self) -> float:
        """Number of independent draws that all of the posterior's draws are worth; infinite where nobody says."""
        effective = self.posterior.convergence.ess_bulk
        return float(effective) if effective is not None and np.isfinite(effective) else np.inf

    def batch(self, number: int) -> Batch | None:
        """A batch by its number; None where the posterior has no draws left for it."""
        while len(self._batches) <= number:
            start = (len(self._batches) - 1) * self._size
            chosen = self._left[start : start + self._size]
            if not len(chosen):
                return None
            self._batches.append(self._batch(self._everything.select(chosen.tolist()), len(self._batches)))
        return self._batches[number]

    @cached_property
    def _everything(self) -> Worlds:
        """All draws."""
        return self.posterior.worlds()

    @cached_property
    def _left(self) -> Int[np.ndarray, "left"]:
        """Which of all draws are not in the first batch, in random order."""
        total = len(self._everything)
        # as `Posterior.worlds` chooses them
        first = evenly_spread(len(self._batches[0]), total)
        return Seeded(self.posterior.seed).numbers(Purpose.ORDER).permutation(np.setdiff1d(np.arange(total), first))

    def _batch(self, drawn: Worlds, number: int) -> Batch:
        generator = Seeded(self.posterior.seed, number).numbers(Purpose.DEFAULTS)
        known = [self._known(place) for place in range(len(self.posterior.tracks.bodies))]
        drawn = with_defaults(drawn, self.posterior.model, known, self._defaults, generator)
        released = Released(drawn, self.posterior.tracks.times, self.posterior.model)
        return Batch(self._common, released, self._chance.another(number))

    def _known(self, place: int) -> tuple[str, str]:
        """Status of mass and restitution of a body; a default mass that differs between draws is an unknown."""
        status = self._status(self.posterior.tracks.bodies[place].id)
        mass = str(status.mass.status)
        if self._defaults == "prior" and mass == DEFAULT:
            drawn = self._everything.mass[:, place]
            mass = mass if bool((drawn == drawn[0]).all()) else DRAWN
        return mass, str(status.restitution.status)

    def _status(self, body: str) -> BodyStatus:
        return self.posterior.status[body]

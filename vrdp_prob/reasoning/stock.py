"""Where the draws of a video come from, batch by batch, and how many are worth taking."""

from functools import cached_property

import numpy as np
from jaxtyping import Int

from vrdp_prob.inference.identifiability import BodyStatus
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.reasoning.batch import Batch, Common
from vrdp_prob.reasoning.chance import Chance, Purpose, Seeded
from vrdp_prob.reasoning.defaults import DRAWN, Defaults, with_defaults
from vrdp_prob.reasoning.deviations import DeviationModel
from vrdp_prob.reasoning.posterior_like import PosteriorLike
from vrdp_prob.reasoning.released import Released
from vrdp_prob.reasoning.sight import Sight


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
        self._left: tuple[Worlds, Int[np.ndarray, "left"]] | None = None

    @property
    def worth(self) -> float:
        """Number of independent draws that all of the posterior's draws are worth; infinite where nobody says."""
        effective = self.posterior.convergence.ess_bulk
        return float(effective) if effective is not None and np.isfinite(effective) else np.inf

    def batch(self, number: int) -> Batch | None:
        """A batch by its number; None where the posterior has no draws left for it."""
        while len(self._batches) <= number:
            everything, left = self._remaining()
            start = (len(self._batches) - 1) * self._size
            chosen = left[start : start + self._size]
            if not len(chosen):
                return None
            self._batches.append(self._batch(everything.select(chosen.tolist()), len(self._batches)))
        return self._batches[number]

    def _remaining(self) -> tuple[Worlds, Int[np.ndarray, "left"]]:
        """All draws, and which of them are not in the first batch, in random order."""
        if self._left is None:
            everything = self.posterior.worlds()
            # as `Posterior.worlds` chooses them
            first = np.linspace(0, len(everything) - 1, len(self._batches[0])).round().astype(int)
            left = np.setdiff1d(np.arange(len(everything)), first)
            self._left = everything, Seeded(self.posterior.seed).numbers(Purpose.ORDER).permutation(left)
        return self._left

    def _batch(self, drawn: Worlds, number: int) -> Batch:
        generator = Seeded(self.posterior.seed, number).numbers(Purpose.DEFAULTS)
        statuses = [self._status(body.id) for body in self.posterior.tracks.bodies]
        known = [
            (str(status.mass.status) if held else DRAWN, str(status.restitution.status))
            for status, held in zip(statuses, self._held_masses, strict=True)
        ]
        drawn = with_defaults(drawn, self.posterior.model, known, self._defaults, generator)
        released = Released(drawn, self.posterior.tracks.times, self.posterior.model)
        return Batch(self._common, released, self._chance.another(number))

    @cached_property
    def _held_masses(self) -> list[bool]:
        """Whether the mass of each body is the same in all draws; else it is an unknown, whatever is said of it."""
        mass = self.posterior.worlds().mass
        held: list[bool] = (mass == mass[0]).all(dim=0).tolist()
        return held

    def _status(self, body: str) -> BodyStatus:
        return self.posterior.status[body]

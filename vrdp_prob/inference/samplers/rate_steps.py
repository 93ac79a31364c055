"""Steps that trade one rate of slowing down against the others, as the tracks allow it.

Tracks tell the sum of what slows a body down, not how it is divided between friction and drag. In the logarithms of
the rates that is an L-shaped ridge: towards either end one rate falls without bound while the other hardly changes. No
trajectory along a gradient and no cloud gets round its corner quickly. In the rates themselves the ridge is straight,
so a step along it is one shear, whatever its length.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.random import RandomState

from vrdp_prob.inference.draws.mode import Mode
from vrdp_prob.inference.draws.samples import Gaussian
from vrdp_prob.inference.samplers.curved_gaussian import CurvedGaussian
from vrdp_prob.inference.samplers.mixture import Random
from vrdp_prob.inference.samplers.straightening import Rates

LENGTHS = (0.3, 1.0, 2.0)
"""Standard deviations of the steps in the logarithm of a rate; one is drawn for each step."""


@dataclass(frozen=True)
class RateSteps:
    """How everything follows when one rate changes; to first order in the rates, at a mode.

    Parameters
    ----------
    directions
        Change of the logarithm of each rate per change of each coordinate.
    origin
        Logarithms of the rates at the mode.
    response
        Relative change of each rate (second axis) per relative change of one of them, both in units of the mode's.
    following
        Change of the coordinates that are no factors of rates per relative change of a rate.
    shares
        Change of the coordinates per change of the logarithms of the rates.
    """

    directions: Float[np.ndarray, "rate dimension"]
    origin: Float[np.ndarray, "rate"]
    response: Float[np.ndarray, "rate rate"]
    following: Float[np.ndarray, "rate dimension"]
    shares: Float[np.ndarray, "dimension rate"]

    @classmethod
    def of(cls, mode: Mode, rates: Rates) -> "RateSteps | None":
        """Those at a mode; None where there are no rates."""
        directions = rates.directions
        if not len(directions):
            return None
        root = Gaussian.from_precision(mode.point, mode.precision).root
        slopes = directions @ root
        ways = (slopes @ root.T) / (slopes**2).sum(axis=1)[:, None]
        following = ways.copy()
        following[:, rates.taken] = 0.0
        # A shared friction and the bodies' ratios to it divide a change as their priors would.
        spread = directions * rates.prior_sd**2
        shares = spread.T @ np.linalg.inv(spread @ directions.T)
        return cls(directions, directions @ mode.point, ways @ directions.T, following, shares)

    def moved(
        self, points: Float[np.ndarray, "point dimension"], random: Random
    ) -> tuple[Float[np.ndarray, "point dimension"], Float[np.ndarray, "point"]]:
        """Points with one rate of each changed and all that follows it, and the logarithm of the change of volume.

        The way back is as probable as the way there. Where another rate would become negative the volume is none, and
        the point stays.
        """
        count, rows = len(points), np.arange(len(points))
        chosen = random.choice(len(self.origin), size=count)
        logs = points @ self.directions.T - self.origin
        step = random.choice(LENGTHS, size=count) * random.standard_normal(count)
        change = np.exp(logs[rows, chosen]) * np.expm1(step)
        wanted = np.exp(logs) + self.response[chosen] * change[:, None]
        possible = (wanted > 0).all(axis=1)
        after = np.log(np.where(wanted > 0, wanted, 1.0)) - logs
        moved = points + after @ self.shares.T + self.following[chosen] * change[:, None]
        volume = after[rows, chosen] - after.sum(axis=1)
        return np.where(possible[:, None], moved, points), np.where(possible, volume, -np.inf)


class RateProposal:
    """Proposals of an emcee ensemble by such steps.

    Parameters
    ----------
    steps
        The steps.
    coordinates
        Whose whitened coordinates the walkers live in.
    """

    def __init__(self, steps: RateSteps, coordinates: CurvedGaussian) -> None:
        self._steps, self._coordinates = steps, coordinates

    def __call__(
        self, places: Float[np.ndarray, "walker dimension"], random: RandomState
    ) -> tuple[Float[np.ndarray, "walker dimension"], Float[np.ndarray, "walker"]]:
        """Proposals for walkers at some places, with the log ratio of their densities."""
        moved, volume = self._steps.moved(self._coordinates.points(places), random)
        return self._coordinates.whitened(moved), volume

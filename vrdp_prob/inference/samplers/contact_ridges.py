"""Ridges along which velocities before a contact make up for masses and restitutions, made straight.

Of two bodies that meet soon after they were first seen, the tracks tell how they part and hardly how they came. Any
masses and any restitution have velocities of approach that lead to the same parting: a thin bent sheet, along which
these velocities grow as the restitution falls. The map here moves them by how much they have to change, and not by how
much that is to first order. It is a shear, so it keeps volumes.

An impulse J turns the closing speed c into the speed -e c of the parting, so with the effective mass m at the touching
point J = m c (1 + e). Where the parting is to stay as it is, J goes with m (1 + 1/e). Source of the impulse: J. K.
Hahn, Realistic animation of rigid bodies, SIGGRAPH 1988.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from vrdp_prob.inference.draws.samples import Gaussian
from vrdp_prob.inference.search.least_squares import Residuals, robust_cost
from vrdp_prob.models.coordinates import Coordinates
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.parameters import MASS, RESTITUTION
from vrdp_prob.models.simulator.events import CONTACTS, RolloutEventKind
from vrdp_prob.models.simulator.worlds import INERTIA_FACTORS
from vrdp_prob.scene import Body

SOON = 0.6
"""Time (s) since both bodies were first seen within which their contact is looked at."""
LARGEST = 2.0
"""Change of a logarithm beyond which the ridge is followed no further."""
WORTHWHILE = 0.2
"""Nats by which the density one standard deviation along the ridge has to be higher than without the map..."""
DEEPEST = 20.0
"""...where what lies deeper below the mode counts as so deep, lest one place with no hope decide."""


@dataclass(frozen=True)
class ContactRidge:
    """A shear under which what comes before a contact follows masses and restitution along a straight line.

    Parameters
    ----------
    centre
        The mode; the map leaves it, and its surroundings to first order, alone.
    drivers
        Change of the logarithms of the first mass, the second mass and the restitution per change of each coordinate.
    approach
        Change of the coordinates per impulse over the mass of each body, where the parting stays as it is.
    impulses
        Impulse over mass (m/s) of each body at the mode.
    share
        Share of the first body in the inverse effective mass at the mode.
    restitution
        Of the contact at the mode.
    """

    centre: Float[Tensor, "dimension"]
    drivers: Float[Tensor, "3 dimension"]
    approach: Float[Tensor, "2 dimension"]
    impulses: Float[Tensor, "2"]
    share: float
    restitution: float

    def bent(self, points: Float[Tensor, "*batch dimension"]) -> Float[Tensor, "*batch dimension"]:
        """Points of the posterior that belong to points beside a straight ridge; differentiable."""
        return points + self._shift(points)

    def straightened(self, points: Float[np.ndarray, "*batch dimension"]) -> Float[np.ndarray, "*batch dimension"]:
        """The inverse of `bent`: the shift depends on masses and restitutions alone, which it leaves as they are."""
        return np.asarray(points - self._shift(torch.from_numpy(points)).numpy())

    def helps(self, gaussian: Gaussian, residuals: Residuals) -> bool:
        """Whether the residuals one standard deviation along the ridge of a Gaussian are smaller than without it."""
        _, sizes, ways = np.linalg.svd(self.drivers.numpy() @ gaussian.root, full_matrices=False)
        along = ways[sizes > 1e-6 * sizes.max()]
        ends = gaussian.points(np.concatenate([along, -along]))
        middle = robust_cost(residuals(gaussian.mean[None]), None)
        bent, unbent = (
            np.minimum(robust_cost(residuals(one), None) - middle, DEEPEST).mean()
            for one in (self.bent(torch.from_numpy(ends)).numpy(), ends)
        )
        return bool(bent < unbent - WORTHWHILE)

    def _shift(self, points: Float[Tensor, "*batch dimension"]) -> Float[Tensor, "*batch dimension"]:
        change = ((points - self.centre) @ self.drivers.T).clamp(-LARGEST, LARGEST)
        lighter, lost = torch.exp(-change[..., :2]), torch.exp(-change[..., 2:])
        effective = 1 / (lighter @ self._shares)[..., None]
        growth = effective * (self.restitution + lost) / (self.restitution + 1)
        return (self.impulses * (growth * lighter - 1) - change @ self._slope) @ self.approach

    @cached_property
    def _shares(self) -> Float[Tensor, "2"]:
        return torch.tensor([self.share, 1 - self.share], dtype=torch.float64)

    @cached_property
    def _slope(self) -> Float[Tensor, "3 2"]:
        """Change of both impulses over mass per change of the logarithms, at the mode."""
        other, loss = 1 - self.share, 1 / (1 + self.restitution)
        shape = [[-other, self.share], [other, -self.share], [-loss, -loss]]
        return torch.tensor(shape, dtype=torch.float64) * self.impulses


def contact_ridges(likelihood: Likelihood, point: Float[np.ndarray, "dimension"]) -> list[ContactRidge]:
    """Those of the early contacts in the world of a point: both bodies were released in motion and have met nothing.

    Parameters
    ----------
    likelihood
        The density.
    point
        A mode of it.
    """
    with torch.no_grad():
        rollout = likelihood.rollout(torch.from_numpy(point[None]))
        masses = likelihood.coordinates.quantities(torch.from_numpy(point[None]))[MASS.name][0].numpy()
    events, tracks = rollout.events, likelihood.tracks
    met: set[int] = set()
    found = []
    for number in np.flatnonzero(np.isin(events.kind, CONTACTS)):
        is_pair = events.kind[number] == RolloutEventKind.COLLISION
        pair = [int(events.first[number]), *([int(events.second[number])] if is_pair else [])]
        after = events.time[number] - tracks.first_seen[pair]
        if is_pair and not met.intersection(pair) and (after < SOON).all():
            meeting = _Meeting(
                likelihood.coordinates,
                tuple(tracks.bodies[body] for body in pair),
                pair,
                after,
                masses[pair],
                events.normal[number],
                events.point[number],
                float(events.impulse[number]),
                float(events.closing_speed[number]),
            )
            found.append(meeting.ridge(point))
        met.update(pair)
    return [ridge for ridge in found if ridge is not None]


@dataclass(frozen=True)
class _Meeting:
    """An early contact of two bodies in the world of a mode.

    Parameters
    ----------
    coordinates
        The unknowns.
    bodies, pair
        The two bodies and their numbers.
    after
        Time in s since the release of each.
    masses
        Of each, in kg.
    normal, point, impulse, closing_speed
        See `EventTable`.
    """

    coordinates: Coordinates
    bodies: tuple[Body, ...]
    pair: Sequence[int]
    after: Float[np.ndarray, "2"]
    masses: Float[np.ndarray, "2"]
    normal: Float[np.ndarray, "2"]
    point: Float[np.ndarray, "2"]
    impulse: float
    closing_speed: float

    def ridge(self, mode: Float[np.ndarray, "dimension"]) -> ContactRidge | None:
        """Its ridge; None where a body comes from rest, or the bodies do not part."""
        places = self.coordinates.places
        drivers, approach = np.zeros((3, len(self.coordinates))), np.zeros((2, len(self.coordinates)))
        mobility = 1 / self.masses
        for row, (body, sign) in enumerate(zip(self.pair, (1.0, -1.0), strict=True)):
            if ("velocity_x", body) not in places:
                return None
            for driver, name in ((row, MASS.name), (2, RESTITUTION.name)):
                if (name, body) in places:
                    drivers[driver, places[name, body]] = 1.0
            lever, turning = self._lever(row, mode)
            mobility[row] *= 1 + lever * turning
            sizes = (*self.normal, turning)
            for rate, name, size in zip(("velocity_x", "velocity_y", "spin"), ("x", "y", "angle"), sizes, strict=True):
                if (rate, body) in places:
                    approach[row, places[rate, body]] = sign * size
                    if (name, body) in places:
                        approach[row, places[name, body]] = -sign * size * self.after[row]
        parting = self.impulse * mobility.sum() - self.closing_speed
        if not (self.closing_speed > 0 and parting > 0 and drivers.any()):
            return None
        return ContactRidge(
            centre=torch.from_numpy(mode.copy()),
            drivers=torch.from_numpy(drivers),
            approach=torch.from_numpy(approach),
            impulses=torch.from_numpy(self.impulse / self.masses),
            share=float(mobility[0] / mobility.sum()),
            restitution=parting / self.closing_speed,
        )

    def _lever(self, row: int, mode: Float[np.ndarray, "dimension"]) -> tuple[float, float]:
        """Moment arm in m of the impulse on a body, and the change of its spin per impulse over its mass."""
        body, number, places = self.bodies[row], self.pair[row], self.coordinates.places
        if body.shape.is_disc or body.radius is None:
            return 0.0, 0.0
        names = (("x", "velocity_x"), ("y", "velocity_y"))
        centre = [mode[places[at, number]] + mode[places[rate, number]] * self.after[row] for at, rate in names]
        arm = self.point - np.array(centre)
        lever = float(arm[0] * self.normal[1] - arm[1] * self.normal[0])
        known = None if body.inertia is None else body.inertia / self.masses[row]
        return lever, lever / (known or INERTIA_FACTORS[body.shape] * body.radius**2)

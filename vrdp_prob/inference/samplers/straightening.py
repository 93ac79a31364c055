"""Ridges along which friction and drag make up for release velocities, made straight.

Tracks depend nearly linearly on the rates at which bodies slow down, not on their logarithms. Far towards small rates,
where a change of the logarithm changes nothing any more, release velocities must stop to follow it; a straight or
quadratic ridge leaves the posterior there, and its long tail is never sampled. The map here moves everything else by
how much a rate has changed and not by how much its logarithm has. It is a shear, so it keeps volumes.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor

from vrdp_prob.inference.draws.mode import Mode
from vrdp_prob.inference.draws.samples import Gaussian
from vrdp_prob.inference.search.noise_fit import NOISE_FIELDS
from vrdp_prob.models.coordinates import Coordinates
from vrdp_prob.models.effects.body_friction import FRICTION_RATIO
from vrdp_prob.models.parameters import (
    MASS,
    RESTITUTION,
    ROLLING_RESISTANCE,
    SLIDING_FRICTION,
    WALL_RESTITUTION,
    Transform,
)
from vrdp_prob.scene import Shape, Tracks

NO_RATES = frozenset({MASS.name, RESTITUTION.name, WALL_RESTITUTION.name, *NOISE_FIELDS})
"""Quantities with a logarithm in the vector that are no rates of slowing down."""
LARGEST = 4.0
"""Change of the logarithm of a rate beyond which the ridge is followed no further."""
DRAWS = 50_000
TAILS = 10.0
"""Degrees of freedom of the proposals for the rates alone..."""
WIDER = 1.5
"""...and the factor by which they are wider than the curvature at the mode says."""
ROOM = 1.2
"""Factor by which a cloud is wider along the rates than the posterior, for their skewed tails; without it Pareto k is
1.6 where it is below 0.5 now."""
FEWEST = 100.0
"""Effective draws that have to be left for their mean and covariance to be believed."""


@dataclass(frozen=True)
class Rates:
    """The rates of slowing down among the unknowns of a video.

    Parameters
    ----------
    directions
        Change of the logarithm of each rate per change of each coordinate: a body's own rate is the product of the
        friction that all share and its ratio to it.
    places
        Coordinate that stands for each rate alone.
    prior_mean, prior_sd
        Of all coordinates.
    """

    directions: Float[np.ndarray, "rate dimension"]
    places: Int[np.ndarray, "rate"]
    prior_mean: Float[np.ndarray, "dimension"]
    prior_sd: Float[np.ndarray, "dimension"]

    @classmethod
    def of(cls, tracks: Tracks, coordinates: Coordinates) -> "Rates":
        """The rates of a video."""
        found = list(_rates(tracks, coordinates))
        directions = np.zeros((len(found), len(coordinates)))
        for rate, (_, factors) in enumerate(found):
            directions[rate, factors] = 1.0
        places = np.array([place for place, _ in found], dtype=int)
        return cls(directions, places, coordinates.prior_mean, coordinates.prior_sd)

    @property
    def taken(self) -> Int[np.ndarray, "taken"]:
        """Coordinates that are factors of rates."""
        return np.flatnonzero(self.directions.any(axis=0))

    @property
    def others(self) -> Int[np.ndarray, "other"]:
        """All other coordinates."""
        return np.flatnonzero(~self.directions.any(axis=0))


def _rates(tracks: Tracks, coordinates: Coordinates) -> Iterator[tuple[int, list[int]]]:
    """Coordinate of each rate, and those of its factors."""
    own = {entry.owner for entry in coordinates.entries if entry.field == FRICTION_RATIO.name}
    shared = {_friction(tracks, body) for body in own if body is not None}
    for place, entry in enumerate(coordinates.entries):
        if entry.transform is not Transform.LOG or entry.field in NO_RATES or entry.field in shared:
            continue
        factors = [place]
        if entry.field == FRICTION_RATIO.name and entry.owner is not None:
            friction = coordinates.places.get((_friction(tracks, entry.owner), None))
            factors += [] if friction is None else [friction]
        yield place, factors


def _friction(tracks: Tracks, body: int) -> str:
    sphere = tracks.bodies[body].shape is Shape.SPHERE
    return ROLLING_RESISTANCE.name if sphere else SLIDING_FRICTION.name


@dataclass(frozen=True)
class Straightening:
    """A shear under which ridges in the logarithms of rates become straight.

    Parameters
    ----------
    centre
        The mode; the map leaves it, and its surroundings to first order, alone.
    directions
        Change of the logarithm of each rate per change of each coordinate.
    displacement
        What the other coordinates change by per relative change of each rate; nothing for the rates' own.
    """

    centre: Float[Tensor, "dimension"]
    directions: Float[Tensor, "rate dimension"]
    displacement: Float[Tensor, "rate dimension"]

    @classmethod
    def of(cls, mode: Mode, rates: Rates) -> "Straightening":
        """The shear of a mode: everything else follows a rate as it does to first order there."""
        displacement = np.zeros_like(rates.directions)
        displacement[:, rates.others] = _following(mode, rates, rates.places).T
        return cls(*(torch.from_numpy(part) for part in (mode.point.copy(), rates.directions, displacement)))

    def bent(self, points: Float[Tensor, "*batch dimension"]) -> Float[Tensor, "*batch dimension"]:
        """Points of the posterior that belong to points beside straight ridges; differentiable."""
        change = (points - self.centre) @ self.directions.T
        inside = change.clamp(max=LARGEST)
        return points + (torch.expm1(inside) - inside) @ self.displacement


def all_straightened(
    shears: Sequence[Straightening | None], points: Float[np.ndarray, "shear_or_one point dimension"]
) -> Float[np.ndarray, "shear point dimension"]:
    """The points of each of several shears along the same rates, straightened; None leaves them as they are.

    This is the inverse of `bent`: the shift depends on the rates alone, which it leaves as they are.
    """
    straight = np.broadcast_to(points, (len(shears), *points.shape[1:])).copy()
    known = [(index, shear) for index, shear in enumerate(shears) if shear is not None]
    if not known:
        return straight
    directions = known[0][1].directions.numpy()
    centres = np.stack([shear.centre.numpy() for _, shear in known]) @ directions.T
    displacement = np.stack([shear.displacement.numpy() for _, shear in known])
    moved = [index for index, _ in known]
    change = np.minimum((points if len(points) == 1 else points[moved]) @ directions.T - centres[:, None], LARGEST)
    straight[moved] -= np.matmul(np.expm1(change) - change, displacement)
    return straight


def straight_gaussian(mode: Mode, rates: Rates, generator: np.random.Generator, *, draws: int = DRAWS) -> Gaussian:
    """The Gaussian of a mode, as wide along the rates as the posterior of a linear dependence on them is.

    That posterior has a long tail towards small rates, of which the curvature at the mode knows nothing. It needs no
    simulation: its moments come from weighted draws of its few dimensions. The mode stays in the middle, where samplers
    look for it.
    """
    gaussian = Gaussian.from_precision(mode.point, mode.precision)
    taken, others = rates.taken, rates.others
    if not len(taken):
        return gaussian
    covariance = gaussian.root @ gaussian.root.T
    found = _moments(mode, rates, covariance[np.ix_(taken, taken)], generator, draws)
    if found is None:
        return gaussian
    spread, following, wide = ROOM**2 * found, _following(mode, rates, taken), covariance.copy()
    wide[np.ix_(taken, taken)] = spread
    wide[np.ix_(others, taken)] = following @ spread
    wide[np.ix_(taken, others)] = wide[np.ix_(others, taken)].T
    wide[np.ix_(others, others)] += following @ (spread - covariance[np.ix_(taken, taken)]) @ following.T
    return Gaussian(mode.point, _root(wide))


def _following(mode: Mode, rates: Rates, places: Int[np.ndarray, "place"]) -> Float[np.ndarray, "other place"]:
    """Change of the other coordinates per change of some, along which the density falls least."""
    scale = 1 / np.sqrt(np.diag(mode.precision)[rates.others])
    inner = scale[:, None] * mode.precision[np.ix_(rates.others, rates.others)] * scale
    outer = scale[:, None] * mode.precision[np.ix_(rates.others, places)]
    following: np.ndarray = -scale[:, None] * np.linalg.lstsq(inner, outer, rcond=1e-12)[0]
    return following


def _moments(
    mode: Mode,
    rates: Rates,
    covariance: Float[np.ndarray, "taken taken"],
    generator: np.random.Generator,
    count: int,
) -> Float[np.ndarray, "taken taken"] | None:
    """Second moments about the mode of the factors of rates; None where too few of the draws have weight."""
    taken, places = rates.taken, rates.places
    mean, sd = rates.prior_mean, rates.prior_sd
    following = _following(mode, rates, places)
    information = mode.precision[np.ix_(places, places)] + mode.precision[np.ix_(places, rates.others)] @ following
    information = information - np.diag(sd[places] ** -2)
    values, vectors = np.linalg.eigh((information + information.T) / 2)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    slope = (mode.point[places] - mean[places]) / sd[places] ** 2
    normal = generator.standard_normal((count, len(taken)))
    normal /= np.sqrt(generator.chisquare(TAILS, count) / TAILS)[:, None]
    drawn = mode.point[taken] + WIDER * normal @ _root(covariance).T
    change = np.expm1(np.minimum((drawn - mode.point[taken]) @ rates.directions[:, taken].T, LARGEST))
    log_density = change @ slope - ((change @ root) ** 2).sum(axis=1) / 2
    log_density -= (((drawn - mean[taken]) / sd[taken]) ** 2).sum(axis=1) / 2
    log_ratio = log_density + (TAILS + len(taken)) / 2 * np.log1p((normal**2).sum(axis=1) / TAILS)
    weights = np.exp(log_ratio - log_ratio.max())
    weights /= weights.sum()
    if 1 / (weights**2).sum() < FEWEST:
        return None
    moved = drawn - mode.point[taken]
    moments: np.ndarray = (moved * weights[:, None]).T @ moved
    return moments


def _root(covariance: Float[np.ndarray, "dimension dimension"]) -> Float[np.ndarray, "dimension dimension"]:
    """Lower-triangular root of a covariance that rounding may have left without a sure sign."""
    scale = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    _, triangle = np.linalg.qr((vectors * np.sqrt(np.maximum(values, 1e-12))).T)
    root: np.ndarray = scale[:, None] * (triangle * np.sign(np.diag(triangle))[:, None]).T
    return root

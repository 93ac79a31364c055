"""Proposals for cubes whose yaw nobody measured: a mosaic of clouds over the plane of the yaw and spin at a contact.

What a contact tells of a cube's yaw and spin lies on bent, broken islands, one for each way in which an edge or a
corner may have been hit; elsewhere on an island mass and restitution are others, too. No cloud around a mode covers
one. So yaw and spin are held at each knot of a lattice while all else is refitted; every refit gives a Gaussian that
also says how all else follows them, cut out to the size of its tile. Source: Rue, Martino and Chopin, Approximate
Bayesian inference for latent Gaussian models by using integrated nested Laplace approximations, J. Royal Statistical
Society B 71 (2009), whose lattice over few parameters this is; its Gaussians are only proposals here.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from scipy.special import logsumexp

from vrdp_prob.inference.curved_gaussian import CurvedGaussian
from vrdp_prob.inference.descent import Descent
from vrdp_prob.inference.hypothesis import QUARTER, owned
from vrdp_prob.inference.importance import Weighted, flattened, resampled
from vrdp_prob.inference.least_squares import Minimum
from vrdp_prob.inference.mixture import Mixture
from vrdp_prob.inference.mode import Mode
from vrdp_prob.inference.noise_fit import NOISE_FIELDS
from vrdp_prob.inference.plan import Optimiser
from vrdp_prob.inference.refinement import Refined, mode_at
from vrdp_prob.inference.samples import LogDensity, evaluate
from vrdp_prob.inference.straightening import Rates, Straightening, straight_gaussian
from vrdp_prob.inference.yaw_search import REACH, bodies_met, turned_worlds, unseen_yaws
from vrdp_prob.models.likelihood import Likelihood

YAWS, SPINS = 32, 12
"""Knots over a quarter turn, and over the prior of the spin."""
FIRST_ITERATIONS, HOPELESS = 4, 60.0
"""Steps of every knot in the coordinates of the cube and what it meets, and nats by which a knot may be worse then."""
THEN_ITERATIONS, PASSES = 6, 2
"""Steps in all coordinates, and times that a knot sets out anew from a better neighbour."""
BETTER = 1.0
"""Nats by which a neighbour is better."""
LEAST_EVIDENCE, MOST_TILES = 7.0, 120
"""Tiles whose evidence is more nats below the best one's are left out, and all but so many of the best."""
RATE_DRAWS = 4000
"""Draws from which the shape of a tile along rates is found."""
TRIALS, TRIAL_DRAWS = 3, 2000
"""Times that the tiles' weights are corrected by weighted draws, and how many."""
KEPT_WEIGHT = 0.5
"""Share of a tile's weight that a correction leaves as it was."""
EFFECTIVE = 60.0
"""Effective draws that weights are flattened to for a correction, and for the places to set out from."""
PLACES = 400


@dataclass(frozen=True)
class Jumps:
    """Proposals that reach every island, and places on them.

    Parameters
    ----------
    mixture
        The tiles.
    places
        Points in proportion to the posterior, as far as weighted draws tell.
    """

    mixture: Mixture
    places: Float[np.ndarray, "place dimension"]


def yaw_jumps(
    likelihood: Likelihood,
    point: Float[np.ndarray, "dimension"],
    rates: Rates,
    density: LogDensity,
    generator: np.random.Generator,
) -> Jumps | None:
    """Proposals for the yaws and spins of cubes that meet something; None where every yaw is measured or idle.

    Parameters
    ----------
    likelihood
        The density, of which the tiles are made.
    point
        Its maximum. Several cubes are turned one at a time.
    rates
        Rates of slowing down, along which tiles are straightened.
    density
        What is to be sampled.
    generator
        Source of the draws that correct the tiles' weights.
    """
    clouds: list[CurvedGaussian] = []
    log_weights: list[float] = []
    for body, frame in unseen_yaws(likelihood, point):
        tiles = _Lattice.around(likelihood, point, body, frame).tiles()
        if not tiles:
            continue
        best = max(tile.log_evidence for tile in tiles)
        tiles = sorted((tile for tile in tiles if tile.log_evidence > best - LEAST_EVIDENCE), key=_by_evidence)
        clouds += [_cloud(tile, rates) for tile in tiles[:MOST_TILES]]
        evidence = np.array([tile.log_evidence for tile in tiles[:MOST_TILES]])
        log_weights += list(evidence - logsumexp(evidence))
    if not clouds:
        return None
    return _corrected(Mixture.of(*clouds, log_weights=np.array(log_weights)), density, generator)


def _by_evidence(tile: Mode) -> float:
    return -tile.log_evidence


def _cloud(tile: Mode, rates: Rates) -> CurvedGaussian:
    gaussian = straight_gaussian(tile, rates, np.random.default_rng(0), draws=RATE_DRAWS)
    return CurvedGaussian.straight(gaussian, Straightening.of(tile, rates))


def _corrected(mixture: Mixture, density: LogDensity, generator: np.random.Generator) -> Jumps:
    """The tiles weighted by what draws from them say, since the evidence of a Gaussian is a guess."""
    for _ in range(TRIALS):
        drawn = Weighted.drawn(density, mixture, TRIAL_DRAWS, generator, lambda _worlds: None)
        weights = flattened(drawn.log_ratio, EFFECTIVE)
        shares = mixture.memberships(drawn.points).T @ weights
        mixture = Mixture.of(
            *mixture.components, log_weights=np.log(KEPT_WEIGHT * mixture.weights + (1 - KEPT_WEIGHT) * shares)
        )
    return Jumps(mixture, drawn.points[resampled(weights, PLACES, generator)])


@dataclass
class _Lattice:
    """Knots over the plane of a cube's yaw in the frame before its first contact, and its release spin.

    Parameters
    ----------
    likelihood
        The density.
    body
        The cube.
    turning
        Change of that yaw per change of the release spin (s).
    starts
        Worlds at the knots before anything else has followed, knots of one spin after one another.
    met
        The cube and all that it meets.
    """

    likelihood: Likelihood
    body: int
    turning: float
    starts: Float[np.ndarray, "knot dimension"]
    met: frozenset[int]

    @classmethod
    def around(cls, likelihood: Likelihood, point: Float[np.ndarray, "dimension"], body: int, frame: int) -> "_Lattice":
        """The lattice of a cube, all else as it is at a point."""
        starts = turned_worlds(likelihood, point, body, frame, spins=SPINS, yaws=YAWS)
        spin = likelihood.coordinates.places.get(("spin", body))
        turning = 0.0
        if spin is not None:
            ends = starts[[0, -1]]
            with torch.no_grad():
                angles = likelihood.rollout(torch.from_numpy(ends)).trajectory[:, frame, body, 2].numpy()
            yaw = likelihood.coordinates.places["angle", body]
            turning = float(np.diff(angles - ends[:, yaw])[0] / np.diff(ends[:, spin])[0])
        return cls(likelihood, body, turning, starts, bodies_met(likelihood, point, body))

    @property
    def _held(self) -> list[int]:
        """Coordinates that a knot holds."""
        places = self.likelihood.coordinates.places
        return [places[name, self.body] for name in ("angle", "spin") if (name, self.body) in places]

    def tiles(self) -> list[Mode]:
        """A Gaussian for every knot that is not without hope."""
        knots = self._refitted()
        finite = [one for one in knots if one is not None and np.isfinite(one.cost)]
        if not finite:
            return []
        values = evaluate(self.likelihood.log_density, np.array([one.point for one in finite]))
        modes = [
            mode_at(self.likelihood, Refined(one.point, float(value), one.converged, 0))
            for one, value in zip(finite, values, strict=True)
            if value > values.max() - 2 * LEAST_EVIDENCE
        ]
        return [Mode(mode.point, mode.precision + self._size, mode.log_density) for mode in modes]

    @property
    def _size(self) -> Float[np.ndarray, "dimension dimension"]:
        """Precision that cuts a Gaussian out to the size of a tile."""
        coordinates = self.likelihood.coordinates
        across = np.zeros((2, len(coordinates)))
        yaw, *spin = self._held
        across[0, [yaw, *spin]] = np.array([1.0, self.turning])[: 1 + len(spin)] / (QUARTER / YAWS)
        across[1, spin] = (SPINS - 1) / (2 * REACH * coordinates.prior_sd[spin])
        return across.T @ across

    def _refitted(self) -> list[Minimum | None]:
        """What becomes of all else at each knot; None where it is without hope."""
        coordinates = self.likelihood.coordinates
        descent = Descent(self.likelihood, Optimiser.GAUSS_NEWTON)
        held = self._held
        free = ~coordinates.mask(NOISE_FIELDS)
        free[held] = False
        first = descent(self.starts, owned(coordinates, self.met) & free, iterations=FIRST_ITERATIONS)
        best = min(one.cost for one in first)
        hopeful = [k for k, one in enumerate(first) if one.cost < best + HOPELESS]
        knots: list[Minimum | None] = [None] * len(first)
        for k, one in zip(hopeful, self._refits(descent, [first[k].point for k in hopeful], free), strict=True):
            knots[k] = one
        for _ in range(PASSES):
            again = list(self._from_neighbours(knots))
            points = []
            for k, neighbour in again:
                point = neighbour.point.copy()
                point[held] = self.starts[k][held]
                points.append(point)
            for (k, _neighbour), one in zip(again, self._refits(descent, points, free), strict=True):
                present = knots[k]
                if present is None or one.cost < present.cost:
                    knots[k] = one
        return knots

    @staticmethod
    def _refits(descent: Descent, points: list[np.ndarray], free: np.ndarray) -> list[Minimum]:
        return descent(np.array(points), free, iterations=THEN_ITERATIONS) if points else []

    @staticmethod
    def _from_neighbours(knots: list[Minimum | None]) -> Iterator[tuple[int, Minimum]]:
        """Knots with a much better neighbour, and that neighbour; the lattice closes along the yaw."""
        costs = np.array([np.inf if one is None else one.cost for one in knots]).reshape(-1, YAWS)
        for row, column in np.ndindex(costs.shape):
            around = [
                ((row + down) * YAWS + (column + right) % YAWS)
                for down in (-1, 0, 1)
                for right in (-1, 0, 1)
                if (down or right) and 0 <= row + down < len(costs)
            ]
            best = min(around, key=lambda k: costs.flat[k])
            neighbour = knots[best]
            near = costs.flat[best] < min(costs[row, column] - BETTER, costs.min() + 2 * LEAST_EVIDENCE)
            if neighbour is not None and near:
                yield row * YAWS + column, neighbour

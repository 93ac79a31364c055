"""Proposals for cubes whose yaw nobody measured: a mosaic of clouds over the plane of the yaw and spin at a contact.

What a contact tells of a cube's yaw and spin lies on bent, broken islands, one for each way in which an edge or a
corner may have been hit; elsewhere on an island mass and restitution are others, too. No cloud around a mode covers
one. So yaw and spin are held at each knot of a lattice while all else is refitted; every refit gives a Gaussian that
also says how all else follows them, cut out to the size of its tile. Source: Rue, Martino and Chopin, Approximate
Bayesian inference for latent Gaussian models by using integrated nested Laplace approximations, J. Royal Statistical
Society B 71 (2009), whose lattice over few parameters this is; its Gaussians are only proposals here.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float
from scipy.special import logsumexp

from vrdp_prob.inference.draws.mode import Mode
from vrdp_prob.inference.draws.samples import LogDensity, evaluate, evaluate_with_gradient
from vrdp_prob.inference.samplers.curved_gaussian import CurvedGaussian
from vrdp_prob.inference.samplers.importance import Weighted, flattened, resampled
from vrdp_prob.inference.samplers.mixture import Jumps, Mixture
from vrdp_prob.inference.samplers.straightening import Rates, Straightening, straight_gaussian
from vrdp_prob.inference.search.descent import Descent
from vrdp_prob.inference.search.hypothesis import QUARTER, owned
from vrdp_prob.inference.search.least_squares import Minimum
from vrdp_prob.inference.search.noise_fit import NOISE_FIELDS
from vrdp_prob.inference.search.plan import Optimiser
from vrdp_prob.inference.search.refinement import Refined, mode_at
from vrdp_prob.inference.search.yaw_search import AFTER, REACH, bodies_met, turned_worlds, unseen_yaws
from vrdp_prob.models.likelihood import Likelihood

KNOTS, FEWER_KNOTS = (32, 12), (24, 8)
"""Knots over a quarter turn and over the prior of the spin, for one cube and for each of several."""
MOST_CUBES = 2
"""Where more of them are hit, tiles of one at a time reach next to nothing, and take minutes to make."""
FIRST_ITERATIONS, HOPELESS = 4, 60.0
"""Steps of every knot on the frames around the first contact, and nats by which a knot may be worse then."""
THEN_ITERATIONS, PASSES = 6, 2
"""Steps on all frames, and times that a knot sets out anew from a better neighbour."""
LAST_ITERATIONS = 2
"""Steps in all coordinates; those before are in what all share and what the cube and those that it meets have."""
BETTER = 1.0
"""Nats by which a neighbour is better."""
LEAST_EVIDENCE, MOST_TILES = 7.0, 120
"""Tiles whose evidence is more nats below the best one's are left out, and all but so many of the best of all cubes."""
MOVES, WORTH_MOVING, FARTHEST = 2, 0.5, 0.5
"""Times that tiles move to where the posterior within them is largest, twice the gain (nats) that is worth it, and the
distance, in knots, that they move at most each time."""
RATE_DRAWS = 4000
"""Draws from which the shape of a tile along rates is found."""
TRIALS, TRIAL_DRAWS = 3, 2000
"""Times that the tiles' weights are corrected by weighted draws, and how many."""
KEPT_WEIGHT = 0.5
"""Share of a tile's weight that a correction leaves as it was."""
EFFECTIVE = 60.0
"""Effective draws that weights are flattened to for a correction, and for the places to set out from."""
PLACES = 400


def yaw_jumps(
    likelihood: Likelihood,
    point: Float[np.ndarray, "dimension"],
    rates: Rates,
    generator: np.random.Generator,
) -> Jumps | None:
    """Proposals for the yaws and spins of cubes that meet something; None where every yaw is measured or idle.

    Nor are there any where more than two such cubes are hit; see `yaws_left_out`.

    Parameters
    ----------
    likelihood
        The density.
    point
        Its maximum. Several cubes are turned one at a time.
    rates
        Rates of slowing down, along which tiles are straightened.
    generator
        Source of the draws that correct the tiles' weights.
    """
    clouds: list[CurvedGaussian] = []
    log_weights: list[float] = []
    cubes = [] if yaws_left_out(likelihood, point) else list(unseen_yaws(likelihood, point))
    for body, frame in cubes:
        knots = KNOTS if len(cubes) == 1 else FEWER_KNOTS
        tiles = _Lattice.around(likelihood, point, body, frame, knots).tiles(MOST_TILES // len(cubes))
        evidence = np.array([tile.log_evidence for tile in tiles])
        chosen = np.flatnonzero(evidence > evidence.max(initial=-np.inf) - LEAST_EVIDENCE)
        clouds += [_cloud(tiles[index], rates) for index in chosen]
        log_weights += list(evidence[chosen] - logsumexp(evidence[chosen]))
    if not clouds:
        return None
    return _corrected(Mixture.of(*clouds, log_weights=np.array(log_weights)), likelihood.log_density, generator)


def yaws_left_out(likelihood: Likelihood, point: Float[np.ndarray, "dimension"]) -> tuple[int, ...]:
    """Cubes that meet something and whose yaw nobody measured, where they are too many for proposals of their own.

    Parameters
    ----------
    likelihood
        The density.
    point
        Its maximum.
    """
    cubes = tuple(body for body, _ in unseen_yaws(likelihood, point))
    return cubes if len(cubes) > MOST_CUBES else ()


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
    frame
        That frame.
    knots
        Number of yaws and of spins; a cube that rests before its first contact has one spin.
    turning
        Change of that yaw per change of the release spin (s).
    starts
        Worlds at the knots before anything else has followed, knots of one spin after one another.
    met
        The cube and all that it meets.
    """

    likelihood: Likelihood
    body: int
    frame: int
    knots: tuple[int, int]
    turning: float
    starts: Float[np.ndarray, "knot dimension"]
    met: frozenset[int]

    @classmethod
    def around(
        cls,
        likelihood: Likelihood,
        point: Float[np.ndarray, "dimension"],
        body: int,
        frame: int,
        knots: tuple[int, int],
    ) -> "_Lattice":
        """The lattice of a cube, all else as it is at a point."""
        yaws, spins = knots
        starts = turned_worlds(likelihood, point, body, frame, spins=spins, yaws=yaws)
        spin = likelihood.coordinates.places.get(("spin", body))
        turning = 0.0
        if spin is not None:
            ends = starts[[0, -1]]
            with torch.no_grad():
                angles = likelihood.rollout(torch.from_numpy(ends)).trajectory[:, frame, body, 2].numpy()
            yaw = likelihood.coordinates.places["angle", body]
            turning = float(np.diff(angles - ends[:, yaw])[0] / np.diff(ends[:, spin])[0])
        return cls(likelihood, body, frame, knots, turning, starts, bodies_met(likelihood, point, body))

    @property
    def _held(self) -> list[int]:
        """Coordinates that a knot holds."""
        places = self.likelihood.coordinates.places
        return [places[name, self.body] for name in ("angle", "spin") if (name, self.body) in places]

    def tiles(self, most: int) -> list[Mode]:
        """A Gaussian for every knot that is not without hope, of so many of the best."""
        finite = sorted((one for one in self._refitted() if np.isfinite(one.cost)), key=lambda one: one.cost)
        near = [one.point for one in finite[:most] if one.cost < finite[0].cost + 2 * LEAST_EVIDENCE]
        if not near:
            return []
        modes = self._modes(np.array(near))
        for _ in range(MOVES if modes else 0):
            modes = self._moved(modes)
        return modes

    def _modes(self, points: Float[np.ndarray, "tile dimension"]) -> list[Mode]:
        """A Gaussian the size of a tile for each point, after all else has followed what is held there."""
        last = self._descent(points, self._free, iterations=LAST_ITERATIONS)
        values = evaluate(self.likelihood.log_density, np.array([one.point for one in last]))
        modes = [
            mode_at(self.likelihood, Refined(one.point, float(value), one.converged, 0))
            for one, value in zip(last, values, strict=True)
            if np.isfinite(value)
        ]
        return [Mode(mode.point, mode.precision + self._across.T @ self._across, mode.log_density) for mode in modes]

    def _moved(self, modes: Sequence[Mode]) -> list[Mode]:
        """Tiles moved to where the posterior within them is largest: an island may be far finer than the lattice."""
        points = np.array([mode.point for mode in modes])
        _, gradients = evaluate_with_gradient(self.likelihood.log_density, points)
        shifts = np.array(
            [np.linalg.solve(one.precision, gradient) for one, gradient in zip(modes, gradients, strict=True)]
        )
        far = np.einsum("td,td->t", gradients, shifts) > WORTH_MOVING
        if not far.any():
            return list(modes)
        lengths = np.linalg.norm(shifts @ self._across.T, axis=1)
        shifts *= np.minimum(1.0, FARTHEST / np.maximum(lengths, 1e-12))[:, None]
        moved = self._modes((points + shifts)[far])
        return [mode for mode, moves in zip(modes, far, strict=True) if not moves] + moved

    @property
    def _descent(self) -> Descent:
        # whatever found the maximum: hundreds of knots go down in one batch, and make proposals, no result
        return Descent(self.likelihood, Optimiser.GAUSS_NEWTON)

    @property
    def _free(self) -> Bool[np.ndarray, "dimension"]:
        """Coordinates that follow."""
        free = ~self.likelihood.coordinates.mask(NOISE_FIELDS)
        free[self._held] = False
        return free

    @property
    def _across(self) -> Float[np.ndarray, "2 dimension"]:
        """Change of the place on the lattice, in knots, per change of the coordinates."""
        coordinates = self.likelihood.coordinates
        across = np.zeros((2, len(coordinates)))
        yaw, *spin = self._held
        across[0, [yaw, *spin]] = np.array([1.0, self.turning])[: 1 + len(spin)] * self.knots[0] / QUARTER
        across[1, spin] = (self.knots[1] - 1) / (2 * REACH * coordinates.prior_sd[spin])
        return across

    def _refitted(self) -> list[Minimum]:
        """What becomes of all else at each knot that is not without hope."""
        coordinates = self.likelihood.coordinates
        held = self._held
        shared = np.array([entry.owner is None for entry in coordinates.entries])
        local = (owned(coordinates, self.met) | shared) & self._free
        until = min(self.frame + AFTER, len(self.likelihood.tracks.times))
        first = self._descent(self.starts, local, frame_count=until, iterations=FIRST_ITERATIONS)
        best = min(one.cost for one in first)
        setting_out = [(k, one.point) for k, one in enumerate(first) if one.cost < best + HOPELESS]
        knots: dict[int, Minimum] = {}
        for _ in range(1 + PASSES):
            if not setting_out:
                break
            points = np.array([point for _, point in setting_out])
            for (k, _), one in zip(setting_out, self._descent(points, local, iterations=THEN_ITERATIONS), strict=True):
                if k not in knots or one.cost < knots[k].cost:
                    knots[k] = one
            setting_out = []
            for k, neighbour in self._from_neighbours(knots):
                point = neighbour.point.copy()
                point[held] = self.starts[k][held]
                setting_out.append((k, point))
        return list(knots.values())

    def _from_neighbours(self, knots: Mapping[int, Minimum]) -> Iterator[tuple[int, Minimum]]:
        """Knots with a much better neighbour, and that neighbour; the lattice closes along the yaw."""
        yaws = self.knots[0]
        costs = np.full((len(self.starts) // yaws, yaws), np.inf)
        for k, one in knots.items():
            costs.flat[k] = one.cost
        for row, column in np.ndindex(costs.shape):
            around = [
                ((row + down) * yaws + (column + right) % yaws)
                for down in (-1, 0, 1)
                for right in (-1, 0, 1)
                if (down or right) and 0 <= row + down < len(costs)
            ]
            best = min(around, key=lambda k: costs.flat[k])
            if costs.flat[best] < min(costs[row, column] - BETTER, costs.min() + 2 * LEAST_EVIDENCE):
                yield row * yaws + column, knots[best]

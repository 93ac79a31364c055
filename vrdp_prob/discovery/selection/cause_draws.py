"""Draws of what all videos share of a cause whose density is no Gaussian: it bends, or ends at edges.

The border of a patch lies between where bodies are slowed and where they are not; a restitution that begins to fall at
slower impacts falls less. Walkers move in the cause's own numbers, which all others follow. Sources: Goodman and Weare,
Ensemble samplers with affine invariance, Comm. App. Math. Comp. Sci. 5 (2010), and ter Braak, A Markov chain Monte
Carlo version of the genetic algorithm differential evolution, Stat. Comput. 16 (2006), for their moves; Foreman-Mackey
and others, emcee: the MCMC hammer, PASP 125 (2013).
"""

from collections.abc import Callable
from dataclasses import dataclass

import emcee
import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.random import RandomState
from scipy.linalg import qr, solve_triangular

from vrdp_prob.inference.draws.triangles import lower_root
from vrdp_prob.inference.runs.parallel import in_parallel
from vrdp_prob.inference.search.least_squares import jacobian, robust_cost
from vrdp_prob.inference.search.noise_fit import NOISE_FIELDS
from vrdp_prob.inference.several_videos.arrow import grown
from vrdp_prob.inference.several_videos.bends import spread
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.inference.several_videos.joint_fit import JointFit, settle
from vrdp_prob.inference.several_videos.linking import LinkedVideo
from vrdp_prob.models.effects.effect import Effect

PROBES, ROUGH = 64, 2.0
"""Draws of the Gaussian by which it is judged, and the range (nats) of the middle 80 % of log ratios of density and
Gaussian from which on it is none."""
WALKERS, STEPS = 32, 100
"""Walkers, or four per number if that is more, and their steps between two looks at how far they have spread..."""
SPREAD_BY = 1.2
"""...which have to agree within this factor..."""
FEWEST, LOOKS = 3, 8
"""...and are so many at least, of which the first counts for nothing, and at most. A ridge of eight times the length of
the Gaussian at its top is found to be a tenth too short then."""
BEGINNING = 0.5
"""Standard deviations of the Gaussian by which walkers are spread when they set out."""
SIDE, FAR = 2.0, 8.0
"""A Gaussian is far too wide where so many of its standard deviations away, along its longest axis, so many nats have
gone on both sides though each video's own numbers are at their best."""


@dataclass(frozen=True)
class CauseDraws:
    """Draws of a cause's shared numbers.

    Parameters
    ----------
    places
        Which of the shared numbers they are.
    coordinates
        Their coordinates.
    instead
        Whether the Gaussian is far too wide for them, and tells nothing beside them.
    """

    places: Int[np.ndarray, "number"]
    coordinates: Float[np.ndarray, "draw number"]
    instead: bool


def cause_draws(fit: SharedFit, effect: Effect, sd: Float[np.ndarray, "shared"]) -> CauseDraws | None:
    """Draws of what videos share of an effect; None where it has strengths alone, or the Gaussian says it all.

    Parameters
    ----------
    fit
        Fit of a model with the effect.
    effect
        The effect.
    sd
        Standard deviations of all shared numbers, with what makes them larger than the likelihood says.
    """
    names = {one.name for one in effect.parameters}
    places = np.array([place for place, (name, _) in enumerate(fit.joint.numbers.keys) if name in names], dtype=int)
    others = {fit.joint.numbers.keys[place][0] for place in places} - {*effect.vanishes_at, *effect.vanishes_like}
    if not others:
        return None
    widening = float(np.sqrt(np.mean((sd / fit.joint.gaussian.sd)[places] ** 2)))
    subspace = _Subspace.of(fit.joint, places, widening)
    generator = np.random.default_rng(0)
    probes = generator.standard_normal((PROBES, len(places)))
    if spread(subspace.log_density(probes) + (probes**2).sum(axis=1) / 2) < ROUGH:
        return None
    walked = walk(subspace.log_density, len(places), generator)
    return None if walked is None else CauseDraws(places, subspace.coordinates(walked), subspace.falls_far())


@dataclass(frozen=True)
class _Follower:
    """A video's own numbers as they follow the shared ones: in straight lines, and then by a step along a chord.

    That step takes up what the residuals leave as their derivative at the top says, as Newton's method does with a
    derivative that is not renewed. Noise scales stay.

    Parameters
    ----------
    video, centre
        The video, and its own numbers at the top.
    slope
        How they go with a departure of the shared ones.
    logarithms
        Which shared numbers are logarithms.
    places
        Places of the own numbers that follow.
    orthogonal, triangle
        Factors of the residuals' derivative by these.
    """

    video: LinkedVideo
    centre: Float[np.ndarray, "local"]
    slope: Float[np.ndarray, "local shared"]
    logarithms: Bool[np.ndarray, "shared"]
    places: Int[np.ndarray, "own"]
    orthogonal: Float[np.ndarray, "residual own"]
    triangle: Float[np.ndarray, "own own"]

    @classmethod
    def of(cls, joint: JointFit, index: int) -> "_Follower":
        video, own = joint.videos[index], joint.gaussian.locals[index]
        noise = video.likelihood.coordinates.mask(NOISE_FIELDS)
        scale = video.data.coordinates.scale
        _, derivative = jacobian(video.data.residuals, joint.point(index), scale, central=True)
        places = video.local_places[~noise[video.local_places] & derivative[:, video.local_places].any(axis=0)]
        orthogonal, triangle = qr(derivative[:, places], mode="economic", check_finite=False)
        slope = np.where(noise[video.local_places, None], 0.0, own.slope)
        return cls(video, own.centre, slope, own.logarithms, places, orthogonal, triangle)

    def log_density(
        self, shared: Float[np.ndarray, "draw shared"], departure: Float[np.ndarray, "draw shared"], *, settled: bool
    ) -> Float[np.ndarray, "draw"]:
        """Log density (nats, up to a constant) of the video; minus infinity where there is no world."""
        follows = self.centre + grown(departure, self.logarithms) @ self.slope.T
        if settled:
            pairs = zip(shared, follows, strict=True)
            follows = np.stack([settle(self.video, numbers, [own]) for numbers, own in pairs])
        points = np.stack([self.video.points(*one) for one in zip(shared, follows, strict=True)])
        residuals = self.video.data.residuals(points)
        found = -robust_cost(residuals, None)
        if settled:
            return found
        world = np.isfinite(found)
        points[np.ix_(world, self.places)] -= solve_triangular(
            self.triangle, self.orthogonal.T @ residuals[world].T, check_finite=False
        ).T
        return np.maximum(found, -robust_cost(self.video.data.residuals(points), None))


@dataclass(frozen=True)
class _Subspace:
    """Some shared numbers of a joint fit, which all others follow, in units of its Gaussian there.

    Parameters
    ----------
    joint
        The fit.
    places
        Which numbers.
    root
        Cholesky factor of their covariance.
    slope
        How all shared numbers go with them; noise scales stay.
    widening
        Factor by which standard deviations are larger than the likelihood says, which tempers it.
    followers
        The videos.
    """

    joint: JointFit
    places: Int[np.ndarray, "number"]
    root: Float[np.ndarray, "number number"]
    slope: Float[np.ndarray, "shared number"]
    widening: float
    followers: tuple[_Follower, ...]

    @classmethod
    def of(cls, joint: JointFit, places: Int[np.ndarray, "number"], widening: float) -> "_Subspace":
        rows = joint.gaussian.root[places]
        root = lower_root(rows)
        slope = np.linalg.solve(root.T, np.linalg.solve(root, rows @ joint.gaussian.root.T)).T
        slope[[name in NOISE_FIELDS for name, _ in joint.numbers.keys]] = 0.0
        followers = in_parallel(lambda index: _Follower.of(joint, index), range(len(joint.videos)))
        return cls(joint, places, widening * root, slope, widening, tuple(followers))

    def coordinates(self, whitened: Float[np.ndarray, "draw number"]) -> Float[np.ndarray, "draw number"]:
        found: np.ndarray = self.joint.gaussian.mean[self.places] + whitened @ self.root.T
        return found

    def log_density(
        self, whitened: Float[np.ndarray, "draw number"], *, settled: bool = False
    ) -> Float[np.ndarray, "draw"]:
        """Log density (nats) beyond that of the top; very low where there is no world."""
        departure = np.concatenate([np.zeros_like(whitened[:1]), whitened]) @ self.root.T @ self.slope.T
        shared = self.joint.gaussian.mean + departure
        told = in_parallel(lambda one: one.log_density(shared, departure, settled=settled), self.followers)
        values = sum(told) / self.widening**2 + self.joint.numbers.log_prior(shared)
        return np.maximum(values[1:] - values[0], -1e300)

    def falls_far(self) -> bool:
        """Whether the Gaussian is far too wide."""
        longest = np.linalg.svd(self.root)[2][:1]
        sides = self.log_density(SIDE * np.concatenate([-longest, longest]), settled=True)
        return bool((sides < -FAR).all())


def walk(
    log_density: Callable[[Float[np.ndarray, "draw number"]], np.ndarray],
    dimension: int,
    generator: np.random.Generator,
) -> Float[np.ndarray, "draw number"] | None:
    """Draws of a density whose top is at the origin; None where walkers find no place near it to set out from.

    Parameters
    ----------
    log_density
        Log density (nats) beyond that of the top.
    dimension
        Number of coordinates, each of about the size of 1.
    generator
        Of what is drawn.
    """
    beginnings, size = np.empty((0, dimension)), BEGINNING
    walkers = max(WALKERS, 4 * dimension)
    for _ in range(LOOKS):
        tried = size * generator.standard_normal((walkers, dimension))
        beginnings = np.concatenate([beginnings, tried[log_density(tried) > -FAR]])
        size /= 2
    if len(beginnings) < walkers:
        return None
    sampler = emcee.EnsembleSampler(
        walkers,
        dimension,
        log_density,
        moves=[(emcee.moves.StretchMove(), 0.5), (emcee.moves.DEMove(), 0.4), (emcee.moves.DEMove(gamma0=1.0), 0.1)],
        vectorize=True,
    )
    seed = int(generator.integers(2**31))
    state = emcee.State(beginnings[:walkers], random_state=RandomState(seed).get_state())
    before = np.full(dimension, np.inf)
    for look in range(1, LOOKS + 1):
        state = sampler.run_mcmc(state, STEPS)
        last = sampler.get_chain()[-STEPS:].reshape(-1, dimension)
        now = last.std(axis=0)
        if look >= FEWEST and (now < SPREAD_BY * before).all() and (before < SPREAD_BY * now).all():
            break
        before = now
    found: np.ndarray = sampler.get_chain(discard=STEPS, flat=True)
    return found

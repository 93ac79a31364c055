"""Draws of what all videos share of a cause whose density is no Gaussian: it bends, or ends at edges.

The border of a patch lies between where bodies are slowed and where they are not; a restitution that begins to fall at
slower impacts falls less. Walkers move in the cause's own numbers, all others follow as the Gaussian of the joint fit
says. Source: Goodman and Weare, Ensemble samplers with affine invariance (2010), and Nelson et al., RUN DMC (2014), for
the moves; Foreman-Mackey et al., emcee: the MCMC hammer (2013).
"""

from collections.abc import Callable
from dataclasses import dataclass

import emcee
import numpy as np
from jaxtyping import Float, Int
from numpy.random import RandomState

from vrdp_prob.inference.draws.triangles import lower_root
from vrdp_prob.inference.runs.parallel import in_parallel
from vrdp_prob.inference.several_videos.arrow import grown
from vrdp_prob.inference.several_videos.bends import spread
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.inference.several_videos.joint_fit import JointFit, settle
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
        How all shared numbers go with them.
    widening
        Factor by which standard deviations are larger than the likelihood says, which tempers it.
    """

    joint: JointFit
    places: Int[np.ndarray, "number"]
    root: Float[np.ndarray, "number number"]
    slope: Float[np.ndarray, "shared number"]
    widening: float

    @classmethod
    def of(cls, joint: JointFit, places: Int[np.ndarray, "number"], widening: float) -> "_Subspace":
        rows = joint.gaussian.root[places]
        root = lower_root(rows)
        slope = np.linalg.solve(root.T, np.linalg.solve(root, rows @ joint.gaussian.root.T)).T
        return cls(joint, places, widening * root, slope, widening)

    def coordinates(self, whitened: Float[np.ndarray, "draw number"]) -> Float[np.ndarray, "draw number"]:
        found: np.ndarray = self.joint.gaussian.mean[self.places] + whitened @ self.root.T
        return found

    def log_density(self, whitened: Float[np.ndarray, "draw number"], *, settled: bool = False) -> np.ndarray:
        """Log density (nats) beyond that of the top; very low where there is no world."""
        departure = np.concatenate([np.zeros_like(whitened[:1]), whitened]) @ self.root.T @ self.slope.T
        shared = self.joint.gaussian.mean + departure

        def told(index: int) -> Float[np.ndarray, "draw"]:
            video, own = self.joint.videos[index], self.joint.gaussian.locals[index]
            follows = own.centre + grown(departure, own.logarithms) @ own.slope.T
            if settled:
                follows = np.stack([settle(video, one, [start]) for one, start in zip(shared, follows, strict=True)])
            return np.nan_to_num(video.log_density(shared, follows), nan=-np.inf)

        values = sum(in_parallel(told, range(len(self.joint.videos)))) / self.widening**2
        values = values + self.joint.numbers.log_prior(shared)
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

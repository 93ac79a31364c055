from collections.abc import Callable

import numpy as np
import pytest
import torch
from scipy.stats import truncnorm

from tests.inference.densities import Needle, TwoModes
from vrdp_prob.inference.draws.samples import Gaussian, Samples, assess
from vrdp_prob.inference.emcee_sampler import sample_emcee
from vrdp_prob.inference.laplace import sample_laplace
from vrdp_prob.inference.nuts_sampler import CHAINS, CHUNK, RESULTS, sample_nuts
from vrdp_prob.inference.samplers.curved_gaussian import CurvedGaussian
from vrdp_prob.inference.samplers.mixture import Mixture

SAMPLERS = {"emcee": sample_emcee, "nuts": sample_nuts, "laplace": sample_laplace}
DIMENSION = 6
FEW = {"emcee": {"most_steps": 4}, "nuts": {"warm_up": 5, "most_gradients": 1, "processes": 1}, "laplace": {}}
"""Options that make a sampler stop soon."""


class SkewedRidge:
    """A correlated density with one skewed coordinate whose moments are known: a log-gamma times a Gaussian."""

    def __init__(self) -> None:
        generator = np.random.default_rng(5)
        self.root = np.tril(generator.standard_normal((DIMENSION, DIMENSION))) + 2 * np.eye(DIMENSION)
        self._inverse = torch.from_numpy(np.linalg.inv(self.root))

    def __call__(self, points: torch.Tensor) -> torch.Tensor:
        z = points @ self._inverse.T
        return (4 * z[:, 0] - 4 * z[:, 0].exp()) - (z[:, 1:] ** 2).sum(dim=1) / 2

    @property
    def mean(self) -> np.ndarray:
        """Exact mean: that of log Gamma(4, 4) in the first coordinate."""
        digamma = 1.2561176684318003
        return self.root[:, 0] * (digamma - np.log(4))

    @property
    def start(self) -> Mixture:
        scales = np.array([0.5] + [1.0] * (DIMENSION - 1))
        return Mixture.of(CurvedGaussian.straight(Gaussian(np.zeros(DIMENSION), self.root * scales)))


@pytest.mark.slow
def test_walkers_that_cannot_move_leave_draws_that_are_not_trusted() -> None:
    samples = sample_laplace(Needle(), Needle().start, draws=400, generator=np.random.default_rng(0))
    assert np.isfinite(samples.points).all()
    assert not assess("laplace", samples).converged


@pytest.mark.parametrize("name", SAMPLERS)
def test_a_sampler_hits_the_known_mean_within_its_own_error(name: str) -> None:
    target = SkewedRidge()
    samples = SAMPLERS[name](target, target.start, draws=1200, generator=np.random.default_rng(1))
    convergence = assess(name, samples)
    assert convergence.ess_bulk is not None
    assert convergence.ess_bulk > 300, f"too few effective draws to compare: {convergence.sentence}"
    draws = samples.points.reshape(-1, DIMENSION)
    effective = min(convergence.ess_bulk, len(draws))
    error = draws.std(axis=0) / np.sqrt(effective)
    assert np.abs(draws.mean(axis=0) - target.mean).max() < 4.5 * error.max()
    exact_sd = np.sqrt(0.2838229557371153 * target.root[:, 0] ** 2 + (target.root[:, 1:] ** 2).sum(axis=1))
    assert draws.std(axis=0) == pytest.approx(exact_sd, rel=0.12)


@pytest.mark.parametrize("name", SAMPLERS)
def test_the_same_seed_gives_the_same_draws(name: str) -> None:
    target = SkewedRidge()

    def draw(sampler: Callable[..., Samples]) -> np.ndarray:
        return sampler(target, target.start, draws=40, generator=np.random.default_rng(3), **FEW[name]).points

    assert (draw(SAMPLERS[name]) == draw(SAMPLERS[name])).all()


def test_chains_at_different_places_are_not_called_converged() -> None:
    generator = np.random.default_rng(0)
    points = generator.standard_normal((4, 500, 2)) + 5 * np.arange(4)[:, None, None]
    convergence = assess("emcee", Samples(points, np.zeros((4, 500))))
    assert not convergence.converged
    assert "has not converged" in convergence.sentence


def test_chains_in_processes_of_their_own_are_those_made_here() -> None:
    target = TwoModes(0.5, dimension=2)
    options = {"warm_up": 5, "most_gradients": 1, "draws": 40}
    here, there = (
        sample_nuts(target, target.start, generator=np.random.default_rng(3), processes=count, **options)
        for count in (1, 2)
    )
    assert (here.points == there.points).all()
    assert here.gradients == there.gradients


def test_a_density_that_cannot_be_sent_is_sampled_here() -> None:
    target = TwoModes(1.0, dimension=2)
    start = Mixture.of(target.start.components[0])
    options = {"warm_up": 5, "most_gradients": 1, "draws": 40, "processes": 2}

    def within(points: torch.Tensor) -> torch.Tensor:
        return target(points)

    samples = sample_nuts(within, start, generator=np.random.default_rng(3), **options)
    assert samples.points.shape == (RESULTS, CHAINS // RESULTS * CHUNK, 2)


WALL, MOST = 1.5, 20_000


class Walled:
    """A standard normal density in two dimensions that falls off behind x = 1.5, where another course begins."""

    def __call__(self, points: torch.Tensor) -> torch.Tensor:
        return -(points**2).sum(dim=1) / 2 - 1e6 * (points[:, 0] - WALL).clamp(min=0.0)

    @staticmethod
    def courses(points: torch.Tensor) -> list[bool]:
        return [bool(x > WALL) for x in points[:, 0]]


def walled(courses: Callable[[torch.Tensor], list[bool]] | None) -> Samples:
    start = Mixture.of(CurvedGaussian.straight(Gaussian(np.zeros(2), np.eye(2))))
    generator = np.random.default_rng(2)
    return sample_nuts(
        Walled(), start, generator=generator, courses=courses, draws=400, processes=1, most_gradients=MOST
    )


@pytest.mark.slow
def test_ends_behind_a_change_of_course_are_told_from_other_divergences_for_which_steps_are_halved() -> None:
    told, alike = walled(Walled.courses), walled(None)
    assert told.divergences == 0
    assert told.cliffs is not None
    assert told.cliffs > 10
    assert alike.divergences is not None
    assert alike.divergences > 10
    assert alike.cliffs == 0
    assert alike.gradients / alike.transitions > 1.5 * told.gradients / told.transitions
    convergence = assess("nuts", told)
    assert convergence.converged, convergence.sentence
    x = told.points[..., 0].ravel()
    truth = truncnorm(-np.inf, WALL)
    error = truth.std() / np.sqrt(min(convergence.ess_bulk or 0.0, x.size))
    assert abs(x.mean() - truth.mean()) < 4 * error


def test_emcee_says_where_it_made_fewer_draws_than_were_asked_for() -> None:
    target = SkewedRidge()
    samples = sample_emcee(target, target.start, draws=100_000, generator=np.random.default_rng(0), most_steps=4)
    made = samples.points.shape[0] * samples.points.shape[1]
    assert f"emcee made {made} draws, fewer than the 100000 that were asked for." in samples.notes

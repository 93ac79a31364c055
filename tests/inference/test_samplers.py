from collections.abc import Callable

import numpy as np
import pytest
import torch
from scipy.stats import norm

from vrdp_prob.inference.curved_gaussian import CurvedGaussian
from vrdp_prob.inference.emcee_sampler import sample_emcee
from vrdp_prob.inference.laplace import sample_laplace, smoothed_weights
from vrdp_prob.inference.mixture import Mixture
from vrdp_prob.inference.nuts_sampler import sample_nuts
from vrdp_prob.inference.samples import Gaussian, Samples, assess, chain_statistics

SAMPLERS = {"emcee": sample_emcee, "nuts": sample_nuts, "laplace": sample_laplace}
DIMENSION = 6


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
        options = {"rounds": 1} if name == "emcee" else {"warm_up": 20} if name == "nuts" else {}
        return sampler(target, target.start, draws=40, generator=np.random.default_rng(3), **options).points

    assert (draw(SAMPLERS[name]) == draw(SAMPLERS[name])).all()


def test_chains_at_different_places_are_not_called_converged() -> None:
    generator = np.random.default_rng(0)
    points = generator.standard_normal((4, 500, 2)) + 5 * np.arange(4)[:, None, None]
    convergence = assess("emcee", Samples(points, np.zeros((4, 500))))
    assert not convergence.converged
    assert "has not converged" in convergence.sentence


def test_effective_size_of_an_autoregressive_chain_is_the_known_one() -> None:
    generator = np.random.default_rng(0)
    memory, draws = 0.9, 20000
    noise = generator.standard_normal((4, draws))
    chain = np.zeros((4, draws))
    for step in range(1, draws):
        chain[:, step] = memory * chain[:, step - 1] + noise[:, step]
    _, ess = chain_statistics(chain[..., None])
    assert ess == pytest.approx(4 * draws * (1 - memory) / (1 + memory), rel=0.15)


def test_importance_weights_tell_a_good_proposal_from_a_bad_one() -> None:
    draws = np.random.default_rng(0).standard_normal(4000)
    weights, k_hat = smoothed_weights(norm.logpdf(draws, 0.1, 0.9) - norm.logpdf(draws))
    assert k_hat < 0.5
    assert float((weights * draws).sum()) == pytest.approx(0.1, abs=0.05)
    _, k_hat = smoothed_weights(norm.logpdf(draws, 0, 3) - norm.logpdf(draws))
    assert k_hat > 0.7


def test_importance_weights_survive_worlds_without_support() -> None:
    weights, _ = smoothed_weights(np.array([-np.inf, -np.inf, 0.0]))
    assert weights.tolist() == [0, 0, 1]

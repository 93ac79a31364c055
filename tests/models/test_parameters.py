import numpy as np
from scipy.integrate import quad
from scipy.special import expit
from scipy.stats import kstest, norm

from vrdp_prob.models.parameters import RESTITUTION


def test_prior_draws_have_the_density_with_its_soft_edge() -> None:
    prior = RESTITUTION.prior
    assert prior.upper is not None
    edge, width = prior.upper, prior.softness

    def density(value: float) -> float:
        return float(norm.pdf(value, prior.mean, prior.sd) * expit((edge - value) / width))

    total, _ = quad(density, -3, 1, points=[edge])
    grid = np.linspace(-2.5, 0.5, 301)
    cumulated = [quad(density, -3, value, points=[edge] if value > edge else None)[0] / total for value in grid]
    draws = prior.sample(np.random.default_rng(0), (40, 500)).ravel()
    # 20,000 draws: a wrong sampler that repeats the rejection of accepted draws is off by 0.03, three times the limit.
    assert kstest(draws, lambda values: np.interp(values, grid, cumulated)).pvalue > 0.001
    assert np.mean(draws > 0) < 0.02

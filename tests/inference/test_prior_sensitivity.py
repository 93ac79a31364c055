"""Power-scaling sensitivity: the exact values of normal distributions, and verdicts on scenes."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from scipy.stats import norm

from tests.inference.generator import Scene, observe
from vrdp_prob.inference import ParameterStatus, Posterior, Status, infer
from vrdp_prob.inference.prior_sensitivity import (
    POWERS,
    THRESHOLD,
    Sensitivity,
    Verdict,
    by_chance,
    power_sensitivity,
    prior_sensitivity,
)
from vrdp_prob.scene import Shape

DRAWS = 40_000


class Conjugate:
    """One unknown with a standard normal prior, measured once with a normal error."""

    def __init__(self, measured: float, error: float) -> None:
        self.measured, self.error = measured, error

    def posterior(self, prior_power: float = 1.0, likelihood_power: float = 1.0) -> tuple[float, float]:
        """Mean and standard deviation."""
        precision = prior_power + likelihood_power / self.error**2
        return likelihood_power * self.measured / self.error**2 / precision, precision**-0.5

    def draws(self) -> np.ndarray:
        mean, sd = self.posterior()
        return mean + sd * np.random.default_rng(0).standard_normal((4, DRAWS // 4))

    def sensitivities(self) -> Sensitivity:
        draws = self.draws()
        prior, likelihood = -(draws**2) / 2, -((draws - self.measured) ** 2) / (2 * self.error**2)
        return Sensitivity("x", (), power_sensitivity(draws, prior), power_sensitivity(draws, likelihood))

    def exact(self, component: str) -> float:
        """The same from the distributions themselves, over the range of the draws, as the measure is defined."""
        grid = np.linspace(self.draws().min(), self.draws().max(), 20_001)
        changes = [
            _distance(self.posterior(), self.posterior(**{f"{component}_power": power}), grid) / abs(np.log2(power))
            for power in POWERS
        ]
        return float(np.mean(changes))


def _distance(first: tuple[float, float], second: tuple[float, float], grid: np.ndarray) -> float:
    """Cumulative Jensen-Shannon distance of two normal distributions, the larger one of both directions."""
    upward = _one_way(norm.cdf(grid, *first), norm.cdf(grid, *second), grid)
    return max(upward, _one_way(norm.sf(grid, *first)[::-1], norm.sf(grid, *second)[::-1], grid))


def _one_way(p: np.ndarray, q: np.ndarray, grid: np.ndarray) -> float:
    p, q = np.maximum(p, 1e-300), np.maximum(q, 1e-300)
    middle, width = (p + q) / 2, grid[1] - grid[0]
    difference = (q.sum() - p.sum()) * width / (2 * np.log(2))
    divergence = (p * np.log2(p / middle)).sum() * width + difference
    divergence += (q * np.log2(q / middle)).sum() * width - difference
    return float(np.sqrt(divergence / ((p + q).sum() * width)))


@pytest.mark.parametrize(
    ("measured", "error", "verdict"),
    [(0.3, 0.1, Verdict.FINE), (1.0, 6.0, Verdict.PRIOR), (3.0, 0.7, Verdict.CONFLICT)],
)
def test_normal_distributions_have_the_exact_sensitivity(measured: float, error: float, verdict: Verdict) -> None:
    case = Conjugate(measured, error)
    found = case.sensitivities()
    assert found.prior == pytest.approx(case.exact("prior"), rel=0.1, abs=0.003)
    assert found.likelihood == pytest.approx(case.exact("likelihood"), rel=0.1, abs=0.003)
    assert found.verdict is verdict
    assert bool(found.sentence) is (verdict is not Verdict.FINE)


def test_what_does_not_vary_is_not_sensitive() -> None:
    draws = np.random.default_rng(0).standard_normal((2, 100))
    assert power_sensitivity(draws, np.zeros((2, 100))) == 0


def collision(offset: float, noise: float) -> Posterior:
    """A disc that hits another one head on, or hardly touches it."""
    scene = Scene(
        (Shape.CYLINDER, Shape.CYLINDER),
        np.array([[-0.8, offset], [0.0, 0.0]]),
        np.array([[1.8, 0.0], [0.0, 0.0]]),
        np.array([1.2, 0.9]),
        np.array([0.85, 0.9]),
        np.full(2, 0.2),
        np.full(2, 0.8),
    )
    return infer(observe(scene, noise=noise, frames=45, seed=1), sampler="laplace", draws=1000)


def test_a_clear_collision_is_fine_and_a_graze_rests_on_the_prior() -> None:
    clear, graze = (
        {one.quantity: one for one in prior_sensitivity(collision(*case))} for case in ((0.05, 0.002), (0.36, 0.02))
    )
    assert clear["mass_ratio"].objects == ("0", "1")
    assert clear["mass_ratio"].verdict is Verdict.FINE
    assert clear["restitution"].verdict is Verdict.FINE
    assert graze["restitution"].verdict is not Verdict.FINE
    assert graze["restitution"].prior > 1.5 * clear["restitution"].prior
    assert "rolling_resistance" not in clear
    assert clear["mass_ratio"].to_document()["verdict"] == "fine"


def test_what_the_data_say_nothing_of_has_no_sensitivity() -> None:
    known = collision(0.05, 0.002)
    nothing = ParameterStatus(Status.DEFAULT)
    data = known.data.copy(deep=True)
    data["log_prior"] = xr.DataTree(data["log_prior"].to_dataset().drop_vars("mass"))  # as where no mass is an unknown
    status = {body: replace(one, mass=nothing) for body, one in known.status.items()}
    found = {one.quantity for one in prior_sensitivity(replace(known, data=data, status=status))}
    assert "mass_ratio" not in found
    assert "restitution" in found


def test_many_numbers_that_have_nothing_to_do_with_a_quantity_do_not_make_a_conflict() -> None:
    generator = np.random.default_rng(3)
    draws = generator.standard_normal((4, 100))
    unrelated = -(generator.standard_normal((4, 100, 60)) ** 2).sum(axis=-1) / 2
    found = power_sensitivity(draws, unrelated)
    assert found > THRESHOLD
    assert Sensitivity("x", (), 0.1, found, likelihood_by_chance=by_chance(draws, unrelated)).verdict is Verdict.PRIOR

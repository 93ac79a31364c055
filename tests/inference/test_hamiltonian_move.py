import emcee
import numpy as np
import pytest

from vrdp_prob.inference.samplers.hamiltonian_move import ACCEPTANCE, FARTHEST, HamiltonianMove

SCALES = np.array([0.5, 1.0, 2.0])
WALKERS, WARM_UP, STEPS = 40, 40, 300


def density_and_gradient(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """An axis-parallel Gaussian without support where the first coordinate is above 1."""
    values = -((points / SCALES) ** 2).sum(axis=1) / 2
    supported = points[:, 0] < 1
    return np.where(supported, values, -np.inf), np.where(supported[:, None], -points / SCALES**2, 0.0)


@pytest.fixture(scope="module")
def sampled() -> tuple[HamiltonianMove, emcee.EnsembleSampler]:
    move = HamiltonianMove(density_and_gradient)
    sampler = emcee.EnsembleSampler(
        WALKERS, 3, lambda points: density_and_gradient(points)[0], moves=[move], vectorize=True
    )
    random = np.random.RandomState(4)
    start = emcee.State(0.1 * random.standard_normal((WALKERS, 3)), random_state=random.get_state())
    warm = sampler.run_mcmc(start, WARM_UP, tune=True)
    sampler.run_mcmc(warm, STEPS)
    return move, sampler


def test_moments_are_those_of_the_truncated_gaussian(sampled: tuple[HamiltonianMove, emcee.EnsembleSampler]) -> None:
    draws = sampled[1].get_chain(discard=WARM_UP, flat=True)
    # The first coordinate is cut at two of its standard deviations (moments by scipy.stats.truncnorm).
    assert draws[:, 0].max() < 1
    assert draws[:, 0].mean() == pytest.approx(-0.0553 * SCALES[0], abs=0.02)
    assert draws[:, 0].std() == pytest.approx(0.9415 * SCALES[0], rel=0.05)
    # 12,000 draws; the integrated autocorrelation time of the widest coordinate is below 10 steps.
    assert draws[:, 1:].std(axis=0) == pytest.approx(SCALES[1:], rel=0.06)
    assert np.abs(draws[:, 1:].mean(axis=0) / SCALES[1:]).max() < 0.12


def test_tuning_reaches_the_wished_acceptance_and_then_rests(
    sampled: tuple[HamiltonianMove, emcee.EnsembleSampler],
) -> None:
    move, sampler = sampled
    assert sampler.acceptance_fraction.mean() == pytest.approx(ACCEPTANCE, abs=0.12)
    tuned = move.step
    sampler.run_mcmc(None, 3)
    assert move.step == tuned


def test_a_walker_without_support_ahead_stays() -> None:
    def nowhere(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.full(len(points), -np.inf), np.zeros_like(points)

    move = HamiltonianMove(nowhere)
    places = np.arange(8.0).reshape(4, 2)
    sampler = emcee.EnsembleSampler(4, 2, lambda points: np.zeros(len(points)), vectorize=True)
    model = emcee.model.Model(None, None, map, sampler._random)
    state, accepted = move.propose(model, emcee.State(places.copy(), log_prob=np.zeros(4)))
    assert not accepted.any()
    assert (state.coords == places).all()


def test_a_walker_from_where_no_trajectory_comes_stays() -> None:
    def flat(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.zeros(len(points)), np.zeros_like(points)

    move = HamiltonianMove(flat)
    places = np.array([[0.0, 0.0], [FARTHEST + 0.01, 0.0]])
    sampler = emcee.EnsembleSampler(4, 2, lambda points: np.zeros(len(points)), vectorize=True)
    model = emcee.model.Model(None, None, map, sampler._random)
    accepted = np.array([move.propose(model, emcee.State(places.copy(), log_prob=np.zeros(2)))[1] for _ in range(20)])
    assert accepted[:, 0].all()
    assert not accepted[:, 1].any()
